/** Command lines whose options are those of the usage text: a line "  --name VALUE  ..." or "  --flag  ...". */
import { parseArgs } from 'node:util';
import { InputError } from './errors.mjs';

/** Throws InputError unless `check` holds of this text as a number. */
export function numberOf(name, text, check, what) {
  const value = Number(text);
  if (text.trim() === '' || !check(value)) throw new InputError(`--${name} "${text}" is not ${what}`);
  return value;
}

export const isWhole = (low, high) => (value) => Number.isInteger(value) && value >= low && value <= high;
export const isPositive = (value) => Number.isFinite(value) && value > 0;

/** parseArgs takes "-1" behind "--name" for an option: join the two, so that the value is judged. */
function joinNegativeNumbers(argv, options) {
  const end = argv.includes('--') ? argv.indexOf('--') : argv.length;
  const joined = [];
  for (const argument of argv.slice(0, end)) {
    const name = joined.at(-1) ?? '';
    if (/^-[.0-9]/.test(argument) && name.startsWith('--') && options[name.slice(2)]?.type === 'string')
      joined[joined.length - 1] = `${name}=${argument}`;
    else joined.push(argument);
  }
  return [...joined, ...argv.slice(end)];
}

function parse(usage, { defaults, needed, allowPositionals }) {
  const options = { help: { type: 'boolean', short: 'h' } };
  for (const [, name, value] of usage.matchAll(/^ {2}--([a-z-]+)( \S+)?/gm)) {
    options[name] = { type: value ? 'string' : 'boolean' };
    if (name in defaults) options[name].default = defaults[name];
  }
  let parsed;
  try {
    parsed = parseArgs({ args: joinNegativeNumbers(process.argv.slice(2), options), options, strict: true, allowPositionals });
  } catch (error) {
    throw new InputError(`${error.message.split('\n')[0]}; see --help`);
  }
  const missing = parsed.values.help ? undefined : needed.find((name) => !parsed.values[name]);
  if (missing) throw new InputError(`--${missing} is missing; see --help`);
  return parsed;
}

/** The whole process: parses the command line, and calls run(values, positionals) for its exit code. */
export async function main(usage, { defaults = {}, needed = [], allowPositionals = false }, run) {
  try {
    const { values, positionals } = parse(usage, { defaults, needed, allowPositionals });
    if (values.help) process.stdout.write(`${usage}\n`);
    else process.exitCode = await run(values, positionals);
  } catch (error) {
    if (!(error instanceof InputError)) throw error;
    process.stderr.write(`error: ${error.message}\n`);
    process.exitCode = 2;
  }
}
