/** Record: asks for the kind of file, then for its place. */
import type { Fingertip } from '../model/fingertip';
import type { RecordingKind } from '../recording/recorder';
import type { App } from './app';
import { Dialog, make, makeButton } from './dialog';

const KINDS: [RecordingKind, string, string][] = [
  ['csv', 'CSV', 'for people, pandas and spreadsheets'],
  ['mcap', 'MCAP', 'ROS 2 messages, for rosbag2 and Foxglove'],
];

export function record(app: App, fingertip: Fingertip): void {
  const dialog = new Dialog(`Record ${fingertip.name}`);
  const form = make('form', {});
  const group = make('fieldset', {}, make('legend', {}, 'Kind of file'));
  for (const [kind, label, hint] of KINDS) {
    const id = `kind-${kind}`;
    group.append(
      make(
        'p',
        {},
        make('input', { type: 'radio', name: 'kind', id, value: kind, checked: kind === 'csv' }),
        ' ',
        make('label', { for: id }, label),
        ` ${hint}`,
      ),
    );
  }
  form.append(group);
  dialog.content.append(
    form,
    make(
      'p',
      {},
      'showSaveFilePicker' in window
        ? 'It is written while it is recorded.'
        : 'This browser keeps it in memory until "Stop", then downloads it.',
    ),
  );
  const start = (): Promise<void> =>
    dialog.run(async () => {
      const kind = new FormData(form).get('kind') as RecordingKind;
      if (await app.record(fingertip, kind)) {
        dialog.close();
      }
    });
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    void start();
  });
  dialog.choose([makeButton('Start recording', () => void start(), true)]);
}
