const PLAIN_MOST = 3;

/** Those of all notices, the oldest first, that leave when one has come: a fault stays until it is closed. */
export function leaving<Notice>(all: readonly Notice[], isPlain: (notice: Notice) => boolean): Notice[] {
  return all.filter(isPlain).slice(0, -PLAIN_MOST);
}
