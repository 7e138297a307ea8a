#!/usr/bin/env node
/**
 * The fit's run time on the chip: usage test_fit_cycles.mjs fit_cycles.bin
 *
 * The grid kernels have a fixed number of iterations and no early exit, so their cycles depend on the readings only through
 * short branches: normalising shifts, limits, signs. The limits below are what the firmware counts on.
 */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { Prng } from '../../host_tools/simulation/emulator/prng.mjs';
import { Bench } from '../../host_tools/report/fit/on_chip/fit_on_chip.mjs';

/** The build's iterations from cold, with everything: readings, guess, amplitude, force, errors, what rubber keeps, shape, flags. */
const COLD_CYCLES_MAX = 31300;
/** The same without some of the sensors. */
const MASKED_CYCLES_MAX = 49300;
/** A fit with every sensor that looks for an outlier and finds none. */
const SEARCH_CYCLES_MAX = 46500;
/** A fit that finds an outlier: the fit, the search, and the fit without it. */
const OUTLIER_CYCLES_MAX = 96400;
/** A frame's tangential estimate, which follows the fit, with the image's pad. */
const TANGENTIAL_CYCLES_MAX = 43000;
/** A part of the look for a load that is not estimated, which follows the frame's packet (fit_bias.h), and all of them. */
const LOAD_PART_CYCLES_MAX = 6700;
const LOAD_CYCLES_MAX = 25000;
const LOAD_PARTS = 6;
/** What a touch tells of the gains, in the time of such a part (fit_gains.h). */
const GAINS_CYCLES_MAX = 7000;
/** A part of a frame of what presses, or the first frame of a contact (fit_shapes.h). */
const SHAPES_PART_CYCLES_MAX = 45000;
const SHAPES_PARTS = 3;
/** Between the cheapest and the dearest press, share of the dearest: a contact at a bound has no widths to tell. */
const SPREAD_MAX = 0.1;
/** FINGERTIP_FIT_ITERATIONS. */
const ITERATIONS = 4;

const PITCH_mm = 9;
const SENSORS = 15;
const bench = new Bench(readFileSync(process.argv[2]));
const random = new Prng(20221015);
const between = (low, high) => random.range(low, high);
const anyInt32 = () => random.uint32() | 0;

/** Sensor k sits in column k / 5 and row k % 5. */
function press(x_mm, y_mm, p0_Pa, sigma_mm, noise_Pa) {
  return Array.from({ length: SENSORS }, (_, k) => {
    const dx = PITCH_mm * (Math.floor(k / 5) - 1) - x_mm;
    const dy = PITCH_mm * ((k % 5) - 2) - y_mm;
    const p_Pa = p0_Pa * Math.exp(-(dx * dx + dy * dy) / (2 * sigma_mm * sigma_mm)) + noise_Pa * between(-1, 1);
    return Math.round(1024 * p_Pa);
  });
}

const presses = Array.from({ length: 200 }, () =>
  press(between(-15, 15), between(-24, 24), 10 ** between(2, 6), 10 ** between(0.2, 1.4), 10 ** between(-1, 2)),
);
const garbage = [
  ...Array.from({ length: 60 }, () => Array.from({ length: SENSORS }, anyInt32)),
  ...Array.from({ length: 40 }, () => Array.from({ length: SENSORS }, () => anyInt32() >> Math.floor(between(0, 31)))),
  ...Array.from({ length: SENSORS }, (_, k) => Array.from({ length: SENSORS }, (_, j) => (j === k ? 2 ** 31 - 1 : 0))),
  ...Array.from({ length: SENSORS }, (_, k) => Array.from({ length: SENSORS }, (_, j) => (j === k ? 1 : -(2 ** 31)))),
  ...[1, 1000, 2 ** 31 - 1].map((value) => new Array(SENSORS).fill(value)),
];

/** The least, the middle and the largest, which are printed. */
function spread(t, name, values) {
  const sorted = [...values].sort((a, b) => a - b);
  const [min, median, max] = [sorted[0], sorted[sorted.length >> 1], sorted.at(-1)];
  t.diagnostic(`${name}: ${min} ${median} ${max} cycles (min, median, max)`);
  return { min, median, max };
}

const ALL = 2 ** SENSORS - 1;
const cyclesOf = (readings, iterations = ITERATIONS, usable = ALL, kernel = 'grid') =>
  bench.run({ kernel, iterations, noise_Pa_q10: 4096, usable, readings }).cycles;
const callsOf = (readings, usable, kernel) =>
  bench.run({ kernel, iterations: ITERATIONS, noise_Pa_q10: 4096, usable, own: true, readings }).calls;
/** One to three sensors missing, the one with the largest reading among them every other time. */
function maskFor(readings, i) {
  let usable = ALL;
  if (i % 2) usable &= ~(1 << readings.indexOf(Math.max(...readings)));
  for (let k = i % 2; k <= i % 3; k++) usable &= ~(1 << (random.uint32() % SENSORS));
  return usable;
}
/** Without a positive reading there is nothing to fit. */
const anyPositive = (readings, usable) => readings.some((value, k) => value > 0 && (usable >> k) & 1);

for (const [what, kernel, limit, usable] of [
  ['every sensor', 'grid', COLD_CYCLES_MAX, () => ALL],
  ['sensors missing', 'masked', MASKED_CYCLES_MAX, maskFor],
]) {
  test(`${what}: no press and no garbage takes more than ${limit} cycles, nor much less`, (t) => {
    for (const [name, list] of Object.entries({ presses, garbage })) {
      const inputs = list.map((readings, i) => [readings, usable(readings, i)]).filter((input) => anyPositive(...input));
      const { min, max } = spread(
        t,
        name,
        inputs.map(([readings, mask]) => cyclesOf(readings, ITERATIONS, mask, kernel)),
      );
      assert.ok(max <= limit, `${name}: ${max}`);
      assert.ok(max - min <= SPREAD_MAX * max, `${name}: ${min} to ${max}`);
    }
  });
}

/** A press of more than 10 ** `least` Pa inside the array, and one whose readings rise along a tangential force. */
const inside = (least = 3) => press(between(-8, 8), between(-17, 17), 10 ** between(least, 5), between(5.5, 6.5), 2);
function pulledInside() {
  const readings = inside();
  const [qx, qy] = [between(-0.1, 0.1), between(-0.1, 0.1)];
  return readings.map((value, k) => Math.round(value * (1 + qx * (Math.floor(k / 5) - 1) + qy * ((k % 5) - 2))));
}

test(`the tangential estimate takes at most ${TANGENTIAL_CYCLES_MAX} cycles, nor much less where it ends with a result`, (t) => {
  const run = (readings, usable) =>
    bench.run({ kernel: 'tangential', iterations: ITERATIONS, noise_Pa_q10: 4096, usable, own: true, readings });
  const answers = Array.from({ length: 100 }, pulledInside)
    .map((readings, i) => run(readings, i % 4 ? ALL : maskFor(readings, i)))
    .filter((answer) => answer.x_mm !== 0 || answer.y_mm !== 0);
  assert.ok(answers.length > 60, `${answers.length} results`);
  const { min, max } = spread(
    t,
    `${answers.length} results`,
    answers.map((answer) => answer.cycles),
  );
  assert.ok(max <= TANGENTIAL_CYCLES_MAX, `${max}`);
  assert.ok(max - min <= SPREAD_MAX * max, `${min} to ${max}`);
  const others = [...presses, ...garbage].map((readings, i) => run(readings, i % 2 ? ALL : maskFor(readings, i)).cycles);
  assert.ok(spread(t, 'presses and garbage', others).max <= TANGENTIAL_CYCLES_MAX);
});

test(`no part of the look for a load takes more than ${LOAD_PART_CYCLES_MAX} cycles, nor all more than ${LOAD_CYCLES_MAX}`, (t) => {
  const pulled = Array.from({ length: 60 }, pulledInside);
  const inputs = [...pulled, ...presses, ...garbage];
  const calls = inputs.map((readings, i) => callsOf(readings, i % 2 ? ALL : maskFor(readings, i), 'step_bias'));
  const dearest = Array.from({ length: LOAD_PARTS }, (_, part) => Math.max(...calls.map((each) => each[part])));
  t.diagnostic(`parts: ${dearest}`);
  assert.ok(Math.max(...dearest) <= LOAD_PART_CYCLES_MAX, `parts: ${dearest}`);
  assert.ok(dearest.reduce((a, b) => a + b) <= LOAD_CYCLES_MAX, `all of ${dearest}`);
});

test(`what a touch tells of the gains takes at most ${GAINS_CYCLES_MAX} cycles`, (t) => {
  const firm = Array.from({ length: 60 }, () => inside(4));
  for (const [name, list] of Object.entries({ firm, presses, garbage })) {
    const { min, max } = spread(
      t,
      name,
      list.map((readings) => cyclesOf(readings, ITERATIONS, ALL, 'gains_of_touch')),
    );
    assert.ok(max <= GAINS_CYCLES_MAX, `${name}: ${max}`);
    assert.ok(name !== 'firm' || min > 0.5 * GAINS_CYCLES_MAX, 'these count');
  }
});

test(`no part of what presses takes more than ${SHAPES_PART_CYCLES_MAX} cycles`, (t) => {
  const pairs = Array.from({ length: 30 }, () => {
    const other = inside();
    return inside().map((value, k) => value + other[k]);
  });
  const ones = Array.from({ length: 20 }, () => inside());
  for (const [name, list] of Object.entries({ ones, pairs, presses: presses.slice(0, 60), garbage: garbage.slice(0, 100) })) {
    const inputs = list.map((readings, i) => [readings, i % 4 ? ALL : maskFor(readings, i)]).filter((input) => anyPositive(...input));
    const calls = inputs.map(([readings, usable]) => callsOf(readings, usable, 'shapes'));
    const { max } = spread(t, name, calls.flat());
    assert.ok(max <= SHAPES_PART_CYCLES_MAX, `${name}: ${max}`);
    for (let part = -SHAPES_PARTS; name === 'pairs' && part < 0; part++) {
      const cycles = calls.map((each) => each.at(part));
      const { median } = spread(t, `an answer's part ${part}, pairs`, cycles);
      assert.ok(median > 20000, `part ${part} estimates nothing`);
    }
  }
});

test(`looking for an outlier: at most ${SEARCH_CYCLES_MAX} cycles in vain, ${OUTLIER_CYCLES_MAX} with the fit without it`, (t) => {
  const wrong = presses.map((readings, i) => readings.map((value, k) => value + (k === i % SENSORS ? 10000 * 1024 : 0)));
  const cycles = wrong.map((readings) => cyclesOf(readings, ITERATIONS, ALL, 'fit'));
  for (const [what, least, most] of [
    ['in vain', COLD_CYCLES_MAX, MASKED_CYCLES_MAX],
    ['found', MASKED_CYCLES_MAX, Infinity],
  ]) {
    const group = cycles.filter((value) => value > least && value <= most);
    assert.ok(group.length > 10, `${what}: ${group.length}`);
    const { max } = spread(t, `${what}, ${group.length} of ${cycles.length}`, group);
    assert.ok(max <= (what === 'found' ? OUTLIER_CYCLES_MAX : SEARCH_CYCLES_MAX), `${what}: ${max}`);
  }
});

test('the same press takes the same cycles, whatever came before', () => {
  const before = cyclesOf(presses[0]);
  for (const readings of garbage.slice(0, 5)) cyclesOf(readings);
  assert.equal(cyclesOf(presses[0]), before);
});

test('each further iteration costs the same', () => {
  const cycles = [7, 8, 9, 10].map((iterations) => cyclesOf(presses[1], iterations));
  const steps = cycles.slice(1).map((value, i) => value - cycles[i]);
  assert.ok(Math.max(...steps) - Math.min(...steps) <= SPREAD_MAX * Math.max(...steps), steps.join(' '));
  assert.ok(Math.min(...steps) > 1000, steps.join(' '));
});

test('the cycles are spent on fits', () => {
  for (let i = 0; i < 20; i++) {
    const [x_mm, y_mm] = [between(-8, 8), between(-17, 17)];
    const answer = bench.run({
      kernel: 'fit',
      iterations: ITERATIONS,
      noise_Pa_q10: 1024,
      usable: i % 2 ? ALL : ALL & ~(1 << (i % SENSORS)),
      readings: press(x_mm, y_mm, 5e4, 6, 1),
    });
    assert.ok(Math.hypot(answer.x_mm - x_mm, answer.y_mm - y_mm) < 0.01, `${x_mm} ${y_mm}: ${answer.x_mm} ${answer.y_mm}`);
  }
});
