/**
 * A file that a run fills. What cannot be written ends this file, not the run: `failure` then holds one line,
 * `onFailure(line)` was called once, and further bytes are dropped.
 */
import { closeSync, openSync, writeFileSync } from 'node:fs';
import { InputError, inWords } from './errors.mjs';

const BUFFER_BYTES = 65536;

export class OutputFile {
  /** Throws InputError if the file cannot be opened. Without a path, what is written goes nowhere. */
  constructor(path, { header, onFailure = () => {} } = {}) {
    this.path = path;
    this.onFailure = onFailure;
    this.failure = null;
    this.pending = [];
    this.size = 0;
    if (!path) return;
    try {
      this.fd = openSync(path, 'w');
    } catch (error) {
      throw new InputError(`${path}: cannot write (${inWords(error)}); check the folder`);
    }
    if (header) this.write(Buffer.from(`${header}\n`));
  }

  write(bytes) {
    if (!this.path || this.failure) return;
    this.pending.push(Buffer.from(bytes));
    this.size += bytes.length;
    if (this.size > BUFFER_BYTES) this.#flush();
  }

  close() {
    if (!this.path) return;
    if (!this.failure) this.#flush();
    this.#attempt(() => closeSync(this.fd));
  }

  #flush() {
    const all = Buffer.concat(this.pending);
    this.pending = [];
    this.size = 0;
    this.#attempt(() => writeFileSync(this.fd, all));
  }

  #attempt(action) {
    try {
      action();
    } catch (error) {
      if (this.failure) return;
      this.failure = `${this.path}: cannot write (${inWords(error)}); the file is not complete`;
      this.onFailure(this.failure);
    }
  }
}
