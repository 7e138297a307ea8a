/** A byte stream to one fingertip: Web Serial, simulated, or a replay. */
export interface Line {
  readonly label: string;
  /** receive: bytes as they come, with performance.now() of their arrival; closed: once, if it ends without close(). Rejects with an Error
   * whose message says what to do. */
  open(receive: (bytes: Uint8Array, at_ms: number) => void, closed: (why: string) => void): Promise<void>;
  send(bytes: Uint8Array): Promise<void>;
  close(): Promise<void>;
}
