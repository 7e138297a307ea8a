/** Settings: until power-off, or kept for good. */
import { shortest } from '../core';
import { PacketType, SETTINGS, Stored, type Command, type Info } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import { MAIN, element, paragraph } from '../view/elements';
import { Dialog, field, form } from './dialog';

type Setting = (typeof SETTINGS)[number];
type Name = Setting['name'];
type Value = Setting['values'][number];

/** The word of a choice, as people type it. */
function wordOf({ choices, words }: Value, number: number): string {
  const at = (choices as readonly number[] | null)?.indexOf(number) ?? -1;
  return words?.[at] ?? String(number);
}

/** How it is now, as people type it. */
function textOf(setting: Setting, info: Info): string {
  const numbers = setting.values.map((value) => info[value.info]);
  return numbers.at(-1) === 0 && setting.zeros !== null
    ? setting.zeros
    : setting.values
        .map((value, i) => {
          const number = numbers[i]! / value.per;
          return value.whole ? wordOf(value, number) : shortest(number);
        })
        .join(':');
}

/** In the packet's unit. */
function numberIn(value: Value, text: string): number {
  if (value.words) {
    const at = (value.words as readonly string[]).indexOf(text);
    if (at < 0) {
      throw new Error(`${value.title}: "${text}" is none of ${value.words.join(', ')}`);
    }
    return value.choices[at]!;
  }
  const isNumber = value.whole && value.per === 1 ? /^\d+$/.test(text) : text.trim() !== '';
  const number = isNumber ? Number(text) : NaN;
  if (value.choices) {
    if (!value.choices.some((each) => each === number)) {
      throw new Error(`${value.title}: "${text}" is none of ${value.choices.join(', ')}`);
    }
  } else if (!(number >= value.span[0] && number <= value.span[1])) {
    throw new Error(`${value.title}: "${text}" is not a number from ${value.span[0]} to ${value.span[1]}`);
  }
  return value.whole ? Math.round(number * value.per) : number;
}

function numbersIn(setting: Setting, text: string): number[] {
  if (text === setting.zeros) {
    return setting.values.map(() => 0);
  }
  const parts = text.split(':');
  if (parts.length > setting.values.length) {
    throw new Error(`${setting.label}: "${text}" has too many values; ${setting.hint}`);
  }
  return setting.values.map((value, i) =>
    parts[i] === undefined && value.unlessGiven !== null ? value.unlessGiven : numberIn(value, parts[i] ?? ''),
  );
}

/** The commands for what differs; what travels with it stays as it is. Throws Error with the range. */
export function commandsFor(info: Info, typed: Partial<Record<Name, string>>): Command[] {
  const commands = new Map<number, Record<string, number>>();
  const changed = (setting: Setting): string | null => {
    const text = typed[setting.name]?.trim();
    return text === undefined || text === textOf(setting, info) ? null : text;
  };
  const sent = new Set(SETTINGS.filter((setting) => changed(setting) !== null).map(({ command }) => command));
  for (const setting of SETTINGS.filter(({ command }) => sent.has(command))) {
    const text = changed(setting);
    const numbers = text === null ? setting.values.map((value) => info[value.info]) : numbersIn(setting, text);
    const fields = Object.fromEntries(setting.values.map((value, i) => [value.field, numbers[i]!]));
    commands.set(setting.command, { type: setting.command, ...commands.get(setting.command), ...fields });
  }
  return [...commands.values()] as unknown as Command[];
}

/** One after the other, up to one that is refused; what it has then is known in any case. */
export async function set(fingertip: Fingertip, commands: readonly Command[]): Promise<void> {
  try {
    for (const command of commands) {
      await fingertip.command(command);
    }
  } finally {
    await fingertip.askInfo();
  }
}

export function settings(fingertip: Fingertip): void {
  const { info } = fingertip;
  if (!info) {
    return;
  }
  const fields: HTMLElement[] = [];
  const inputs = new Map<Name, HTMLInputElement | HTMLSelectElement>();
  for (const setting of SETTINGS) {
    const { name, capability, label, hint } = setting;
    if (capability && !(info.capabilities & capability)) {
      continue;
    }
    const [value] = setting.values;
    const input = value.choices
      ? element(
          'select',
          { name },
          ...(setting.zeros === null ? [] : [element('option', {}, setting.zeros)]),
          ...value.choices.map((each) => element('option', {}, wordOf(value, each))),
        )
      : element('input', { name, autocomplete: 'off' });
    inputs.set(name, input);
    fields.push(field(label, input, hint));
  }
  const kept = paragraph();
  const show = (now: Info): void => {
    for (const setting of SETTINGS) {
      const input = inputs.get(setting.name);
      if (input) {
        input.value = textOf(setting, now);
      }
    }
    kept.textContent =
      now.stored & Stored.SETTINGS ? 'It starts with settings that are kept.' : "It starts with the firmware's own settings.";
  };
  show(info);

  const send = async (commands: Command[], message: string): Promise<void> => {
    await set(fingertip, commands);
    show(fingertip.info ?? info);
    dialog.setMessage(message);
  };
  const changed = (): Command[] =>
    commandsFor(fingertip.info ?? info, Object.fromEntries([...inputs].map(([name, input]) => [name, input.value])));
  const apply = (): Promise<void> => send(changed(), 'Set, until power-off.');
  const keep = (): Promise<void> => send([...changed(), { type: PacketType.CMD_KEEP, keep: 1 }], 'Set, and kept for good.');
  const forget = (): Promise<void> =>
    send([{ type: PacketType.CMD_KEEP, keep: 0 }], "Forgotten: from the next start on it has the firmware's own settings.");
  const dialog = new Dialog(`Settings of ${fingertip.name}`, form(...fields), kept);
  dialog.choose(
    [dialog.doing('Apply', apply, MAIN), dialog.doing('Apply and keep', keep), dialog.doing('Forget what is kept', forget)],
    'Close',
  );
}
