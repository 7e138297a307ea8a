/** The functions of a 32-bit little-endian ELF file: [{name, start, end}], by address, aliases joined with "=". */
import { readFileSync } from 'node:fs';
import { InputError, inWords } from '../../simulation/emulator/errors.mjs';

const [SYMBOL_TABLE, FUNCTION] = [2, 2];

export function readFunctions(path) {
  let file;
  try {
    file = readFileSync(path);
  } catch (error) {
    throw new InputError(`${path}: cannot read (${inWords(error)}); build the image first`);
  }
  if (file.length < 52 || file.readUInt32BE(0) !== 0x7f454c46 || file[4] !== 1 || file[5] !== 1)
    throw new InputError(`${path}: not a 32-bit little-endian ELF file`);
  const [heads, size, count] = [file.readUInt32LE(32), file.readUInt16LE(46), file.readUInt16LE(48)];
  const section = (i) => Array.from({ length: 10 }, (_, word) => file.readUInt32LE(heads + i * size + 4 * word));
  const byStart = new Map();
  for (let i = 0; i < count; i++) {
    const [, type, , , offset, bytes, strings] = section(i);
    if (type !== SYMBOL_TABLE) continue;
    const names = section(strings)[4];
    for (let at = offset; at < offset + bytes; at += 16) {
      if ((file[at + 12] & 15) !== FUNCTION) continue;
      const nameAt = names + file.readUInt32LE(at);
      const name = file.toString('latin1', nameAt, file.indexOf(0, nameAt));
      const start = file.readUInt32LE(at + 4) & ~1;
      const known = byStart.get(start);
      if (known) known.name += `=${name}`;
      else byStart.set(start, { name, start, bytes: file.readUInt32LE(at + 8) });
    }
  }
  const functions = [...byStart.values()].sort((a, b) => a.start - b.start);
  functions.forEach((f, i) => {
    f.end = f.bytes ? f.start + f.bytes : (functions[i + 1]?.start ?? f.start + 2);
  });
  return functions;
}
