/**
 * Cuts the power of a release image all through its start and all through what it writes. After each cut it must start with all sensors, and hold
 * the old settings or the new ones; and the same ones after one more cut, when all is written. With a cut the emulated flash keeps of the bits that
 * were to change some, and some read at random from then on (flash_memory.mjs).
 *
 *   write   an update of what is kept, into a free slot
 *   erase   one that needs a sector erased first
 *   mend    a start that finds an update cut short, and writes what it decides for again
 *   start   a start that finds what it stored in order
 *   reset   a start of the chip alone: a reset, during which sensors and flash go on
 */
import { split } from './crash_bench.mjs';
import { ImageBench } from './image_bench.mjs';

export const KINDS = ['write', 'erase', 'mend', 'start', 'reset'];
const [OLD, NEW] = [512, 2048];
/** Bits of info.stored, and what each packet type is (PROTOCOL.md). */
const [SETTINGS, WRITING] = [2, 4];
const [RAW, INFO, HEALTH] = [2, 3, 4];
const ALL_SENSORS = 0x7fff;
const [OFF_NS, SETTLED_MS, START_LIMIT_MS] = [3e6, 200, 1000];
/** Before the first step of a write and behind its last; and between cuts where what was written is read back. */
const [MARGIN_NS, PAUSE_NS] = [0.3e6, 2e6];

/** What the packets of one life state last: settings, sensors, and how many frames had all of them. */
export function stateOf(bytes) {
  const state = { complete: 0 };
  for (const packet of split(bytes)) {
    const body = packet.subarray(12);
    if (packet[1] === INFO) Object.assign(state, { osr: body.readUInt16LE(80), stored: body.readUInt32LE(229) });
    if (packet[1] === HEALTH) Object.assign(state, { present: body.readUInt32LE(4 * 14), prom_bad: body.readUInt32LE(4 * 15) });
    if (packet[1] === RAW) state.complete += body.readUInt32LE(8) === ALL_SENSORS ? 1 : 0;
  }
  return state;
}

/** 'not_started', 'wrong_values', 'brought' (the new settings) or 'kept' (the old ones), by the states of two lives. */
export function verdict(now, later) {
  if ([now, later].some(({ present, prom_bad, complete }) => present !== ALL_SENSORS || prom_bad !== 0 || complete < 1))
    return 'not_started';
  if (![OLD, NEW].includes(now.osr) || later.osr !== now.osr || now.stored !== SETTINGS || (later.stored & ~WRITING) !== SETTINGS)
    return 'wrong_values';
  return now.osr === NEW ? 'brought' : 'kept';
}

/** A life of the board with this flash. */
class Life extends ImageBench {
  constructor({ images, tools, board }, kept, seed, fault) {
    super(images, tools, board, { seed, flash: kept?.bytes ?? null, faults: fault ? [fault] : [] });
    const { memory } = this.machine;
    if (kept) memory.unstable = new Map(kept.unstable);
    memory.resolvesAtPowerUp = kept?.resolvesAtPowerUp ?? false;
  }

  get memory() {
    return this.machine.memory;
  }

  keep() {
    const { bytes, unstable, resolvesAtPowerUp } = this.memory;
    return { bytes: bytes.slice(), unstable: [...unstable], resolvesAtPowerUp };
  }

  /** Whether it streams; received has what came since it was asked. */
  starts() {
    const end_ms = this.now_ms + START_LIMIT_MS;
    const within = (what) => {
      while (!what()) {
        if (this.now_ms > end_ms || !this.machine.run(this.machine.time.nanos + 1e6)) return false;
      }
      return true;
    };
    if (!within(() => this.machine.host.configured)) return false;
    this.run(5);
    this.received.length = this.bytes = 0;
    this.machine.client.write(Buffer.concat([this.encoded('stream', 'raw'), this.encoded('info')]));
    return within(() => this.bytes >= 600);
  }

  state(ms) {
    this.run(ms);
    this.machine.client.write(Buffer.concat([this.encoded('info'), this.encoded('health')]));
    this.run(15);
    return stateOf(Buffer.concat(this.received));
  }

  write(osr) {
    this.machine.client.write(Buffer.concat([this.encoded('osr', `${osr}`), this.encoded('rate', '20'), this.encoded('keep')]));
  }

  /** Stores; the times of its steps: beginnings and ends of operations. */
  store(osr) {
    const steps_ns = [];
    this.memory.onStep = () => steps_ns.push(this.machine.time.nanos);
    this.write(osr);
    this.run(SETTLED_MS);
    this.memory.onStep = () => {};
    return steps_ns;
  }
}

/** Flashes that hold the old settings: before a free slot, and before a sector that is full. */
function prepared(bench) {
  const life = new Life(bench, null, 1);
  life.starts();
  const kept = {};
  for (let n = 0; !(kept.write && kept.erase); n++) {
    if (n > 20) throw new Error('no update needs an erase');
    life.store(OLD);
    const [before, { erases }] = [life.keep(), life.memory];
    life.store(NEW);
    kept[life.memory.erases > erases ? 'erase' : 'write'] ??= before;
    if (n === 9) {
      // an odd number of records, or the erases would always come before the old ones
      life.machine.client.write(life.encoded('forget'));
      life.run(SETTLED_MS);
    }
  }
  return kept;
}

/** The flash that an update leaves whose power was cut while it was sealed, so that either may be there. */
function torn(bench, kept) {
  for (let seed = 1; seed < 60; seed++) {
    const life = new Life(bench, kept, seed);
    life.starts();
    let begun = 0;
    life.memory.onStep = (_, what) => {
      begun += what === 'begins' ? 1 : 0;
    };
    life.write(NEW);
    for (const end_ms = life.now_ms + START_LIMIT_MS; begun < 4; life.run(0.1))
      if (life.now_ms > end_ms) throw new Error('nothing is written');
    life.run(0.3);
    life.memory.cutPower();
    const next = new Life(bench, life.keep(), seed);
    next.starts();
    next.run(SETTLED_MS);
    if (next.memory.programs > 0) return life.keep(); // it has something to mend
  }
  throw new Error('no cut leaves anything to mend');
}

/** When to cut: each step while bits change and shortly before and after, each PAUSE_NS in between, where it is read back. */
function times(steps_ns, step_ns) {
  const begins_ns = steps_ns.filter((_, i) => i % 2 === 0).map((t_ns) => t_ns - MARGIN_NS);
  const found = [];
  for (let at_ns = begins_ns[0]; at_ns <= steps_ns.at(-1) + MARGIN_NS; ) {
    found.push(at_ns);
    const changes = begins_ns.some((begin_ns, i) => at_ns >= begin_ns && at_ns <= steps_ns[2 * i + 1] + MARGIN_NS);
    const next_ns = Math.min(...begins_ns.filter((begin_ns) => begin_ns > at_ns));
    at_ns += changes ? step_ns : Math.max(step_ns, Math.min(PAUSE_NS, next_ns - at_ns));
  }
  return found;
}

function cut(bench, kept, seed, at_ns, type, writes) {
  const to_ns = at_ns + OFF_NS;
  const life = new Life(bench, kept, seed, { type, from_s: at_ns / 1e9, to_s: to_ns / 1e9 });
  if (writes) {
    life.starts();
    life.write(NEW);
  }
  life.machine.run(to_ns);
  if (!life.starts()) return { outcome: 'not_started', what: 'it did not stream again' };
  const start_ms = life.now_ms - to_ns / 1e6;
  const now = life.state(SETTLED_MS);
  life.memory.cutPower();
  const next = new Life(bench, life.keep(), seed + 1);
  if (!next.starts()) return { outcome: 'not_started', what: 'it did not stream after one more cut' };
  const later = next.state(1);
  const { warnings } = life.machine.result;
  return { start_ms, outcome: warnings.length ? 'not_started' : verdict(now, later), what: `${JSON.stringify([now, later])} ${warnings}` };
}

/** bench: { images, tools, board }, as ImageBench. Of each kind: cuts, not_started, wrong_values, brought, slowest_ms (from power to streams), what. */
export function powerCuts(bench, kinds, step_us) {
  const kept = prepared(bench);
  if (kinds.includes('mend')) kept.mend = torn(bench, kept.write);
  kept.start = kept.reset = kept.write;
  const step_ns = step_us * 1000;
  const all = {};
  for (const kind of kinds) {
    const writes = kind === 'write' || kind === 'erase';
    const first = new Life(bench, kept[kind], 1);
    first.starts();
    const steps = Math.ceil((first.now_ms * 1e6 + 5e6) / step_ns);
    const at = writes ? times(first.store(NEW), step_ns) : Array.from({ length: steps }, (_, i) => (i + 1) * step_ns);
    const found = { cuts: at.length, not_started: 0, wrong_values: 0, brought: 0, kept: 0, slowest_ms: 0, what: [] };
    at.forEach((at_ns, i) => {
      const { outcome, what, start_ms = 0 } = cut(bench, kept[kind], 1 + i, at_ns, kind === 'reset' ? 'chip_reset' : 'power_cut', writes);
      found[outcome] += 1;
      found.slowest_ms = Math.max(found.slowest_ms, Math.round(start_ms));
      if (outcome === 'not_started' || outcome === 'wrong_values')
        found.what.push(`${kind} cut at ${(at_ns / 1e6).toFixed(3)} ms: ${what}`);
    });
    all[kind] = found;
  }
  return all;
}
