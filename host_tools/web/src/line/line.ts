/** A byte stream to one fingertip: Web Serial (serial_line.ts), simulated (src/simulated), or a
 * replay (src/recording/replay_line.ts). */
export interface Line {
  readonly label: string;
  /**
   * receive: bytes as they come, valid during the call alone, with performance.now() of their
   * arrival; closed: once, if it ends without close(), a sentence with the reason and what to do.
   * Rejects with an Error whose message states what to do.
   */
  open(receive: (bytes: Uint8Array, at_ms: number) => void, closed: (why: string) => void): Promise<void>;
  send(bytes: Uint8Array): Promise<void>;
  close(): Promise<void>;
}
