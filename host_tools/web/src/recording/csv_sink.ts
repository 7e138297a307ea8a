/** A recording as CSV; whole lines are written, some 64 kB at a time. */
import type { LineSink } from './lines';
import type { Output } from './output';

const PART_characters = 1 << 16;

export class CsvSink implements LineSink {
  private text = '';
  private readonly encoder = new TextEncoder();

  constructor(private readonly output: Pick<Output, 'write'>) {}

  line(text: string): void {
    this.text += text + '\n';
    if (this.text.length >= PART_characters) {
      this.flush();
    }
  }

  row(text: string): void {
    this.line(text);
  }

  finish(): Promise<void> {
    this.flush();
    return Promise.resolve();
  }

  private flush(): void {
    this.output.write(this.encoder.encode(this.text));
    this.text = '';
  }
}
