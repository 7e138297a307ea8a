/** Settings: until power-off, or kept for good; ranges of firmware/wire/packet.h. */
import { Capability, PacketType, Stored, type Command, type Info } from '../line/packets';
import type { Fingertip } from '../model/fingertip';
import { shortest } from '../recording/text';
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

const SETTINGS = {
  rate: {
    label: 'Frame rate, Hz',
    hint: '0.1 to 2000, or max: as fast as the sensors allow',
    now: (info) => (info.rate_mHz === 0 ? 'max' : String(info.rate_mHz / 1000)),
    capability: 0,
  },
  osr: {
    label: 'Oversampling (osr)',
    hint: 'more is quieter and slower',
    now: (info) => String(info.osr),
    capability: 0,
    choices: ['256', '512', '1024', '2048', '4096', '8192'],
  },
  slip_threshold: {
    label: 'Slip threshold, mm',
    hint: '0.01 to 50',
    now: (info) => shortest(info.slip_threshold_mm),
    capability: Capability.SLIP,
  },
  slip_window: {
    label: 'Slip window, ms',
    hint: '5 to 1000, and 160 frames at most',
    now: (info) => String(info.slip_window_ms),
    capability: Capability.SLIP,
  },
  prior: {
    label: 'Prior on the width, mm',
    hint: 'SIGMA, SIGMA:WIDTH or none; 0.5 to 100, width 0.01 to 100, 0.5 unless given; for thin pads',
    now: (info) =>
      info.prior_width_mm === 0
        ? 'none'
        : `${shortest(info.prior_sigma_mm)}:${shortest(info.prior_width_mm)}`,
    capability: Capability.FIT,
  },
  limit: {
    label: 'Location limit, mm',
    hint: '0.01 to 100; UNCERTAIN where location_sd_mm is above it',
    now: (info) => shortest(info.location_limit_mm),
    capability: Capability.FIT,
  },
} satisfies Record<string, Setting>;
type Name = keyof typeof SETTINGS;
const NAMES = Object.keys(SETTINGS) as Name[];

const PRIOR_WIDTH_mm = 0.5;

function numberIn(name: string, text: string, least: number, most: number): number {
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
    const rate_mHz = rate === 'max' ? 0 : Math.round(1000 * numberIn('Frame rate', rate, 0.1, 2000));
    commands.push({ type: PacketType.CMD_RATE, rate_mHz });
  }
  const osr = changed('osr');
  if (osr !== null) {
    commands.push({ type: PacketType.CMD_OSR, osr: numberIn('Oversampling', osr, 256, 8192) });
  }
  const threshold = changed('slip_threshold');
  const window_text = changed('slip_window');
  if (threshold !== null || window_text !== null) {
    commands.push({
      type: PacketType.CMD_SLIP,
      threshold_mm:
        threshold === null ? info.slip_threshold_mm : numberIn('Slip threshold', threshold, 0.01, 50),
      window_ms:
        window_text === null
          ? info.slip_window_ms
          : Math.round(numberIn('Slip window', window_text, 5, 1000)),
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
            sigma_mm: numberIn('Prior', sigma, 0.5, 100),
            width_mm:
              width === undefined ? PRIOR_WIDTH_mm : numberIn("The prior's width", width, 0.01, 100),
          },
    );
  }
  const limit = changed('limit');
  if (limit !== null) {
    commands.push({
      type: PacketType.CMD_LOCATION_LIMIT,
      limit_mm: numberIn('Location limit', limit, 0.01, 100),
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
