/**
 * Calibrate: the tool's sessions, judgement and sentences (host_tools/tool/calibration), for the sensors'
 * gains from placements of one weight, and for the scale of the tangential force from pulls.
 */
import { Capability, PacketType, Stored, type Info } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import { PATIENCE } from '../model/patience';
import { loadJudges, type GainResult, type GainSession, type Judges, type PullSession } from '../judges/judges';
import { Dialog, field, make, makeButton } from './dialog';

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

function frameOfInfo(fingertip: Fingertip): Promise<Uint8Array> {
  return new Promise((done, failed) => {
    const end = fingertip.tap((packet, frame) => {
      if (packet.type === PacketType.INFO) {
        end();
        done(frame());
      }
    });
    fingertip.askInfo().catch((error: unknown) => {
      end();
      failed(error instanceof Error ? error : new Error(String(error)));
    });
  });
}

async function checkSensors(fingertip: Fingertip): Promise<void> {
  const { sensors_present } = await fingertip.askHealth();
  const missing = Array.from({ length: fingertip.info?.sensor_count ?? 0 }, (_, k) => k).filter((k) => !((sensors_present >>> k) & 1));
  if (missing.length > 0) {
    throw new Error(`sensors do not answer: ${missing.join(' ')}; mend their wiring first, a calibration is of all of them`);
  }
}

/** Shows a session until it is good or refused; false: the dialog was closed before. */
function follow(
  dialog: Dialog,
  fingertip: Fingertip,
  type: number,
  take: (frame: Uint8Array) => void,
  show: () => boolean,
): Promise<boolean> {
  return new Promise((done, failed) => {
    let last_ms = performance.now();
    const end = fingertip.tap((packet, frame) => {
      if (packet.type === type) {
        last_ms = performance.now();
        try {
          take(frame());
        } catch (error) {
          stop();
          failed(error instanceof Error ? error : new Error(String(error)));
        }
      }
    });
    const timer = setInterval(() => {
      try {
        if (dialog.is_closed) {
          stop();
          done(false);
        } else if (fingertip.state === 'closed') {
          throw new Error('it vanished; nothing was written, plug it in and try again');
        } else if (performance.now() - last_ms > PATIENCE.frame_ms) {
          throw new Error('it sends no frames; see "Doctor"');
        } else if (!show()) {
          stop();
          done(true);
        }
      } catch (error) {
        stop();
        failed(error instanceof Error ? error : new Error(String(error)));
      }
    }, 100);
    const stop = (): void => {
      clearInterval(timer);
      end();
    };
  });
}

export function calibrate(fingertip: Fingertip): void {
  const { info } = fingertip;
  if (!info) {
    return;
  }
  const dialog = new Dialog(`Calibrate ${fingertip.name}`);
  const knows_pad = (info.capabilities & Capability.TANGENTIAL) !== 0 && (info.stored & Stored.PAD) !== 0;
  const calibrated = info.stored & Stored.CALIBRATION;
  dialog.content.append(
    make(
      'p',
      {},
      'Sensors under cast rubber differ by some 10 %. Set one weight on a round foot (some 300 g on a ball of ' +
        '15 mm) down at about twenty places, and give its weight if forces are to be right too.',
    ),
    make(
      'p',
      {},
      calibrated
        ? `It is calibrated, of ${new Date(info.calibration_date_s * 1000).toISOString().slice(0, 10)}, ` +
            `from ${info.calibration_placements} placements, force scale ${info.force_scale.toFixed(3)}.`
        : info.stored & Stored.DAMAGED
          ? 'It is not calibrated; what was stored cannot be read.'
          : 'It is not calibrated.',
    ),
  );
  const weight = make('input', { inputmode: 'decimal', autocomplete: 'off' });
  const form = make('form', {}, field('Weight, g', weight, 'empty: unknown, gains alone'));
  form.addEventListener('submit', (event) => event.preventDefault());
  dialog.content.append(form);
  const start = (work: (judges: Judges, force_N: number | null) => Promise<void>): void =>
    void dialog.run(async () => {
      const force_N = forceOf(weight.value);
      await checkSensors(fingertip);
      await work(await loadJudges(), force_N);
    });
  dialog.choose([
    makeButton('Begin', () => start((judges, force_N) => gains(dialog, fingertip, judges, force_N)), true),
    ...(knows_pad ? [makeButton('Tangential force', () => start((judges, force_N) => pulls(dialog, fingertip, judges, force_N)))] : []),
    ...(calibrated
      ? [
          makeButton(
            'Forget the calibration',
            () =>
              void dialog.run(async () => {
                await fingertip.command({ type: PacketType.CMD_ERASE_CALIBRATION });
                await fingertip.askInfo();
                dialog.setMessage('Erased: it is as if never calibrated.');
              }),
          ),
        ]
      : []),
  ]);
}

async function gains(dialog: Dialog, fingertip: Fingertip, judges: Judges, force_N: number | null): Promise<void> {
  const session = judges.gains(await frameOfInfo(fingertip));
  const progress = make('p', {});
  const text = make('p', {});
  const places = make('ol', { class: 'placements', 'aria-label': 'Placements' });
  dialog.content.replaceChildren(progress, text, places);
  const undo = makeButton('Take back the last', () => session.takeBack());
  dialog.choose([undo]);
  let listed = '';
  try {
    const ended = await follow(
      dialog,
      fingertip,
      PacketType.RAW,
      (frame) => session.take(frame),
      () => {
        const status = session.status();
        dialog.setMessage(`${finderWords(status.finder)}${status.advice}`);
        progress.textContent = status.progress;
        text.textContent = status.text;
        undo.disabled = status.placements.length === 0;
        const list = JSON.stringify(status.placements);
        if (list !== listed) {
          listed = list;
          places.replaceChildren(
            ...status.placements.map((each) =>
              make(
                'li',
                {},
                `x ${each.x_mm.toFixed(1)} y ${each.y_mm.toFixed(1)} mm${each.kept ? '' : ', left out: it does not fit the others'}`,
              ),
            ),
          );
        }
        return status.state === 'more';
      },
    );
    if (!ended) {
      session.free();
      return;
    }
    const status = session.status();
    if (status.state === 'refused') {
      throw new Error(`not calibrated: ${status.text}`);
    }
    confirmGains(dialog, fingertip, session, force_N);
  } catch (error) {
    dialog.choose([], 'Close');
    session.free();
    throw error;
  }
}

function finderWords(finder: string): string {
  return finder === 'settling' ? 'Hold still. ' : finder === 'taken' ? 'Taken: lift it off. ' : '';
}

function confirmGains(dialog: Dialog, fingertip: Fingertip, session: GainSession, force_N: number | null): void {
  const date_s = Math.floor(Date.now() / 1000);
  const { calibration, before, after } = session.result(force_N, date_s);
  const { text } = session.status();
  session.free();
  const rows: [string, string, string][] = [
    ['location off by', `${before.location_mm.toFixed(2)} mm`, `${after.location_mm.toFixed(2)} mm`],
    ['force differs by', `${(100 * before.force).toFixed(1)} %`, `${(100 * after.force).toFixed(1)} %`],
  ];
  dialog.content.replaceChildren(
    make('p', {}, `${text}, from ${calibration.placements} placements`),
    make(
      'table',
      {},
      make('caption', {}, 'Of the placements, in the median'),
      make('tr', {}, make('td'), make('th', { scope: 'col' }, 'before'), make('th', { scope: 'col' }, 'after')),
      ...rows.map(([name, old, now]) => make('tr', {}, make('th', { scope: 'row' }, name), make('td', {}, old), make('td', {}, now))),
    ),
    make(
      'p',
      {},
      force_N === null
        ? 'Force scale unknown: give the weight, to calibrate forces too.'
        : `Force scale ${calibration.force_scale.toFixed(3)}, standard deviation ${calibration.force_scale_sd.toFixed(3)}.`,
    ),
    make(
      'p',
      {},
      `A usual contact: sigma ${(calibration.sigma_um / 1000).toFixed(2)} mm, sd ${(calibration.sigma_sd_um / 1000).toFixed(2)} mm; ` +
        `dip around it ${((100 * calibration.dip_share_q16) / 65536).toFixed(1)} % of its peak.`,
    ),
    sensorTable(calibration),
  );
  dialog.setMessage('Store it in the fingertip?');
  dialog.choose([
    makeButton(
      'Store',
      () =>
        void dialog.run(async () => {
          await fingertip.command({
            type: PacketType.CMD_CALIBRATE,
            sensor_count: calibration.gain.length,
            calibration_date_s: calibration.date_s,
            calibration_placements: calibration.placements,
            force_scale: calibration.force_scale,
            force_scale_sd: calibration.force_scale_sd,
            calibration_sigma_um: calibration.sigma_um,
            calibration_sigma_sd_um: calibration.sigma_sd_um,
            calibration_dip_share_q16: calibration.dip_share_q16,
            calibration_dip_sd_um: calibration.dip_sd_um,
            calibration_ambient_kPa: calibration.ambient_kPa,
            gain: calibration.gain,
            gain_sd: calibration.gain_sd,
            off_x_um: calibration.off_x_um,
            off_y_um: calibration.off_y_um,
            wider_q15: calibration.wider_q15,
          });
          const info = await fingertip.askInfo();
          if (!(info.stored & Stored.CALIBRATION) || info.calibration_date_s !== date_s) {
            throw new Error('it did not keep the calibration; see "Doctor"');
          }
          dialog.setMessage('Stored: it applies from now on, and without power.');
          dialog.choose([], 'Close');
        }),
      true,
    ),
  ]);
}

/** A row for each sensor. */
function sensorTable(calibration: GainResult['calibration']): HTMLElement {
  const signed = (value: number, digits: number) => `${value < 0 ? '\u2212' : '+'}${Math.abs(value).toFixed(digits)}`;
  const heads = ['sensor', 'gain', 'sd, %', 'off by x, mm', 'y, mm', 'wider by, %'];
  return make(
    'table',
    {},
    make('caption', {}, 'For each sensor: gain, distance from its place, how much wider its response is'),
    make('tr', {}, ...heads.map((head) => make('th', { scope: 'col' }, head))),
    ...calibration.gain.map((gain, k) =>
      make(
        'tr',
        {},
        make('th', { scope: 'row' }, String(k)),
        ...[
          gain.toFixed(3),
          (100 * calibration.gain_sd[k]!).toFixed(1),
          signed(calibration.off_x_um[k]! / 1000, 2),
          signed(calibration.off_y_um[k]! / 1000, 2),
          signed(100 * Math.expm1(calibration.wider_q15[k]! / 32768), 1),
        ].map((text) => make('td', {}, text)),
      ),
    ),
  );
}

async function pulls(dialog: Dialog, fingertip: Fingertip, judges: Judges, force_N: number | null): Promise<void> {
  if (force_N === null) {
    throw new Error('give the weight that hangs on the string');
  }
  const session: PullSession = judges.pulls(await frameOfInfo(fingertip), force_N);
  const last = make('p', {});
  const text = make('p', {});
  dialog.content.replaceChildren(
    make(
      'p',
      {},
      'For each pull set an object of some 300 g down on the pad, leave it alone for a second, hang the weight on ' +
        'its string, which runs level over a pulley, wait for "taken", lift the object off.',
    ),
    last,
    text,
  );
  dialog.choose();
  try {
    const ended = await follow(
      dialog,
      fingertip,
      PacketType.CONTACT,
      (frame) => session.take(frame),
      () => {
        const status = session.status();
        dialog.setMessage(status.advice);
        last.textContent = status.last;
        text.textContent = status.text;
        return status.state === 'more';
      },
    );
    if (!ended) {
      return;
    }
    const status = session.status();
    if (status.state === 'refused') {
      throw new Error(`not calibrated: ${status.text}`);
    }
    confirmPulls(dialog, fingertip, session.result(await frameOfInfo(fingertip)));
  } catch (error) {
    dialog.choose([], 'Close');
    throw error;
  } finally {
    session.free();
  }
}

function confirmPulls(dialog: Dialog, fingertip: Fingertip, result: { tangential_scale: number; tangential_scale_sd: number }): void {
  const info = fingertip.info as Info;
  dialog.content.replaceChildren(
    make(
      'p',
      {},
      `Tangential scale ${info.pad_tangential_scale.toFixed(3)} before, ${result.tangential_scale.toFixed(3)} now, ` +
        `standard deviation ${result.tangential_scale_sd.toFixed(3)}.`,
    ),
  );
  dialog.setMessage('Store it in the fingertip?');
  dialog.choose([
    makeButton(
      'Store',
      () =>
        void dialog.run(async () => {
          const pad_tangential_scale = Math.fround(result.tangential_scale);
          const pad_tangential_scale_sd = result.tangential_scale_sd;
          await fingertip.command({ ...info, type: PacketType.CMD_PAD, pad_tangential_scale, pad_tangential_scale_sd });
          const now = await fingertip.askInfo();
          if (now.pad_tangential_scale !== pad_tangential_scale) {
            throw new Error('it did not keep the pad\'s profile; see "Doctor"');
          }
          dialog.setMessage('Stored: it applies from now on, and without power.');
          dialog.choose([], 'Close');
        }),
      true,
    ),
  ]);
}
