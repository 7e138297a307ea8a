/** Flash: reboots the fingertip to the boot ROM's loader, and writes the image through the file
 * picker onto the drive that appears. */
import { CoreError, firmwareOf } from '../core';
import { LOADER_MAGIC, PacketType } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import { PATIENCE, pause } from '../model/patience';
import { chooseFile, download } from '../recording/output';
import { MAIN, element } from '../view/elements';
import type { App } from './app';
import { Dialog, field } from './dialog';

interface Image {
  name: string;
  bytes: Uint8Array<ArrayBuffer>;
  board: string;
  version: string;
  git_hash: string;
}

async function imageOf(file: File): Promise<Image> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  try {
    return { name: file.name, bytes, ...firmwareOf(file.name, bytes) };
  } catch (error) {
    throw error instanceof CoreError ? new Error(`${error.message}: choose fingertip-BOARD.uf2 of the build`) : error;
  }
}

const LOADER_BAUD = 1200;

const STEPS = [
  'Choose the image: fingertip-BOARD.uf2 of the build.',
  'Reboot to the loader: the fingertip vanishes, and a drive RPI-RP2 appears.',
  'Save the image onto the drive RPI-RP2: choose that drive in the window that opens.',
  'It starts with the new firmware by itself.',
];

export function flash(app: App, fingertip: Fingertip): void {
  const items = STEPS.map((text) => element('li', {}, text));
  const input = element('input', { type: 'file', accept: '.uf2' });
  const dialog = new Dialog(`Flash ${fingertip.name}`, element('ol', { class: 'steps' }, ...items), field('Image', input));
  let image: Image | null = null;
  const reboot = dialog.doing('Reboot to the loader', toLoader, MAIN);
  const save = dialog.doing('Save onto the drive', toDrive, MAIN);
  const show = (step: number): void => {
    items.forEach((item, i) => (i === step ? item.setAttribute('aria-current', 'step') : item.removeAttribute('aria-current')));
    dialog.choose(step === 1 ? [reboot] : step === 2 ? [save] : [], step === 3 ? 'Close' : 'Cancel');
  };
  show(0);

  input.addEventListener('change', () => void dialog.run(choose));

  async function choose(): Promise<void> {
    const file = input.files?.[0];
    if (!file) {
      return;
    }
    dialog.setMessage('');
    show(0); // an image that was chosen before is not meant any more
    const chosen = await imageOf(file);
    const board = fingertip.info?.board;
    if (board && board !== chosen.board) {
      throw new Error(`${file.name} is for board ${chosen.board}, but this fingertip is a ${board}: choose fingertip-${board}.uf2`);
    }
    image = chosen;
    dialog.setMessage(`Firmware ${image.version} ${image.git_hash}, board ${image.board}.`);
    show(1);
  }

  async function toLoader(): Promise<void> {
    const port = app.portOf(fingertip);
    if (fingertip.state === 'live' || fingertip.state === 'silent') {
      await fingertip.command({ type: PacketType.CMD_LOADER, magic: LOADER_MAGIC });
    } else if (port) {
      // What speaks another version understands this.
      await port.open({ baudRate: LOADER_BAUD }).catch(() => undefined);
      await port.close().catch(() => undefined);
    }
    dialog.setMessage('If no drive RPI-RP2 appears, hold BOOTSEL while plugging it in.');
    show(2);
  }

  async function toDrive(): Promise<void> {
    if (!image) {
      return;
    }
    const { name, bytes } = image;
    if ('showSaveFilePicker' in window) {
      const file = await chooseFile(name, `copy ${name} onto the drive by hand`);
      if (!file) {
        return;
      }
      await file.stream.write(bytes);
      // The loader restarts as soon as it has all of it, and its drive is gone before the file ends.
      await file.stream.close().catch(() => undefined);
      dialog.setMessage('Written. Waiting for it to come back …');
    } else {
      download(new Blob([bytes]), name);
      dialog.setMessage(`This browser cannot write onto drives: move ${name} from your downloads onto RPI-RP2.`);
    }
    show(3);
    await comesBack(image);
  }

  async function comesBack(wanted: Image): Promise<void> {
    const until_ms = performance.now() + PATIENCE.back_ms;
    while (performance.now() < until_ms && !dialog.is_closed) {
      await pause(200);
      const { info, state } = fingertip;
      if (state === 'live' && info) {
        const version = info.firmware_version.join('.');
        if (version !== wanted.version || info.git_hash !== wanted.git_hash) {
          throw new Error(
            `it came back with firmware ${version} ${info.git_hash}, not with ${wanted.version} ${wanted.git_hash}: ` +
              'hold BOOTSEL while plugging it in, and save the image onto the drive',
          );
        }
        dialog.setMessage(`It is back with firmware ${version} ${info.git_hash}.`);
        return;
      }
    }
    if (!dialog.is_closed) {
      throw new Error(
        'it did not come back: plug it in again; if it then is not there, hold BOOTSEL while plugging it in and ' +
          'save the image onto the drive RPI-RP2',
      );
    }
  }
}
