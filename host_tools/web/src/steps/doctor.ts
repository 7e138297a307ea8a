/** Doctor: the tool's own checks and sentences (host_tools/tool/doctor), over ten seconds at rest. */
import { PacketType } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import { PATIENCE } from '../model/patience';
import { loadJudges, type Finding } from '../judges/judges';
import { PAGE_VERSION } from './app';
import { Dialog, make, makeButton } from './dialog';

const SECONDS = 10;
const VERDICTS = { ok: 'fine', warn: 'look', bad: 'wrong' };

export function examine(fingertip: Fingertip): void {
  let stopped = false;
  const dialog = new Dialog(`Doctor: ${fingertip.name}`, () => (stopped = true));
  const bar = make('progress', { max: String(SECONDS), 'aria-label': 'Measuring' });
  bar.hidden = true;
  const list = make('ul', { class: 'findings' });
  dialog.content.append(
    make('p', {}, `Nothing may touch the pad for ${SECONDS} seconds. What it finds is listed with what to do.`),
    bar,
    list,
  );
  const begin = (): Promise<void> =>
    dialog.run(async () => {
      list.replaceChildren();
      bar.hidden = false;
      bar.value = 0;
      dialog.setMessage('Measuring …');
      try {
        const findings = await findingsOf(
          fingertip,
          (seconds) => (bar.value = seconds),
          () => stopped,
        );
        list.replaceChildren(...findings.map(item));
        const wrong = findings.filter((finding) => finding.verdict !== 'ok').length;
        dialog.setMessage(wrong === 0 ? 'All is well.' : `${wrong} of ${findings.length} checks found something.`);
      } finally {
        bar.hidden = true;
      }
    });
  dialog.choose([makeButton('Examine', () => void begin(), true)], 'Close');
}

function item(finding: Finding): HTMLElement {
  return make(
    'li',
    { class: finding.verdict },
    make('strong', {}, `${VERDICTS[finding.verdict]}: ${finding.check}`),
    ` ${finding.text}${finding.advice ? `; ${finding.advice}` : ''}`,
  );
}

async function findingsOf(fingertip: Fingertip, progress: (seconds: number) => void, stopped: () => boolean): Promise<Finding[]> {
  const judges = await loadJudges();
  const tool_version = PAGE_VERSION.split('.').map(Number) as [number, number, number];
  const examination = judges.examination({ port: fingertip.line.label, tool_version });
  const frames = new Map<number, Uint8Array>();
  let measuring = false;
  let last_ms = performance.now();
  const end = fingertip.tap((packet, frame) => {
    if (packet.type === PacketType.CONTACT || packet.type === PacketType.RAW) {
      last_ms = performance.now();
      if (measuring) {
        examination.take(frame());
      }
    } else {
      frames.set(packet.type, frame());
    }
  });
  const frameOf = (type: number): Uint8Array => {
    const frame = frames.get(type);
    if (!frame) {
      throw new Error('the fingertip gave no answer; unplug it and plug it in again');
    }
    return frame;
  };
  const askCrash = async (): Promise<void> => {
    if (await fingertip.askCrash()) {
      examination.crash(frameOf(PacketType.CRASH));
    }
  };
  try {
    await fingertip.askInfo();
    examination.info(frameOf(PacketType.INFO));
    await fingertip.askHealth();
    examination.before(frameOf(PacketType.HEALTH));
    await askCrash();
    const before = { ...fingertip.counts };
    measuring = true;
    while (examination.seconds() < SECONDS && performance.now() - last_ms < PATIENCE.slow_frame_ms) {
      await new Promise((done) => setTimeout(done, 100));
      if (stopped()) {
        return [];
      }
      if (fingertip.state === 'closed') {
        throw new Error(`it vanished while it was examined: ${fingertip.why}`);
      }
      progress(examination.seconds());
    }
    measuring = false;
    const { counts } = fingertip;
    examination.line({
      bytes: counts.bytes - before.bytes,
      packets: counts.packets - before.packets,
      dropped_packets: counts.dropped_packets - before.dropped_packets,
      out_of_order: counts.out_of_order - before.out_of_order,
      crc_errors: counts.crc_errors - before.crc_errors,
      format_errors: counts.format_errors - before.format_errors,
    });
    await fingertip.askHealth();
    examination.after(frameOf(PacketType.HEALTH));
    await askCrash();
    return examination.findings();
  } finally {
    end();
    examination.free();
  }
}
