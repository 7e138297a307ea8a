/** The world models on their own: sensor, multiplexer, bus, scenario, faults, host script, random numbers. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { I2cBus } from '../../../host_tools/simulation/emulator/board/i2c_bus.mjs';
import { codesFor, compensate, crc4, findSensor, makeProm, Ms5840, OSR } from '../../../host_tools/simulation/emulator/board/ms5840.mjs';
import { Tca9548a } from '../../../host_tools/simulation/emulator/board/tca9548a.mjs';
import { findBoard } from '../../../host_tools/simulation/emulator/board/boards.mjs';
import { InputError } from '../../../host_tools/simulation/emulator/errors.mjs';
import { parseFaults } from '../../../host_tools/simulation/emulator/faults.mjs';
import { parseHostScript } from '../../../host_tools/simulation/emulator/port/host_script.mjs';
import { Prng } from '../../../host_tools/simulation/emulator/prng.mjs';
import { Report } from '../../../host_tools/simulation/emulator/report.mjs';
import { parseScenario } from '../../../host_tools/simulation/emulator/scenario.mjs';
import { HEADER } from './bench.mjs';

const QUIET = { normal: () => 0, range: (low, high) => (low + high) / 2, uniform: () => 0.5 };

const at = (pressure_Pa) => () => ({ pressure_Pa, temperature_degC: 25 });

function sensorBench(options = {}) {
  let now = 0;
  const report = new Report();
  const stimulus = options.stimulus ?? at(101325);
  const sensor = new Ms5840({ index: 0, prng: options.prng ?? QUIET, now_ns: () => now, report, stimulus, faults: options.faults });
  const bus = new I2cBus({ now_ns: () => now, rise_ns: 0, report });
  bus.targets = [sensor];
  const write = (address, ...bytes) => {
    bus.start();
    const acks = [address << 1, ...bytes].map((b) => bus.writeByte(b));
    bus.stop();
    return acks.every(Boolean);
  };
  const read = (address, count) => {
    bus.start();
    if (!bus.writeByte((address << 1) | 1)) return null;
    const bytes = Array.from({ length: count }, (_, i) => bus.readByte(i < count - 1));
    bus.stop();
    return bytes;
  };
  const adc = () => {
    write(0x76, 0x00);
    const [a, b, c] = read(0x76, 3);
    return (a << 16) | (b << 8) | c;
  };
  const wait = (ms) => (now += ms * 1e6);
  const command = (byte, ms) => (write(0x76, byte), wait(ms));
  return { sensor, bus, report, write, read, adc, wait, command, now: () => now };
}

test('compensation matches the worked example of the MS5837-02BA datasheet, page 7', () => {
  const words = [0, 46372, 43981, 29059, 27842, 31553, 28165];
  const { pressure_Pa, temperature_cdegC } = compensate(words, 6465444, 8077636);
  assert.equal(Math.floor(temperature_cdegC), 2000);
  assert.equal(Math.floor(pressure_Pa), 110002);
});

test('the MS5837-30BA: compensation matches the worked example of its datasheet, page 7, and codes invert it in all branches', () => {
  const kind = findSensor('ms5837_30ba');
  const words = [0, 34982, 36352, 20328, 22354, 26646, 26146];
  const { pressure_Pa, temperature_cdegC } = compensate(words, 4958179, 6815414, kind);
  assert.equal(Math.floor(temperature_cdegC), 1981);
  assert.equal(Math.floor(pressure_Pa / 10), 39998);
  for (const degC of [-35, -15.01, -14.99, 5, 19.99, 20.01, 60]) {
    for (const Pa of [0, 1e5, 3e6]) {
      const { d1, d2 } = codesFor(words, Pa, degC, kind);
      const back = compensate(words, d1, d2, kind);
      assert.ok(Math.abs(back.pressure_Pa - Pa) < 1e-3 && Math.abs(back.temperature_cdegC - 100 * degC) < 1e-3, `${Pa} Pa, ${degC} degC`);
    }
  }
  assert.throws(() => findSensor('bmp280'), /unknown sensor "bmp280"; known: ms5840, ms5837_30ba/);
});

test('compensation matches a public reading of a real MS5840', () => {
  const words = [26785, 41335, 41466, 26840, 27317, 31225, 28780];
  const { pressure_Pa, temperature_cdegC } = compensate(words, 6735203, 8073757);
  assert.ok(Math.abs(pressure_Pa - 100241) < 2, `${pressure_Pa}`);
  assert.ok(Math.abs(temperature_cdegC - 2275) < 1, `${temperature_cdegC}`);
});

test('codes invert the compensation in all three temperature branches', () => {
  const words = makeProm(new Prng(7));
  for (const temperature of [-5, 5, 9, 15, 19.9, 20.5, 35]) {
    for (const pressure of [40000, 101325, 200000]) {
      const { d1, d2 } = codesFor(words, pressure, temperature);
      const back = compensate(words, d1, d2);
      assert.ok(Math.abs(back.pressure_Pa - pressure) < 1e-3, `${pressure} at ${temperature}: ${back.pressure_Pa}`);
      assert.ok(Math.abs(back.temperature_cdegC / 100 - temperature) < 1e-5);
    }
  }
});

test('CRC-4: that of a real part, and a generated PROM carries its own', () => {
  assert.equal(crc4([26785, 41335, 41466, 26840, 27317, 31225, 28780]), 5);
  const prom = makeProm(new Prng(3));
  assert.equal(prom[0] >> 12, crc4(prom));
  assert.notEqual(crc4([...prom.slice(0, 6), prom[6] ^ 1]), prom[0] >> 12);
});

test('sensor: silent for 2.8 ms after reset, PROM in order, eighth word refused', () => {
  const b = sensorBench();
  assert.ok(b.write(0x76, 0x1e));
  b.wait(2.79);
  assert.ok(!b.write(0x76, 0xa2));
  b.wait(0.02);
  for (let i = 0; i < 7; i++) {
    assert.ok(b.write(0x76, 0xa0 + 2 * i));
    const [high, low] = b.read(0x76, 2);
    assert.equal((high << 8) | low, b.sensor.prom[i]);
  }
  assert.ok(!b.write(0x76, 0xae));
});

test('sensor: a finished conversion gives its code once', () => {
  const b = sensorBench();
  b.command(0x1e, 3);
  assert.equal(b.adc(), 0, 'nothing was converted');
  b.command(0x48, 8.61);
  const code = b.adc();
  assert.equal(code, Math.round(codesFor(b.sensor.prom, 101325, 25).d1));
  assert.equal(b.adc(), 0, 'a second read');
});

test('sensor: the early-read trap returns 0 and spoils the conversion', () => {
  const b = sensorBench();
  b.sensor.prng = { normal: () => 0, range: () => 0.4 };
  b.command(0x1e, 3);
  const honest = Math.round(codesFor(b.sensor.prom, 101325, 25).d1);
  b.command(0x44, 1);
  assert.equal(b.adc(), 0);
  b.wait(2);
  const spoiled = b.adc();
  assert.ok(Math.abs(spoiled - honest) > 1000, `${spoiled}`);
  b.command(0x44, 1);
  b.command(0x44, 3);
  assert.ok(Math.abs(b.adc() - honest) > 1000, 'a convert command in between spoils too');
  b.command(0x44, 3);
  assert.equal(b.adc(), honest, 'the next one is sound');
});

test('sensor: conversion time stays below the maximum, differs between parts, samples in the middle', () => {
  const part = (index) => new Ms5840({ index, prng: new Prng(index), now_ns: () => 0, report: new Report(), stimulus: at(0) });
  const factors = Array.from({ length: 50 }, (_, index) => part(index).timeFactor);
  assert.ok(Math.max(...factors) < 1 && Math.min(...factors) > 0.92);
  assert.ok(Math.max(...factors) - Math.min(...factors) > 0.04);
  const asked = [];
  const b = sensorBench({ stimulus: (_, t) => (asked.push(t), { pressure_Pa: 1e5, temperature_degC: 25 }) });
  b.command(0x1e, 3);
  const start = b.now();
  b.command(0x4a, 20);
  b.adc();
  assert.ok(Math.abs(asked[0] - (start + (OSR[5].max_ns * b.sensor.timeFactor) / 2)) < 1);
});

test('sensor: noise has the rms of its oversampling and repeats with its seed', () => {
  const sample = (seed) => {
    const b = sensorBench({ prng: new Prng(seed), stimulus: at(1e5) });
    const { prom } = b.sensor;
    b.command(0x1e, 3);
    return Array.from({ length: 2000 }, () => {
      b.command(0x44, 3);
      return compensate(prom, b.adc(), codesFor(prom, 1e5, 25).d2).pressure_Pa;
    });
  };
  const values = sample(5);
  const mean = values.reduce((a, v) => a + v, 0) / values.length;
  const rms = Math.sqrt(values.reduce((a, v) => a + (v - mean) ** 2, 0) / values.length);
  assert.ok(Math.abs(mean - 1e5) < 0.4, `${mean}`);
  assert.ok(Math.abs(rms / 3.9 - 1) < 0.06, `${rms}`);
  assert.deepEqual(sample(5).slice(0, 20), values.slice(0, 20));
  assert.notDeepEqual(sample(6).slice(0, 20), values.slice(0, 20));
});

function muxBench() {
  const b = sensorBench();
  const mux = new Tca9548a(0x70, 0);
  const other = new Ms5840({ index: 1, prng: QUIET, now_ns: b.now, report: b.report, stimulus: at(101325) });
  mux.connect(0, b.sensor);
  mux.connect(1, other);
  b.bus.targets = [mux];
  return { ...b, mux, other };
}

test('multiplexer: a channel is reachable only after the STOP of its selection', () => {
  const b = muxBench();
  assert.ok(!b.write(0x76, 0x1e), 'nothing is connected at power-on');
  b.bus.start();
  assert.ok(b.bus.writeByte(0x70 << 1));
  assert.ok(b.bus.writeByte(1));
  b.bus.start();
  assert.ok(!b.bus.writeByte(0x76 << 1), 'a repeated start reaches nothing yet');
  b.bus.stop();
  assert.ok(b.write(0x76, 0x1e));
  assert.deepEqual(b.read(0x70, 1), [1]);
});

test('multiplexer: broadcast acknowledges if any sensor does; RESET disconnects', () => {
  const b = muxBench();
  b.write(0x70, 3);
  assert.ok(b.write(0x76, 0x1e));
  assert.ok(b.sensor.wasReset && b.other.wasReset);
  b.wait(3);
  b.other.faults = () => ({ dead: true });
  assert.ok(b.write(0x76, 0x48), 'the living one acknowledges');
  b.mux.setReset(true);
  b.mux.setReset(false);
  assert.ok(!b.write(0x76, 0x48));
  b.mux.setReset(true);
  assert.ok(!b.write(0x70, 1), 'held in reset');
});

test('bus: two sensors answering one read are ANDed and reported', () => {
  const b = muxBench();
  b.other.prom = [...b.sensor.prom];
  b.sensor.prom[1] = 0xff0f;
  b.other.prom[1] = 0x0ff0;
  b.write(0x70, 3);
  b.write(0x76, 0xa2);
  assert.deepEqual(b.read(0x76, 2), [0x0f, 0x00]);
  assert.match(b.report.list[0].message, /2 sensors answered/);
});

const row = (t, p = 0) => `${t},0,0,0,0,0,0,0,${new Array(15).fill(p).join(',')}`;
const scenario = (...lines) => parseScenario(`${lines.join('\n')}\n`, 's.csv');

test('scenario: interpolates, holds, adds ambient pressure', () => {
  const s = scenario('# fingertip-scenario 1', '# ambient_Pa: 90000', HEADER, row(1, 0), row(2, 1000), row(4, 0));
  const at = (t) => s.at_ns(3, t * 1e9).pressure_Pa;
  assert.deepEqual([0, 1, 1.5, 2, 3, 9, 1.25].map(at), [90000, 90000, 90500, 91000, 90500, 90000, 90250]);
  assert.equal(s.at_ns(0, 0).temperature_degC, 25);
  assert.equal(s.end_s, 4);
});

test('scenario: temperature column', () => {
  const s = scenario('# fingertip-scenario 1', `${HEADER},temperature_degC`, `${row(0)},20`, `${row(2)},30`);
  assert.equal(s.at_ns(0, 1e9).temperature_degC, 25);
});

test('scenario: the truth of a tangential force stands beside the temperature, in any order', () => {
  const rows = { 'Qx_N,Qy_N': '1,2', 'Qx_N,Qy_N,temperature_degC': '1,2,20', 'temperature_degC,Qy_N,Qx_N': '20,1,2' };
  for (const [names, cells] of Object.entries(rows)) {
    const s = scenario('# fingertip-scenario 1', `${HEADER},${names}`, `${row(0, 7)},${cells}`);
    assert.equal(s.at_ns(14, 0).temperature_degC, names.includes('temperature') ? 20 : 25);
    assert.equal(s.at_ns(14, 0).pressure_Pa, 101332);
  }
});

for (const [name, lines, expected] of [
  ['no version', ['t_s'], /^s\.csv:1: not a scenario/],
  ['unknown version', ['# fingertip-scenario 2', HEADER, row(0)], /^s\.csv:1: scenario version 2/],
  ['negative time', ['# fingertip-scenario 1', HEADER, row(-1)], /^s\.csv:3: t_s is -1/],
  ['NaN', ['# fingertip-scenario 1', HEADER, row(0, 'NaN')], /^s\.csv:3: column "s0_Pa" is "NaN"/],
  ['empty cell', ['# fingertip-scenario 1', HEADER, row(0, '')], /^s\.csv:3: column "s0_Pa" is ""/],
  ['equal times', ['# fingertip-scenario 1', HEADER, row(1), row(1)], /^s\.csv:4: t_s 1 does not increase/],
  ['missing column', ['# fingertip-scenario 1', HEADER, row(0).slice(0, -2)], /^s\.csv:3: 22 columns; the header has 23/],
  ['wrong header', ['# fingertip-scenario 1', HEADER.replace('sigma_mm', 'sigma'), row(0)], /^s\.csv:2: column 7 is "sigma"/],
  [
    'unknown column',
    ['# fingertip-scenario 1', `${HEADER},Qz_N`, `${row(0)},1`],
    /^s\.csv:2: column 24 is "Qz_N"; after the sensors there may be, once each: Qx_N, Qy_N, temperature_degC/,
  ],
  ['column given twice', ['# fingertip-scenario 1', `${HEADER},Qx_N,Qx_N`, `${row(0)},1,1`], /^s\.csv:2: column 25 is "Qx_N"/],
  ['no rows', ['# fingertip-scenario 1', HEADER], /no rows/],
  ['no header', ['# fingertip-scenario 1'], /no header/],
  [
    'pressure no sensor takes',
    ['# fingertip-scenario 1', HEADER, row(0), row(1, -1.1e7)],
    /^s\.csv:4: column "s0_Pa" is -11000000; give at most 1e7 Pa/,
  ],
  [
    'ambient pressure',
    ['# fingertip-scenario 1', '# ambient_Pa: 2e7', HEADER, row(0)],
    /^s\.csv:3: metadata "ambient_Pa" is "2e7"; give at most 1e7 Pa/,
  ],
]) {
  test(`scenario: ${name} is refused with its place`, () => {
    assert.throws(
      () => scenario(...lines),
      (e) => e instanceof InputError && expected.test(e.message) && !e.message.includes('\n'),
    );
  });
}

test('scenario: pressures up to the limit are taken, a file cut off in its last line is not', () => {
  assert.equal(scenario('# fingertip-scenario 1', '# ambient_Pa: 0', HEADER, row(0, 1e7)).at_ns(0, 0).pressure_Pa, 1e7);
  const text = `# fingertip-scenario 1\n${HEADER}\n${row(0)}\n${row(1, 1000)}`;
  assert.throws(
    () => parseScenario(text, 's.csv'),
    (e) => e instanceof InputError && /^s\.csv:4: the file ends within a line/.test(e.message),
  );
});

test('faults and host script: what is wrong is named', () => {
  const limits = { sensors: 15, muxes: 3 };
  assert.equal(parseFaults('[{"type":"sensor_dead","sensor":14,"from_s":0.5,"to_s":1}]', 'f', limits)[0].to_ns, 1e9);
  for (const [text, message] of [
    ['{', /not JSON/],
    ['{}', /must be a list/],
    ['[{"type":"x"}]', /unknown type "x"/],
    ['[{"sensor":3,"from_s":1}]', /fault 1: "type" is missing; known: sensor_dead,/],
    ['[[]]', /fault 1: must be an object/],
    ['[{"type":"constructor","from_s":1}]', /unknown type "constructor"/],
    ['[{"type":"sensor_dead","sensor":15,"from_s":0}]', /"sensor" must be 0..14/],
    ['[{"type":"mux_stuck","mux":0}]', /"from_s"/],
    ['[{"type":"host_stall","from_s":2,"to_s":1}]', /"to_s"/],
    ['[{"type":"host_stall","from_s":2,"mux":1}]', /key "mux"/],
    ['[{"type":"sram_upset","from_s":1,"address":536870912,"bytes":"f"}]', /"bytes" must be pairs of hexadecimal digits/],
    ['[{"type":"sram_upset","from_s":1,"address":268435456,"bytes":"ff"}]', /"address" must be one of SRAM/],
    ['[{"type":"sram_upset","from_s":1,"address":537141247,"bytes":"ffff"}]', /"address" must be one of SRAM/],
    ['[{"type":"sram_upset","from_s":1,"address":536870912,"bytes":"ff","to_s":2}]', /key "to_s"/],
  ])
    assert.throws(() => parseFaults(text, 'f', limits), message);
  assert.deepEqual(
    parseHostScript('# a\n1 dtr 1\n\n2 0aff # b\n3 baud 1200', 'h').map((s) => s.t_s),
    [1, 2, 3],
  );
  for (const bad of ['x dtr 1', '1 dtr 2', '1 0a f', '1 baud 0', '1']) assert.throws(() => parseHostScript(bad, 'h'), /^Error: h:1:|h:1:/);
  assert.throws(() => findBoard('pico'), /unknown board "pico"; known: pico_mux/);
});
