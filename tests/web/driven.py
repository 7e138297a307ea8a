"""Steps on the page that its tests and the nightly ones share."""

COUNTS = """(() => {
  const [first] = fingertip.fingertips;
  return {at_ms: performance.now(), pictures: fingertip.pictures, frames: first.contacts, raws: first.raws, lost: first.lost};
})()"""


def ready_s(page):
    """From the address to a picture and buttons that work."""
    return page.until("globalThis.fingertip?.ready_ms") / 1000


def connected(page, count):
    """So many fingertips stream."""
    page.until(f"globalThis.fingertip?.fingertips.filter(each => each.state === 'live' && each.contacts > 0).length === {count}")
