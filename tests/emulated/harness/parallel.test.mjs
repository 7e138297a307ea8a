/** Board pico_parallel: fifteen lines bit by bit, driven by hand through SIO; wired-AND, faults, times. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { parseFaults } from '../../../host_tools/simulation/emulator/faults.mjs';
import { findBoard } from '../../../host_tools/simulation/emulator/board/boards.mjs';
import { VcdDump } from '../../../host_tools/simulation/emulator/vcd.mjs';
import { ChipBench } from './chip_bench.mjs';

const SCL = 1 << 15;
const ALL = SCL - 1;
const [GPIO_IN, OUT_SET, OE] = [0xd0000004, 0xd0000014, 0xd0000020];

/** A controller made by hand, with the times of fast mode and `slack_ns` on each. */
class Controller extends ChipBench {
  constructor({ slack_ns = 500, rise_ns, onLevels } = {}) {
    super();
    this.slack_ns = slack_ns;
    this.transfers = [];
    this.faulty = new Map();
    this.board = new (findBoard('pico_parallel'))({
      scope: this.time.scope(),
      report: this.report,
      seed: 5,
      rise_ns,
      onLevels,
      stimulus: () => ({ pressure_Pa: 101325, temperature_degC: 25 }),
      faults: () => ({ sensor: (i) => this.faulty.get(i) ?? {} }),
      onTransfer: (t) => this.transfers.push(t),
    });
    this.board.attachChip(this.chip);
    this.pinFunction([...Array(16).keys()], 5);
    this.low = 0;
    this.wait_ns(5000);
  }

  wait_ns(ns) {
    this.runTo(this.time.nanos + ns);
  }

  drive(low, ns) {
    this.low = low;
    this.write(OE, low);
    this.wait_ns(ns + this.slack_ns);
  }

  get levels() {
    return this.read(GPIO_IN) & 0xffff;
  }

  start() {
    if (this.low & SCL) {
      this.drive(SCL, 700);
      this.drive(0, 700);
    }
    this.drive(ALL, 600);
    this.drive(SCL | ALL, 700);
  }

  stop(lines = ALL) {
    this.drive(SCL | lines, 700);
    this.drive(lines, 700);
    this.drive(0, 1400);
  }

  /** Sends `low` (SDA lines pulled) as one bit, returns the levels of the SDA lines while SCL is high. */
  bit(low) {
    this.drive(SCL | low, 900);
    this.drive(low, 700);
    const seen = this.levels & ALL;
    this.drive(SCL | low, 350);
    return seen;
  }

  /** Returns the bitmap of those that acknowledge. */
  byte(value) {
    for (let i = 7; i >= 0; i--) this.bit((value >> i) & 1 ? 0 : ALL);
    return ~this.bit(0) & ALL;
  }

  /** Bytes of each sensor. */
  receive(last) {
    const bytes = new Array(15).fill(0);
    for (let i = 0; i < 8; i++) {
      const seen = this.bit(0);
      bytes.forEach((b, k) => (bytes[k] = (b << 1) | ((seen >> k) & 1)));
    }
    this.bit(last ? 0 : ALL);
    return bytes;
  }

  command(value) {
    this.start();
    const acknowledged = this.byte(0xec) & this.byte(value);
    this.stop();
    return acknowledged;
  }

  /** addressed: called before the answer. */
  read16(command, addressed = () => {}) {
    this.start();
    let acknowledged = this.byte(0xec) & this.byte(command);
    this.start();
    acknowledged &= this.byte(0xed);
    addressed();
    const [high, low] = [this.receive(false), this.receive(true)];
    this.stop();
    return { acknowledged, words: high.map((h, k) => (h << 8) | low[k]) };
  }

  fault(type, k, active = true) {
    this.board.faultActions[type](k, active);
  }
}

/** A controller whose sensors have been reset. */
function ready(options) {
  const c = new Controller(options);
  assert.equal(c.command(0x1e), ALL);
  c.wait_ns(3e6);
  return c;
}

const proms = (c) => c.board.sensors.map((s) => s.prom[1]);

/** Every sensor answers, and nothing was warned of. */
function areWell(c) {
  assert.deepEqual(c.read16(0xa2), { acknowledged: ALL, words: proms(c) });
  assert.deepEqual(c.warnings, []);
}

test('every sensor hears the same command and answers on its own line, without a warning', () => {
  const c = ready();
  const { acknowledged, words } = c.read16(0xa2);
  assert.equal(acknowledged, ALL);
  assert.deepEqual(words, proms(c));
  assert.equal(new Set(words).size > 10, true);
  assert.deepEqual(c.warnings, []);
  assert.equal(c.transfers.length, 45);
  const of3 = c.transfers.filter((t) => t.muxes === 'SDA3').map((t) => [t.address, t.read, t.bytes, t.acknowledged]);
  assert.deepEqual(of3, [
    [0x76, false, [0x1e], true],
    [0x76, false, [0xa2], true],
    [0x76, true, [words[3] >> 8, words[3] & 255], true],
  ]);
  assert.deepEqual(c.board.statistics, { transactions: 45, nacks: 0 });
});

test('an address that is not theirs is acknowledged by none', () => {
  const c = ready();
  c.start();
  assert.equal(c.byte(0x70 << 1), 0);
  c.stop();
  assert.equal(c.board.statistics.nacks, 15);
});

test('during its reset a sensor does not answer', () => {
  const c = new Controller();
  c.command(0x1e);
  assert.equal(c.command(0xa2), 0);
});

test('a line is the AND of all who pull it, and rises late', () => {
  const c = new Controller({ rise_ns: 200 });
  const low = () => ~c.levels & 0xffff;
  c.write(OE, 0b101);
  assert.equal(low(), 0b101);
  c.board.low.sensors = 0b100;
  c.write(OE, 0);
  c.wait_ns(280);
  assert.equal(low(), 0b101, 'not before 1.42 times 200 ns');
  c.wait_ns(8);
  assert.equal(low(), 0b100);
  c.fault('line_stuck_high', 2);
  c.wait_ns(300);
  assert.equal(low(), 0);
});

test('faults of single lines cost those sensors only', () => {
  const c = ready();
  const faults = Object.entries({ line_stuck_low: 0, line_stuck_high: 5, sensor_missing: 7 });
  for (const [type, k] of faults) c.fault(type, k);
  c.faulty.set(9, { dead: true });
  const { acknowledged, words } = c.read16(0xa2);
  const expected = proms(c);
  const lost = { 0: [true, 0], 5: [false, 0xffff], 7: [false, 0xffff], 9: [false, 0xffff] };
  words.forEach((word, k) => {
    assert.equal(((acknowledged >> k) & 1) === 1, lost[k]?.[0] ?? true, `sensor ${k}`);
    assert.equal(word, lost[k]?.[1] ?? expected[k], `sensor ${k}`);
  });
  for (const [type, k] of faults) c.fault(type, k, false);
  c.faulty.clear();
  c.stop();
  c.command(0x1e);
  c.wait_ns(3e6);
  areWell(c);
});

/** The times of the controller are judged on line k again. */
function isJudged(c, k) {
  assert.deepEqual(c.warnings, []);
  assert.equal((c.command(0x1e) >> k) & 1, 1, 'it answers');
  c.slack_ns = -200;
  c.command(0x44);
  assert.match(c.warnings.join('\n'), new RegExp(`^SDA${k}: tHD_STA is 400 ns`, 'm'));
}

test('a line that is no longer tied to VDD and falls in a bit of the controller is no START of its: excused up to the next', () => {
  const c = ready();
  c.fault('line_stuck_high', 12);
  c.start();
  c.byte(0xec);
  c.drive(SCL | ALL, 900);
  c.drive(ALL, 440);
  c.fault('line_stuck_high', 12, false);
  assert.equal(c.levels & (SCL | (1 << 12)), SCL);
  c.wait_ns(260);
  c.drive(SCL | ALL, 350);
  for (let i = 0; i < 8; i++) c.bit(0);
  c.start();
  c.byte(0xed);
  c.receive(true);
  c.stop();
  isJudged(c, 12);
});

test('a line that is no longer tied to ground and rises just before a START: the controller did not see it, excused', () => {
  const c = ready();
  c.fault('line_stuck_low', 3);
  c.command(0x44);
  c.fault('line_stuck_low', 3, false);
  c.wait_ns(400);
  assert.equal(c.levels & ALL, ALL);
  c.command(0x44);
  isJudged(c, 3);
});

test('a sensor that comes back has no PROM before its reset', () => {
  const c = ready();
  c.fault('sensor_missing', 4);
  c.wait_ns(1e5);
  c.fault('sensor_missing', 4, false);
  assert.equal(c.command(0x44), ALL);
  const but4 = proms(c).map((word, k) => (k === 4 ? 0 : word));
  assert.deepEqual(c.read16(0xa2).words, but4);
  c.command(0x1e);
  c.wait_ns(3e6);
  areWell(c);
});

test('sensors that convert before their first reset are warned of', () => {
  const c = new Controller();
  assert.equal(c.command(0x44), ALL);
  assert.match(c.warnings[0], /sensor 0: conversion before the reset command/);
});

test('SCL stuck: nothing moves, and the sensors are well when it is free again', () => {
  for (const type of ['scl_stuck_low', 'scl_stuck_high']) {
    const c = ready();
    c.fault(type, null);
    c.read16(0xa2);
    c.fault(type, null, false);
    c.wait_ns(1e5);
    for (let i = 0; i < 9; i++) c.bit(0);
    c.stop();
    areWell(c);
  }
});

test('a sensor that holds SDA lets go after nine clocks', () => {
  const c = ready();
  c.fault('sda_stuck_low', 6);
  c.wait_ns(1000);
  assert.equal(~c.levels & ALL, 1 << 6);
  c.drive(SCL, 700);
  for (let i = 0; i < 7; i++) c.bit(0);
  assert.equal(~c.levels & ALL, 1 << 6, 'eight falls of SCL');
  c.bit(0);
  c.drive(SCL, 700);
  assert.equal(~c.levels & ALL, 0);
  c.stop();
  c.fault('sda_stuck_low', 6, false);
  areWell(c);
});

test('a clock too many puts one sensor a bit ahead, for this transfer only', () => {
  const c = ready();
  const { acknowledged, words } = c.read16(0xa2, () => c.fault('clock_glitch', 8));
  assert.equal(acknowledged, ALL);
  const wrong = words.flatMap((word, k) => (word === proms(c)[k] ? [] : [k]));
  assert.deepEqual(wrong, [8]);
  for (let i = 0; i < 9; i++) c.bit(0);
  c.stop();
  areWell(c);
});

test('a controller that keeps no time is told what is too short', () => {
  const c = ready({ rise_ns: 300 });
  c.slack_ns = -200;
  c.read16(0xa2);
  const about = (what) => c.warnings.some((w) => w.includes(`${what} is `));
  for (const what of ['tHIGH', 'tSU_STA', 'tHD_STA', 'tLOW', 'period']) assert.ok(about(what), `${what}: ${c.warnings.join('\n')}`);
});

test('SDA and SCL at one moment: no set-up time', () => {
  const c = ready({ rise_ns: 0 });
  c.start();
  c.drive(SCL, 900);
  c.drive(0, 700);
  c.drive(SCL, 900);
  c.drive(1, 700);
  assert.deepEqual(c.warnings, [
    'SDA0: tSU_DAT is 0 ns; fast mode allows at least 100 ns',
    'SDA0: tVD_DAT is 1300 ns; fast mode allows at most 900 ns',
  ]);
});

test('a STOP within a byte, a bit of the sensor that the controller pulls: warned of', () => {
  const c = ready();
  c.start();
  for (let i = 0; i < 3; i++) c.bit(0);
  c.stop();
  assert.match(c.warnings[0], /^SDA0: STOP in the middle of a byte/);
  const d = ready();
  d.start();
  d.byte(0xed);
  for (let i = 0; i < 8; i++) d.bit(1 << 2);
  assert.deepEqual(d.warnings, ["SDA2: the controller pulls SDA in a bit that is the sensor's"]);
});

test('fails: a line driven high', () => {
  const c = new Controller();
  c.write(OUT_SET, 2);
  assert.throws(() => c.write(OE, 2), /failure/);
  assert.match(c.warnings[0], /GPIO1 drives a bus line high/);
});

test('faults: those of lines need a board that has them', () => {
  const one = (type, extra = {}) => JSON.stringify([{ type, from_s: 1, ...extra }]);
  const parsed = (board, type, extra) => parseFaults(one(type, extra), 'f', findBoard(board)).length;
  for (const type of ['line_stuck_high', 'sensor_missing', 'clock_glitch']) {
    assert.equal(parsed('pico_parallel', type, { sensor: 14 }), 1);
    assert.throws(() => parsed('pico_mux', type, { sensor: 1 }), /needs a board with a data line for each sensor/);
  }
  assert.equal(parsed('pico_parallel', 'scl_stuck_low'), 1);
  for (const board of ['pico_parallel', 'pico_mux']) assert.equal(parsed(board, 'line_stuck_low', { sensor: 14 }), 1);
  assert.throws(() => parsed('pico_parallel', 'mux_stuck', { mux: 0 }), /needs a board with multiplexers/);
});

test('a dump holds the window asked for, the levels at its beginning, and its end', () => {
  let text = '';
  const file = { write: (bytes) => (text += bytes) };
  const probes = Object.entries({ SDA: 1, SCL: 2 });
  const dump = new VcdDump({ file, probes, comment: 'c', from_ns: 100, to_ns: 200 });
  dump.change(3, 10);
  dump.change(1, 50.2);
  dump.change(0, 120.4);
  dump.change(2, 120.6);
  dump.change(3, 120.7);
  dump.change(1, 300);
  dump.close(400);
  assert.equal(
    text,
    '$comment c $end\n$timescale 1 ns $end\n$var wire 1 ! SDA $end\n$var wire 1 " SCL $end\n$enddefinitions $end\n' +
      '#100\n$dumpvars\n1!\n0"\n$end\n#120\n0!\n#121\n1"\n1!\n#200\n',
  );
});
