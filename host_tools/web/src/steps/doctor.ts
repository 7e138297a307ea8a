/** Doctor: the tool's own checks and sentences (host_tools/tool/doctor), over ten seconds at rest. */
import { load as loadJudges } from '../../wasm/judges.mjs';
import { fetched } from '../../wasm/module.mjs';
import { countsSince, frameOf } from '../core';
import { PacketType } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import { PATIENCE, pause } from '../model/patience';
import { MAIN, element } from '../view/elements';
import { PAGE_VERSION } from './app';
import { Dialog } from './dialog';

const SECONDS = 10;
const VERDICTS = { ok: 'fine', warn: 'look', bad: 'wrong' };
const BUTTONS: Record<string, string> = { flash: 'Flash', set: 'Settings', tare: 'Tare' }; // of the tool's commands

export function examine(fingertip: Fingertip): void {
  const bar = element('progress', { max: SECONDS, 'aria-label': 'Measuring', hidden: true });
  const list = element('ul', { class: 'findings' });
  const advice = `Nothing may touch the pad for ${SECONDS} seconds. What it finds is listed with what to do.`;
  const dialog = new Dialog(`Doctor: ${fingertip.name}`, advice, bar, list);
  const begin = async (): Promise<void> => {
    list.replaceChildren();
    bar.hidden = false;
    bar.value = 0;
    dialog.setMessage('Measuring …');
    try {
      const findings = await findingsOf(fingertip, dialog, bar);
      for (const { verdict, check, text, advice } of findings) {
        const title = element('strong', {}, `${VERDICTS[verdict]}: ${check}`);
        const here = advice.replace(/`fingertip (\w+)[^`]*`/g, (_, command: string) => `"${BUTTONS[command] ?? command}"`);
        list.append(element('li', { class: verdict }, title, ` ${text}${here ? `; ${here}` : ''}`));
      }
      const wrong = findings.filter((finding) => finding.verdict !== 'ok').length;
      dialog.setMessage(wrong === 0 ? 'All is well.' : `${wrong} of ${findings.length} checks found something.`);
    } finally {
      bar.hidden = true;
    }
  };
  dialog.choose([dialog.doing('Examine', begin, MAIN)], 'Close');
}

async function findingsOf(fingertip: Fingertip, dialog: Dialog, bar: HTMLProgressElement) {
  const judges = await loadJudges(fetched('wasm/judges.wasm'));
  const tool_version = PAGE_VERSION.split('.').map(Number);
  const examination = judges.examination({ port: fingertip.line.label, tool_version });
  let measuring = false;
  let last_ms = performance.now();
  const end = fingertip.tap((packet) => {
    if (packet.type === PacketType.CONTACT || packet.type === PacketType.RAW) {
      last_ms = performance.now();
      if (measuring) {
        examination.give('take', frameOf(packet));
      }
    }
  });
  const askCrash = async (): Promise<void> => {
    const crash = await fingertip.askCrash();
    if (crash) {
      examination.give('crash', frameOf(crash));
    }
  };
  try {
    examination.give('info', frameOf(await fingertip.askInfo()));
    examination.give('before', frameOf(await fingertip.askHealth()));
    await askCrash();
    const before = fingertip.counts;
    measuring = true;
    while (examination.seconds() < SECONDS && performance.now() - last_ms < PATIENCE.frame_ms) {
      await pause(100);
      if (dialog.is_closed) {
        return [];
      }
      if (fingertip.state === 'closed') {
        throw new Error(`it vanished while it was examined: ${fingertip.why}`);
      }
      bar.value = examination.seconds();
    }
    measuring = false;
    examination.line(countsSince(before, fingertip.counts));
    examination.give('after', frameOf(await fingertip.askHealth()));
    await askCrash();
    return examination.findings();
  } finally {
    end();
    examination.free();
  }
}
