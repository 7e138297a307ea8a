/** The buttons of the page and of each fingertip. */
import { Capability } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import type { App } from './app';
import { calibrate } from './calibrate';
import { make, makeButton, wordsOf } from './dialog';
import { examine } from './doctor';
import { flash } from './flash';
import { record } from './record';
import { settings } from './settings';
import { tare } from './tare';

/** "Connect", "Simulate", "Replay a file"; files may also be dropped on the page. */
export function pageControls(app: App): HTMLElement {
  const input = make('input', {
    type: 'file',
    accept: '.csv,.mcap,.ftr',
    hidden: true,
    'aria-label': 'Recording to replay',
  });
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
  return make(
    'div',
    { class: 'controls', role: 'group', 'aria-label': 'Page' },
    makeButton('Connect', () => void app.connect(), true),
    makeButton('Simulate', () => app.simulate()),
    makeButton('Replay a file', () => input.click()),
    input,
  );
}

/** What can be done with one fingertip; follows its state. */
export function fingertipControls(app: App, fingertip: Fingertip): HTMLElement {
  const controls = make('div', {
    class: 'controls',
    role: 'group',
    'aria-label': `Fingertip ${fingertip.name}`,
  });
  const tare_button = makeButton('Tare', () => void tare(app, fingertip));
  const set_button = makeButton('Set', () => settings(fingertip));
  const calibrate_button = makeButton('Calibrate', () => calibrate(fingertip));
  const record_button = makeButton('Record', () => record(app, fingertip));
  const stop_button = makeButton('Stop', () => void app.stopRecording(fingertip));
  const doctor_button = makeButton('Doctor', () => examine(fingertip));
  const flash_button = makeButton('Flash', () => flash(app, fingertip));
  const pause_button = makeButton('Pause', () => {
    const replay = app.replays.get(fingertip);
    if (replay) {
      app.pauseReplay(replay, !replay.paused);
    }
  });
  const leave_button = makeButton('Disconnect', () => void app.disconnect(fingertip));

  const show = (): void => {
    const { info, state, is_replay } = fingertip;
    const live = (state === 'live' || state === 'silent') && !is_replay && info !== null;
    const recording = app.recorders.has(fingertip);
    const replay = app.replays.get(fingertip);
    controls.setAttribute('aria-label', `Fingertip ${fingertip.name}`);
    for (const button of [tare_button, set_button, calibrate_button, doctor_button]) {
      button.disabled = !live;
      button.hidden = is_replay;
    }
    calibrate_button.disabled = !live || !(info.capabilities & Capability.FIT);
    record_button.hidden = recording || is_replay;
    record_button.disabled = !live;
    stop_button.hidden = !recording;
    flash_button.hidden = is_replay || app.portOf(fingertip) === null;
    pause_button.hidden = !replay;
    pause_button.disabled = state === 'closed';
    pause_button.textContent = replay?.paused ? 'Go on' : 'Pause';
    leave_button.textContent = is_replay ? 'Close' : 'Disconnect';
  };
  controls.append(
    tare_button,
    set_button,
    calibrate_button,
    record_button,
    stop_button,
    pause_button,
    doctor_button,
    flash_button,
    leave_button,
  );
  const ends = [fingertip.listen(show), app.listen(show)];
  ends.push(
    app.bench.listen(() => {
      if (!app.bench.fingertips.includes(fingertip)) {
        ends.forEach((end) => end());
      }
    }),
  );
  show();
  return controls;
}
