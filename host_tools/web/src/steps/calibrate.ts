/**
 * Calibrate: the tool's sessions, judgement and sentences (host_tools/tool/calibration), for the sensors'
 * gains from placements of one weight, and for the scale of the tangential force from pulls.
 */
import { load as loadJudges } from '../../wasm/judges.mjs';
import { fetched } from '../../wasm/module.mjs';
import { frameOf } from '../core';
import { PacketType, Stored } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import { PATIENCE, pause } from '../model/patience';
import { sensorsOf } from '../view/health_facts';
import { fixed } from '../view/numbers';
import type { Hand } from '../view/shown';
import { MAIN, element, paragraph } from '../view/elements';
import { Dialog, field, form } from './dialog';

type Judges = Awaited<ReturnType<typeof loadJudges>>;
type GainSession = ReturnType<Judges['gains']>;
type Calibration = ReturnType<GainSession['result']>['calibration'];

const GRAVITY_m_s2 = 9.80665;

/** null: unknown. Throws Error, a sentence. */
function forceOf(grams: string): number | null {
  if (grams.trim() === '') {
    return null;
  }
  const value = Number(grams);
  if (!(value >= 1 && value <= 10_000)) {
    throw new Error(`"${grams}" is no weight from 1 to 10000 g`);
  }
  return (value / 1000) * GRAVITY_m_s2;
}

async function checkSensors(fingertip: Fingertip): Promise<void> {
  const { sensors_present } = await fingertip.askHealth();
  const count = fingertip.info?.sensor_count ?? 0;
  const missing = sensorsOf(2 ** count - 1 - sensors_present, count);
  if (missing.length > 0) {
    throw new Error(`sensors do not answer: ${missing.join(' ')}; mend their wiring first, a calibration is of all of them`);
  }
}

interface Session {
  take(frame: Uint8Array): boolean;
  status(): { state: 'more' | 'good' | 'refused'; text: string };
  free(): void;
}

/** Gives a session its packets and shows it until it is good, then confirms its result. */
async function follow<Found extends Session>(
  dialog: Dialog,
  fingertip: Fingertip,
  type: number,
  session: Found,
  show: (status: ReturnType<Found['status']>) => void,
  confirm: () => void | Promise<void>,
): Promise<void> {
  let last_ms = performance.now();
  let problem: unknown = null;
  const end = fingertip.tap((packet) => {
    if (packet.type === type) {
      last_ms = performance.now();
      try {
        session.take(frameOf(packet));
      } catch (error) {
        problem = error;
      }
    }
  });
  try {
    let status = session.status();
    for (; status.state === 'more'; status = session.status()) {
      show(status as ReturnType<Found['status']>);
      await pause(100);
      if (dialog.is_closed) {
        return;
      }
      if (problem !== null) {
        throw problem;
      }
      if (fingertip.state === 'closed') {
        throw new Error('it vanished; nothing was written, plug it in and try again');
      }
      if (performance.now() - last_ms > PATIENCE.frame_ms) {
        throw new Error('it sends no frames; see "Doctor"');
      }
    }
    if (status.state === 'refused') {
      throw new Error(`not calibrated: ${status.text}`);
    }
    await confirm();
  } catch (error) {
    dialog.choose([], 'Close');
    throw error;
  } finally {
    end();
    session.free();
  }
}

export function calibrate(fingertip: Fingertip): void {
  const { info } = fingertip;
  if (!info) {
    return;
  }
  const knows_pad = (info.stored & Stored.PAD) !== 0;
  const calibrated = (info.stored & Stored.CALIBRATION) !== 0;
  const weight = element('input', { inputmode: 'decimal', autocomplete: 'off' });
  const dialog = new Dialog(
    `Calibrate ${fingertip.name}`,
    'Sensors under cast rubber differ by some 10 %. Set one weight on a round foot (some 300 g on a ball of ' +
      '15 mm) down at about twenty places, and give its weight if forces are to be right too.',
    ...((fingertip.line as Partial<Hand>).press
      ? ['Of a simulated one the pointer is the weight: hold it down at the mark on the pad until it is taken. 4 N are 408 g.']
      : []),
    calibrated
      ? `It is calibrated, of ${new Date(info.calibration_date_s * 1000).toISOString().slice(0, 10)}, ` +
          `from ${info.calibration_placements} placements, force scale ${info.force_scale.toFixed(3)}.`
      : info.stored & Stored.DAMAGED
        ? 'It is not calibrated; what was stored cannot be read.'
        : 'It is not calibrated.',
    form(field('Weight, g', weight, 'empty: unknown, gains alone')),
  );
  const begin = (work: (judges: Judges, info: Uint8Array, force_N: number | null) => Promise<void>) => async () => {
    const force_N = forceOf(weight.value);
    await checkSensors(fingertip);
    const [judges, info] = [await loadJudges(fetched('wasm/judges.wasm')), await fingertip.askInfo()];
    if (!dialog.is_closed) {
      await work(judges, frameOf(info), force_N);
    }
  };
  const erase = async (): Promise<void> => {
    await fingertip.command({ type: PacketType.CMD_ERASE_CALIBRATION });
    await fingertip.askInfo();
    dialog.setMessage('Erased: it is as if never calibrated.');
  };
  dialog.choose([
    dialog.doing(
      'Begin',
      begin((judges, info, force_N) => gains(dialog, fingertip, judges.gains(info), force_N)),
      MAIN,
    ),
    ...(knows_pad
      ? [
          dialog.doing(
            'Tangential force',
            begin((judges, info, force_N) => pulls(dialog, fingertip, judges, info, force_N)),
          ),
        ]
      : []),
    ...(calibrated ? [dialog.doing('Forget the calibration', erase)] : []),
  ]);
}

async function gains(dialog: Dialog, fingertip: Fingertip, session: GainSession, force_N: number | null): Promise<void> {
  const progress = paragraph();
  const text = paragraph();
  dialog.show(progress, text);
  dialog.onClose = () => fingertip.setFound(null);
  dialog.beside();
  const undo = dialog.doing('Take back the last', async () => session.takeBack());
  dialog.choose([undo]);
  await follow(
    dialog,
    fingertip,
    PacketType.RAW,
    session,
    (status) => {
      dialog.setMessage(status.advice);
      progress.textContent = status.progress;
      text.textContent = status.text;
      undo.disabled = status.placements.length === 0;
      fingertip.setFound(status);
    },
    () => confirmGains(dialog, fingertip, session, force_N),
  );
}

function confirmGains(dialog: Dialog, fingertip: Fingertip, session: GainSession, force_N: number | null): void {
  const date_s = Math.floor(Date.now() / 1000);
  const { calibration, before, after } = session.result(force_N, date_s);
  fingertip.setFound({ ...session.status(), wanted: null });
  dialog.show(
    `${session.status().text}, from ${calibration.calibration_placements} placements`,
    table(
      'Of the placements, in the median',
      ['', 'before', 'after'],
      [
        ['location off by', ...[before, after].map(({ location_mm }) => `${location_mm.toFixed(2)} mm`)],
        ['force differs by', ...[before, after].map(({ force }) => `${(100 * force).toFixed(1)} %`)],
      ],
    ),
    force_N === null
      ? 'Force scale unknown: give the weight, to calibrate forces too.'
      : `Force scale ${calibration.force_scale.toFixed(3)}, standard deviation ${calibration.force_scale_sd.toFixed(3)}.`,
    `A usual contact: sigma ${(calibration.calibration_sigma_um / 1000).toFixed(2)} mm, ` +
      `sd ${(calibration.calibration_sigma_sd_um / 1000).toFixed(2)} mm; ` +
      `dip around it ${((100 * calibration.calibration_dip_share_q16) / 65536).toFixed(1)} % of its peak.`,
    sensorTable(calibration),
  );
  dialog.offer(async () => {
    await fingertip.command({ type: PacketType.CMD_CALIBRATE, sensor_count: calibration.gain.length, ...calibration });
    const info = await fingertip.askInfo();
    if (!(info.stored & Stored.CALIBRATION) || info.calibration_date_s !== date_s) {
      throw new Error('it did not keep the calibration; see "Doctor"');
    }
  });
}

/** The first of each row is its head. */
function table(caption: string, heads: string[], rows: string[][]): HTMLElement {
  const head = (text: string, scope: string) => element(text ? 'th' : 'td', text ? { scope } : {}, text);
  return element(
    'table',
    {},
    element('caption', {}, caption),
    element('tr', {}, ...heads.map((text) => head(text, 'col'))),
    ...rows.map(([name, ...cells]) => element('tr', {}, head(name, 'row'), ...cells.map((text) => element('td', {}, text)))),
  );
}

function sensorTable({ gain, gain_sd, off_x_um, off_y_um, wider_q15 }: Calibration): HTMLElement {
  const signed = (value: number, digits: number) => `${value < 0 ? '' : '+'}${fixed(value, digits)}`;
  return table(
    'For each sensor: gain, distance from its place, how much wider its response is',
    ['sensor', 'gain', 'sd, %', 'off by x, mm', 'y, mm', 'wider by, %'],
    Array.from(gain, (value, k) => [
      String(k),
      value.toFixed(3),
      (100 * gain_sd[k]).toFixed(1),
      signed(off_x_um[k] / 1000, 2),
      signed(off_y_um[k] / 1000, 2),
      signed(100 * Math.expm1(wider_q15[k] / 32768), 1),
    ]),
  );
}

async function pulls(dialog: Dialog, fingertip: Fingertip, judges: Judges, info: Uint8Array, force_N: number | null): Promise<void> {
  if (force_N === null) {
    throw new Error('give the weight that hangs on the string');
  }
  const session = judges.pulls(info, force_N);
  const last = paragraph();
  const text = paragraph();
  dialog.show(
    'For each pull set an object of some 300 g down on the pad, leave it alone for a second, hang the weight on ' +
      'its string, which runs level over a pulley, wait for "taken", lift the object off.',
    last,
    text,
  );
  dialog.choose();
  await follow(
    dialog,
    fingertip,
    PacketType.CONTACT,
    session,
    (status) => {
      dialog.setMessage(status.advice);
      last.textContent = status.last;
      text.textContent = status.text;
    },
    async () => {
      const info = await fingertip.askInfo();
      const { tangential_scale, tangential_scale_sd } = session.result(frameOf(info));
      dialog.show(
        `Tangential scale ${info.pad_tangential_scale.toFixed(3)} before, ${tangential_scale.toFixed(3)} now, ` +
          `standard deviation ${tangential_scale_sd.toFixed(3)}.`,
      );
      const pad_tangential_scale = Math.fround(tangential_scale);
      dialog.offer(async () => {
        const profile = { ...info, pad_tangential_scale, pad_tangential_scale_sd: tangential_scale_sd };
        await fingertip.command({ ...profile, type: PacketType.CMD_PAD });
        if ((await fingertip.askInfo()).pad_tangential_scale !== pad_tangential_scale) {
          throw new Error('it did not keep the pad\'s profile; see "Doctor"');
        }
      });
    },
  );
}
