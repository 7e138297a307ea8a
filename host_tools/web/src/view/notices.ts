const PLAIN_MOST = 3;

/** The numbers of those that leave when one has come, of all from the oldest on: the oldest plain ones, and of each text all but the last. */
export function leaving(all: readonly { text: string | null; is_plain: boolean }[]): number[] {
  const last = all.filter(({ text }, i) => !all.slice(i + 1).some((later) => later.text === text));
  const left = last.filter(({ is_plain }) => is_plain).slice(0, -PLAIN_MOST);
  return all.flatMap((each, i) => (last.includes(each) && !left.includes(each) ? [] : [i]));
}
