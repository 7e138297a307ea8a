/** Settings: until power-off, or kept for good. */
import { core } from '../core';
import { Capability, PacketType, RANGES, Stored, type Command, type Info } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import { Dialog, field, make, makeButton } from './dialog';

interface Setting {
  label: string;
  hint: string;
  /** What it is now, as people type it. */
  now: (info: Info) => string;
  /** Of a firmware that has it. */
  capability: number;
  choices?: string[];
}

const RATE_Hz = RANGES.RATE_mHz.map((rate_mHz) => rate_mHz / 1000) as [number, number];
const span = ([least, most]: readonly [number, number]): string => `${least} to ${most}`;

const SETTINGS = {
  rate: {
    label: 'Frame rate, Hz',
    hint: `${span(RATE_Hz)}, or max: as fast as the sensors allow`,
    now: (info) => (info.rate_mHz === 0 ? 'max' : String(info.rate_mHz / 1000)),
    capability: 0,
  },
  osr: {
    label: 'Oversampling (osr)',
    hint: 'more is quieter and slower',
    now: (info) => String(info.osr),
    capability: 0,
    choices: RANGES.OSR.map(String),
  },
  slip_threshold: {
    label: 'Slip threshold, mm',
    hint: span(RANGES.SLIP_THRESHOLD_mm),
    now: (info) => core.shortest(info.slip_threshold_mm),
    capability: Capability.SLIP,
  },
  slip_window: {
    label: 'Slip window, ms',
    hint: `${span(RANGES.SLIP_WINDOW_ms)}, and 160 frames at most`,
    now: (info) => String(info.slip_window_ms),
    capability: Capability.SLIP,
  },
  prior: {
    label: 'Prior on the width, mm',
    hint: `SIGMA, SIGMA:WIDTH or none; ${span(RANGES.PRIOR_SIGMA_mm)}, width ${span(RANGES.PRIOR_WIDTH_mm)}, ${RANGES.PRIOR_WIDTH_DEFAULT_mm} unless given; for thin pads`,
    now: (info) =>
      info.prior_width_mm === 0
        ? 'none'
        : `${core.shortest(info.prior_sigma_mm)}:${core.shortest(info.prior_width_mm)}`,
    capability: Capability.FIT,
  },
  limit: {
    label: 'Location limit, mm',
    hint: `${span(RANGES.LOCATION_LIMIT_mm)}; UNCERTAIN where location_sd_mm is above it`,
    now: (info) => core.shortest(info.location_limit_mm),
    capability: Capability.FIT,
  },
} satisfies Record<string, Setting>;
type Name = keyof typeof SETTINGS;
const NAMES = Object.keys(SETTINGS) as Name[];

function numberIn(name: string, text: string, [least, most]: readonly [number, number]): number {
  const value = text.trim() === '' ? NaN : Number(text);
  if (!(value >= least && value <= most)) {
    throw new Error(`${name}: "${text}" is not a number from ${least} to ${most}`);
  }
  return value;
}

/** The commands for what differs. Throws Error with the range. */
export function commandsFor(info: Info, typed: Partial<Record<Name, string>>): Command[] {
  const commands: Command[] = [];
  const changed = (name: Name): string | null => {
    const text = typed[name]?.trim();
    return text === undefined || text === SETTINGS[name].now(info) ? null : text;
  };
  const rate = changed('rate');
  if (rate !== null) {
    const rate_mHz = rate === 'max' ? 0 : Math.round(1000 * numberIn('Frame rate', rate, RATE_Hz));
    commands.push({ type: PacketType.CMD_RATE, rate_mHz });
  }
  const osr = changed('osr');
  if (osr !== null) {
    const known = RANGES.OSR.find((each) => String(each) === osr);
    if (known === undefined) {
      throw new Error(`Oversampling: "${osr}" is none of ${RANGES.OSR.join(', ')}`);
    }
    commands.push({ type: PacketType.CMD_OSR, osr: known });
  }
  const threshold = changed('slip_threshold');
  const window_text = changed('slip_window');
  if (threshold !== null || window_text !== null) {
    commands.push({
      type: PacketType.CMD_SLIP,
      threshold_mm:
        threshold === null ? info.slip_threshold_mm : numberIn('Slip threshold', threshold, RANGES.SLIP_THRESHOLD_mm),
      window_ms:
        window_text === null
          ? info.slip_window_ms
          : Math.round(numberIn('Slip window', window_text, RANGES.SLIP_WINDOW_ms)),
    });
  }
  const prior = changed('prior');
  if (prior !== null) {
    const [sigma, width] = prior.split(':') as [string, string | undefined];
    commands.push(
      prior === 'none'
        ? { type: PacketType.CMD_PRIOR, sigma_mm: 0, width_mm: 0 }
        : {
            type: PacketType.CMD_PRIOR,
            sigma_mm: numberIn('Prior', sigma, RANGES.PRIOR_SIGMA_mm),
            width_mm:
              width === undefined
                ? RANGES.PRIOR_WIDTH_DEFAULT_mm
                : numberIn("The prior's width", width, RANGES.PRIOR_WIDTH_mm),
          },
    );
  }
  const limit = changed('limit');
  if (limit !== null) {
    commands.push({
      type: PacketType.CMD_LOCATION_LIMIT,
      limit_mm: numberIn('Location limit', limit, RANGES.LOCATION_LIMIT_mm),
    });
  }
  return commands;
}

export function settings(fingertip: Fingertip): void {
  const { info } = fingertip;
  if (!info) {
    return;
  }
  const dialog = new Dialog(`Settings of ${fingertip.name}`);
  const form = make('form', {});
  const inputs = new Map<Name, HTMLInputElement | HTMLSelectElement>();
  for (const name of NAMES) {
    const setting: Setting = SETTINGS[name];
    if (setting.capability && !(info.capabilities & setting.capability)) {
      continue;
    }
    const input = setting.choices
      ? make('select', { name }, ...setting.choices.map((each) => make('option', {}, each)))
      : make('input', { name, autocomplete: 'off' });
    input.value = setting.now(info);
    inputs.set(name, input);
    form.append(field(setting.label, input, setting.hint));
  }
  const kept = make('p', {});
  const show = (now: Info): void => {
    for (const [name, input] of inputs) {
      input.value = SETTINGS[name].now(now);
    }
    kept.textContent =
      now.stored & Stored.SETTINGS
        ? 'It starts with settings that are kept.'
        : "It starts with the firmware's own settings.";
  };
  show(info);
  dialog.content.append(form, kept);

  const send = (commands: Command[], said: string): Promise<void> =>
    dialog.run(async () => {
      for (const command of commands) {
        await fingertip.command(command);
      }
      show(await fingertip.askInfo());
      dialog.say(said);
    });
  const typed = (): Partial<Record<Name, string>> =>
    Object.fromEntries([...inputs].map(([name, input]) => [name, input.value]));
  const apply = (keep: boolean): Promise<void> =>
    dialog.run(async () => {
      const commands = commandsFor(fingertip.info ?? info, typed());
      await send(
        keep ? [...commands, { type: PacketType.CMD_KEEP, keep: 1 }] : commands,
        keep ? 'Set, and kept for good.' : 'Set, until power-off.',
      );
    });
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    void apply(false);
  });
  dialog.choose(
    [
      makeButton('Apply', () => void apply(false), true),
      makeButton('Apply and keep', () => void apply(true)),
      makeButton(
        'Forget what is kept',
        () =>
          void send(
            [{ type: PacketType.CMD_KEEP, keep: 0 }],
            "Forgotten: from the next start on it has the firmware's own settings.",
          ),
      ),
    ],
    'Close',
  );
}
