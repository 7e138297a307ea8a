// Builds by_page.ts and runs it. usage: node by_page.mjs FOLDER CORE.wasm JOBS.json > answers.json
import { resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { built } from '../support/built_page.mjs';

const [folder, core, jobs] = process.argv.slice(2).map((path) => resolve(path));
const [program] = await built(folder, [fileURLToPath(new URL('by_page.ts', import.meta.url))]);
process.env.FINGERTIP_CORE = core;
process.argv = [process.argv[0], program, jobs];
await import(pathToFileURL(program));
