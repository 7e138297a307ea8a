/** The buttons of the page and of each fingertip. */
import { Capability } from '../line/line_facts';
import { hasWebSerial } from '../line/serial_line';
import type { Fingertip } from '../model/fingertip';
import { MAIN, button, element, wordsOf } from '../view/elements';
import type { App } from './app';
import { calibrate } from './calibrate';
import { examine } from './doctor';
import { flash } from './flash';
import { record } from './record';
import { settings } from './settings';
import { tare } from './tare';

const SPEEDS = [0.25, 0.5, 1, 2, 5, 20];

/** The buttons that bring a fingertip; where the browser reaches no serial port, the simulated one comes first. */
export function begin(app: App, connect: string, simulate: string): HTMLButtonElement[] {
  const [here, there] = hasWebSerial() ? [MAIN, {}] : [{}, MAIN];
  const buttons = [button(connect, () => void app.connect(), here), button(simulate, () => app.simulate(), there)];
  return hasWebSerial() ? buttons : buttons.reverse();
}

/** "Connect", "Simulate", "Replay a file"; files may also be dropped on the page. */
export function pageControls(app: App): HTMLElement {
  const input = element('input', { type: 'file', accept: '.csv,.mcap,.ftr', hidden: true, 'aria-label': 'Recording to replay' });
  const replay = (file: File | undefined): void => {
    if (file) {
      app.replay(file).catch((error: unknown) => app.notice(wordsOf(error), 'bad'));
    }
  };
  input.addEventListener('change', () => {
    replay(input.files?.[0]);
    input.value = '';
  });
  document.addEventListener('dragover', (event) => event.preventDefault());
  document.addEventListener('drop', (event) => {
    event.preventDefault();
    replay(event.dataTransfer?.files[0]);
  });
  return element(
    'div',
    { class: 'controls', role: 'group', 'aria-label': 'Page' },
    ...begin(app, 'Connect', 'Simulate'),
    button('Replay a file', () => input.click()),
    input,
  );
}

/** What can be done with one fingertip; follows its state. */
export function fingertipControls(app: App, fingertip: Fingertip): HTMLElement {
  const tare_button = button('Tare', () => void tare(app, fingertip));
  const set_button = button('Set', () => settings(fingertip));
  const calibrate_button = button('Calibrate', () => calibrate(fingertip));
  const record_button = button('Record', () => record(app, fingertip));
  const stop_button = button('Stop', () => void app.stopRecording(fingertip));
  const doctor_button = button('Doctor', () => examine(fingertip));
  const flash_button = button('Flash', () => flash(app, fingertip));
  const pause_button = button('Pause', () => app.changeReplay(app.replays.get(fingertip), { paused: !app.replays.get(fingertip)?.paused }));
  const skip_button = button('10 s ahead', () => app.replays.get(fingertip)?.skip(10));
  const speed = element('select', { 'aria-label': 'Speed' }, ...SPEEDS.map((times) => element('option', { value: times }, `${times}×`)));
  speed.addEventListener('change', () => app.changeReplay(app.replays.get(fingertip), { speed: Number(speed.value) }));
  const leave_button = button('Disconnect', () => void app.disconnect(fingertip));

  const working = [tare_button, set_button, calibrate_button, doctor_button];
  const playing = [pause_button, speed, skip_button];
  const controls = element('div', { class: 'controls', role: 'group' }, ...working, record_button, stop_button, ...playing);
  controls.append(flash_button, leave_button);
  const show = (): void => {
    const { info, state, is_replay, found } = fingertip;
    const live = (state === 'live' || state === 'silent') && !is_replay && info !== null;
    const recording = app.recorders.has(fingertip);
    const replay = app.replays.get(fingertip);
    controls.setAttribute('aria-label', `Fingertip ${fingertip.name}`);
    for (const button of working) {
      button.disabled = !live || (found !== null && button !== doctor_button);
      button.hidden = is_replay;
    }
    calibrate_button.disabled ||= !live || !(info.capabilities & Capability.FIT);
    record_button.hidden = recording || is_replay;
    record_button.disabled = !live;
    stop_button.hidden = !recording;
    flash_button.disabled = found !== null;
    flash_button.hidden = is_replay || app.portOf(fingertip) === null;
    for (const control of playing) {
      control.hidden = !replay;
      control.disabled = state === 'closed';
    }
    speed.value = String(replay?.speed ?? 1);
    pause_button.textContent = replay?.paused ? 'Go on' : 'Pause';
    leave_button.textContent = is_replay ? 'Close' : 'Disconnect';
  };
  const end_own = fingertip.listen(show);
  const end = app.listen(() => {
    if (app.fingertips.includes(fingertip)) {
      show();
    } else {
      end_own();
      end();
    }
  });
  show();
  return controls;
}
