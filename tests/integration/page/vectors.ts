/** The byte images of tests/vectors/wire, assembled by hand from PROTOCOL.md. */
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';

const folder = join(process.env['FINGERTIP_SOURCE'] ?? '.', 'tests/vectors/wire');

export interface Vector {
  name: string;
  packet: Uint8Array;
  frame: Uint8Array;
}

function readVectors(): Vector[] {
  return readdirSync(folder)
    .sort()
    .map((name) => {
      const bytes: Record<string, number[]> = { packet: [], frame: [] };
      let to: number[] = [];
      for (const line of readFileSync(join(folder, name), 'ascii').split('\n')) {
        for (const word of line.replace(/#.*/, '').trim().split(/\s+/).filter(Boolean)) {
          if (word in bytes) {
            to = bytes[word]!;
          } else {
            to.push(parseInt(word, 16));
          }
        }
      }
      return {
        name: name.replace('.txt', ''),
        packet: Uint8Array.from(bytes['packet']!),
        frame: Uint8Array.from(bytes['frame']!),
      };
    });
}

export function vector(name: string): Vector {
  const found = readVectors().find((each) => each.name === name);
  if (!found) {
    throw new Error(`there is no vector ${name}`);
  }
  return found;
}
