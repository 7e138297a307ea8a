const PLAIN_MOST = 3;

/** Which notices leave once the last of them has come, as numbers in all, oldest first: those with the text of a later one, and plain ones
 * but for the last PLAIN_MOST of them. */
export function leaving(all: readonly { text: string | null; is_plain: boolean }[]): number[] {
  const last = all.filter(({ text }, i) => !all.slice(i + 1).some((later) => later.text === text));
  const left = last.filter(({ is_plain }) => is_plain).slice(0, -PLAIN_MOST);
  return all.flatMap((each, i) => (last.includes(each) && !left.includes(each) ? [] : [i]));
}
