// The page's judges on a capture of the line.
// usage: node judge.mjs judges.wasm gains CAPTURE.ftr [FORCE_N]
//        node judge.mjs judges.wasm pulls CAPTURE.ftr KNOWN_N
// Prints JSON. Packets before an info packet are left out. used: bytes of the capture that the session took until it was done.
import fs from 'node:fs';
import { load } from '../../../host_tools/web/wasm/judges.mjs';

const [RAW, INFO, CONTACT] = [0x02, 0x03, 0x01];
const [wasm, what, capture, known] = process.argv.slice(2);
const known_N = known ? Number(known) : null;

function judged(judges) {
  const bytes = fs.readFileSync(capture);
  const advice = new Set();
  let [session, info, used] = [null, null, 0];
  for (let begin = 0, end; (end = bytes.indexOf(0, begin)) >= 0; begin = end + 1) {
    const frame = bytes.subarray(begin, end);
    const type = frame.length > 16 ? frame[2] : 0; // behind the code of COBS and the version, which are not 0
    if (type === INFO && !session) {
      info = frame;
      session = judges[what](frame, known_N);
    } else if (type === { gains: RAW, pulls: CONTACT }[what] && session) {
      used = session.take(frame) ? end + 1 : used;
      advice.add(session.status().advice);
    }
  }
  const found = { status: session.status(), used, advice: [...advice] };
  try {
    found.result = what === 'gains' ? session.result(known_N, 1700000000) : session.result(info);
  } catch (thrown) {
    found.error = thrown.message;
  }
  if (what === 'gains') {
    session.takeBack();
    found.left = session.status().placements.length;
  }
  session.free();
  return found;
}

const judges = await load(fs.readFileSync(wasm));
try {
  console.log(JSON.stringify(judged(judges)));
} catch (error) {
  console.log(JSON.stringify({ thrown: error.message }));
}
