/** All fingertips of the page, in the order in which they came. */
import type { Fingertip } from './fingertip';

export class Bench {
  readonly fingertips: Fingertip[] = [];
  private readonly listeners = new Set<() => void>();

  /** Called after one was added or removed. Returns what ends it. */
  listen(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  add(fingertip: Fingertip): void {
    this.fingertips.push(fingertip);
    this.listeners.forEach((listener) => listener());
  }

  remove(fingertip: Fingertip): void {
    const at = this.fingertips.indexOf(fingertip);
    if (at >= 0) {
      this.fingertips.splice(at, 1);
      this.listeners.forEach((listener) => listener());
    }
  }
}
