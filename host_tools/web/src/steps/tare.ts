/** Tare: measures the zero of every sensor. Refused in contact, and then explained. */
import { Flag, PacketType, Result, Stored } from '../line/line_facts';
import { CommandError, type Fingertip } from '../model/fingertip';
import { PATIENCE, pause } from '../model/patience';
import type { App } from './app';
import { MAIN, button, wordsOf } from '../view/elements';
import { Dialog } from './dialog';

export async function tare(app: App, fingertip: Fingertip, force = false): Promise<void> {
  try {
    await fingertip.tare(force);
    await tared(fingertip);
    app.notice(`${fingertip.name}: tared`, 'plain');
  } catch (error) {
    if (error instanceof CommandError && error.result === Result.NOT_NOW && !force) {
      explain(app, fingertip);
    } else {
      app.notice(`${fingertip.name}: not tared: ${wordsOf(error)}`, 'bad');
    }
  }
}

/** The frames between begin and end of a tare have no flag. */
async function tared(fingertip: Fingertip): Promise<void> {
  const { CONTACT, RAW } = PacketType;
  let is_tared = false;
  const end = fingertip.tap((packet) => {
    is_tared ||= (packet.type === CONTACT || packet.type === RAW) && (packet.flags & Flag.TARED) !== 0;
  });
  const until_ms = performance.now() + PATIENCE.tared_ms;
  while (!is_tared && fingertip.state !== 'closed' && performance.now() < until_ms) {
    await pause(20);
  }
  end();
  if (!is_tared) {
    throw new Error(fingertip.why || 'no frame came back tared; see "Doctor"');
  }
}

function explain(app: App, fingertip: Fingertip): void {
  const { contact, contacts, info } = fingertip;
  const touched = contacts > 0 && contact.flags & Flag.CONTACT;
  const force = touched && contact.flags & Flag.FIT_VALID ? ` of ${contact.force_N.toFixed(2)} N` : '';
  const dialog = new Dialog(
    'Not tared',
    touched
      ? `It reports a contact${force}: it would become the zero. Let go of the pad and try again.`
      : info && info.stored & Stored.WRITING
        ? 'It writes into its flash: wait a moment and try again.'
        : 'No sensor answers: see "Doctor".',
    ...(touched ? ['Where nothing touches the pad and the contact is none, tare anyway.'] : []),
  );
  const again = (force_it: boolean) => () => {
    dialog.close();
    void tare(app, fingertip, force_it);
  };
  dialog.choose([button('Try again', again(false), MAIN), ...(touched ? [button('Tare anyway', again(true))] : [])]);
}
