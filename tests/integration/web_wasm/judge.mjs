// The page's judges on a capture of the line.
// usage: node judge.mjs judges.wasm gains CAPTURE.ftr [FORCE_N]
//        node judge.mjs judges.wasm pulls CAPTURE.ftr KNOWN_N
//        node judge.mjs judges.wasm doctor CAPTURE.ftr
// Prints JSON. Packets before an info packet are left out. used: bytes of the capture that a session took until it was done.
import fs from 'node:fs';
import { load } from '../../../host_tools/web/wasm/judges.mjs';

const [RAW, INFO, HEALTH, CONTACT] = [0x02, 0x03, 0x04, 0x01];
const [wasm, what, capture, ...more] = process.argv.slice(2);

function* frames() {
  const bytes = fs.readFileSync(capture);
  for (let begin = 0, end; (end = bytes.indexOf(0, begin)) >= 0; begin = end + 1) {
    const frame = bytes.subarray(begin, end);
    if (frame.length > 16) {
      yield { type: frame[2], frame, end: end + 1 }; // behind the code of COBS and the version, which are not 0
    }
  }
}

function gains(judges) {
  let session = null;
  let used = 0;
  const advice = [];
  for (const { type, frame, end } of frames()) {
    if (type === INFO && !session) {
      session = judges.gains(frame);
    } else if (type === RAW && session) {
      used = session.take(frame) ? end : used;
      const said = session.status().advice;
      if (advice.at(-1) !== said) {
        advice.push(said);
      }
    }
  }
  const status = session.status();
  let result = null;
  let error = null;
  try {
    result = session.result(more[0] ? Number(more[0]) : null, 1700000000);
  } catch (thrown) {
    error = thrown.message;
  }
  session.takeBack();
  const left = session.status().placements.length;
  session.free();
  return { status, advice, result, error, left, used };
}

function pulls(judges) {
  let session = null;
  let info = null;
  let used = 0;
  for (const { type, frame, end } of frames()) {
    if (type === INFO && !session) {
      info = frame;
      session = judges.pulls(frame, Number(more[0]));
    } else if (type === CONTACT && session) {
      used = session.take(frame) ? end : used;
    }
  }
  const status = session.status();
  return { status, used, result: status.state === 'good' ? session.result(info) : null };
}

function doctor(judges) {
  const examination = judges.examination({ port: 'a simulated fingertip', tool_version: [0, 1, 0] });
  let health = null;
  for (const { type, frame } of frames()) {
    if (type === INFO) {
      examination.give('info', frame);
    } else if (type === HEALTH) {
      if (!health) {
        examination.give('before', frame);
      }
      health = frame;
    } else if (type === RAW || type === CONTACT) {
      examination.give('take', frame);
    }
  }
  if (health) {
    examination.give('after', health);
  }
  const counts = { packets: 1000, dropped_packets: 0, out_of_order: 0, crc_errors: 0, format_errors: 0 };
  examination.line({ bytes: fs.statSync(capture).size, ...counts });
  return { findings: examination.findings(), seconds: examination.seconds() };
}

const judges = await load(fs.readFileSync(wasm));
try {
  console.log(JSON.stringify({ gains, pulls, doctor }[what](judges)));
} catch (error) {
  console.log(JSON.stringify({ thrown: error.message }));
}
