/**
 * What a host program does on the CDC port, at emulated times, from a text file:
 *
 *     # comment
 *     0.9 dtr 1
 *     1.0 a55a00
 *     2.5 baud 1200
 */
import { InputError, readText } from '../errors.mjs';

export function parseHostScript(text, file) {
  const steps = [];
  text.split(/\r?\n/).forEach((line, index) => {
    const words = line.replace(/#.*/, '').trim().split(/\s+/);
    if (words[0] === '') return;
    const fail = (message) => {
      throw new InputError(`${file}:${index + 1}: ${message}`);
    };
    const t_s = Number(words[0]);
    if (!Number.isFinite(t_s) || t_s < 0) fail(`"${words[0]}" is no time in seconds`);
    const [, what, argument] = words;
    if (what === 'dtr' && words.length === 3 && /^[01]$/.test(argument)) steps.push({ t_s, dtr: argument === '1' });
    else if (what === 'baud' && words.length === 3 && /^[1-9][0-9]*$/.test(argument)) steps.push({ t_s, baud: Number(argument) });
    else if (words.length === 2 && /^([0-9a-fA-F]{2})+$/.test(what)) steps.push({ t_s, bytes: Uint8Array.from(Buffer.from(what, 'hex')) });
    else fail('expected "TIME_S HEXBYTES", "TIME_S dtr 0|1" or "TIME_S baud N"');
  });
  return steps;
}

export const readHostScript = (file) => parseHostScript(readText(file, 'host script'), file);

export function scheduleHostScript(steps, scope, cdc) {
  for (const step of steps) {
    scope
      .createAlarm(() => {
        if (step.bytes) cdc.write(step.bytes);
        else if (step.baud) cdc.setBaud(step.baud);
        else cdc.setDtr(step.dtr);
      })
      .scheduleAt(step.t_s * 1e9);
  }
}
