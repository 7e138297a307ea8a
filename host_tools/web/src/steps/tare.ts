/** Tare: measures the zero of every sensor. Refused in contact, and then explained. */
import { Flag, Result, Stored } from '../line/line_facts';
import { CommandError, type Fingertip } from '../model/fingertip';
import { PATIENCE } from '../model/patience';
import type { App } from './app';
import { Dialog, make, makeButton, wordsOf } from './dialog';

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
function tared(fingertip: Fingertip): Promise<void> {
  return new Promise((done, failed) => {
    const end = fingertip.tap((packet) => {
      if ((packet.type === 1 || packet.type === 2) && packet.flags & Flag.TARED) {
        stop();
        done();
      }
    });
    const timer = setTimeout(() => {
      stop();
      failed(new Error('no frame came back tared; see "Doctor"'));
    }, PATIENCE.tared_ms);
    const stop = (): void => {
      clearTimeout(timer);
      end();
    };
  });
}

function explain(app: App, fingertip: Fingertip): void {
  const { contact, contacts, info } = fingertip;
  const touched = contacts > 0 && contact.flags & Flag.CONTACT;
  const force = touched && contact.flags & Flag.FIT_VALID ? ` of ${contact.force_N.toFixed(2)} N` : '';
  const dialog = new Dialog('Not tared');
  dialog.content.append(
    make(
      'p',
      {},
      touched
        ? `It reports a contact${force}: it would become the zero. Let go of the pad and try again.`
        : info && info.stored & Stored.WRITING
          ? 'It writes into its flash: wait a moment and try again.'
          : 'No sensor answers: see "Doctor".',
    ),
  );
  if (touched) {
    dialog.content.append(make('p', {}, 'Where nothing touches the pad and the contact is none, tare anyway.'));
  }
  const again = (force_it: boolean): void => {
    dialog.close();
    void tare(app, fingertip, force_it);
  };
  dialog.choose([makeButton('Try again', () => again(false), true), ...(touched ? [makeButton('Tare anyway', () => again(true))] : [])]);
}
