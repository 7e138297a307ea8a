/** Record: asks for the kind of file, then for its place. */
import type { Fingertip } from '../model/fingertip';
import type { RecordingKind } from '../recording/recorder';
import { MAIN, element } from '../view/elements';
import type { App } from './app';
import { Dialog, form } from './dialog';

const KINDS: [RecordingKind, string, string][] = [
  ['csv', 'CSV', 'for people, pandas and spreadsheets'],
  ['mcap', 'MCAP', 'ROS 2 messages, for rosbag2 and Foxglove'],
];

export function record(app: App, fingertip: Fingertip): void {
  const group = element('fieldset', {}, element('legend', {}, 'Kind of file'));
  for (const [value, label, hint] of KINDS) {
    const id = `kind-${value}`;
    const radio = element('input', { type: 'radio', name: 'kind', id, value, checked: value === 'csv' });
    group.append(element('p', {}, radio, ' ', element('label', { for: id }, label), ` ${hint}`));
  }
  const start = async (): Promise<void> => {
    if (await app.record(fingertip, new FormData(kinds).get('kind') as RecordingKind)) {
      dialog.close();
    }
  };
  const kinds = form(group);
  const where =
    'showSaveFilePicker' in window
      ? 'It is written while it is recorded.'
      : 'This browser keeps it in memory until "Stop", then downloads it.';
  const dialog = new Dialog(`Record ${fingertip.name}`, kinds, where);
  dialog.choose([dialog.doing('Start recording', start, MAIN)]);
}
