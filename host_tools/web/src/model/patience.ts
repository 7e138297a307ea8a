/**
 * How long the page waits for what may never come. A page whose time a test owns waits as long as
 * `fingertipPatience` overrides some of these, if it is set before the page starts.
 */
const USUAL = {
  /** Tries of a command, answer_ms apart. An answer to any of them counts. */
  tries: 3,
  answer_ms: 1000,
  /** Where the firmware first writes its flash: within half a second, and a margin. */
  stored_ms: 3000,
  /** For a sign of another version of the protocol. */
  version_ms: 1000,
  /** Without a frame; the slowest rate is one in ten seconds. */
  frame_ms: 12_000,
  /** A tare: at the slowest rate it takes three frames of 10 s. */
  tared_ms: 35_000,
  /** Until a fingertip has restarted with new firmware. */
  back_ms: 30_000,
};

declare global {
  var fingertipPatience: Partial<typeof USUAL> | undefined;
}

export const PATIENCE = { ...USUAL, ...globalThis.fingertipPatience };

export const pause = (ms: number): Promise<void> => new Promise((done) => setTimeout(done, ms));
