/** A raw flash image from a file. */
import { InputError, readInput } from './errors.mjs';

export function readImage(path) {
  const image = readInput(path, 'image', { advice: 'build it first' });
  if (image.length < 512 || image.length > 2 * 1024 * 1024)
    throw new InputError(`${path}: ${image.length} bytes; a raw flash image has 512 bytes to 2 MiB`);
  if (image.readUInt32LE(0) === 0x0a324655 || image.readUInt32LE(0) === 0x464c457f)
    throw new InputError(`${path}: this is a UF2 or ELF file; give the raw .bin image`);
  return image;
}
