/** Where a recording goes: a file that is written as it grows, where the browser can, else kept and
 * downloaded at its end. */

export interface Output {
  readonly name: string;
  /** Writes are done in order; finish and failure report the first that failed. */
  write(bytes: Uint8Array<ArrayBuffer>): void;
  finish(): Promise<void>;
  /** Empty: none yet. */
  readonly failure: string;
}

/** A page that keeps more than this in memory would not last. */
const KEPT_MOST_bytes = 512 * 2 ** 20;

class FileOutput implements Output {
  failure = '';
  private last: Promise<void> = Promise.resolve();

  constructor(
    readonly name: string,
    private readonly file: FileSystemWritableFileStream,
  ) {}

  write(bytes: Uint8Array<ArrayBuffer>): void {
    this.last = this.last.then(async () => {
      if (!this.failure) {
        await this.file.write(bytes).catch((error: unknown) => {
          this.failure = `${this.name} cannot be written (${String(error)}): is the disk full?`;
        });
      }
    });
  }

  async finish(): Promise<void> {
    await this.last;
    await this.file.close().catch((error: unknown) => {
      this.failure ||= `${this.name} cannot be finished (${String(error)}): is the disk full?`;
    });
    if (this.failure) {
      throw new Error(this.failure);
    }
  }
}

class DownloadOutput implements Output {
  failure = '';
  private readonly parts: Uint8Array<ArrayBuffer>[] = [];
  private length = 0;

  constructor(readonly name: string) {}

  write(bytes: Uint8Array<ArrayBuffer>): void {
    if (this.length + bytes.length > KEPT_MOST_bytes) {
      this.failure = `${this.name} has become too large to be kept by this browser: what came until now is saved`;
      return;
    }
    this.length += bytes.length;
    this.parts.push(bytes);
  }

  finish(): Promise<void> {
    download(new Blob(this.parts), this.name);
    return this.failure ? Promise.reject(new Error(this.failure)) : Promise.resolve();
  }
}

export function download(blob: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Asks where to write; needs a click. null: nothing was chosen. instead: what to do where the browser refuses. */
export async function chooseFile(name: string, instead: string): Promise<{ name: string; stream: FileSystemWritableFileStream } | null> {
  try {
    const handle = await window.showSaveFilePicker({ suggestedName: name });
    return { name: handle.name, stream: await handle.createWritable() };
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') {
      return null;
    }
    throw new Error(`the browser does not let this page write there (${String(error)}): ${instead}`);
  }
}

/** A file of the user's choice, if the browser lets a page write files. null: nothing was chosen. */
export async function chooseOutput(name: string): Promise<Output | null> {
  if (!('showSaveFilePicker' in window)) {
    return new DownloadOutput(name);
  }
  const file = await chooseFile(name, 'choose another folder');
  return file && new FileOutput(file.name, file.stream);
}
