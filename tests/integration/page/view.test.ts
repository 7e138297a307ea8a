/** What the page's pictures are made of: the traces' intervals, the eye and what the pointer picks, contrast, what readers of the
 * screen are told, doubt. */
import assert from 'node:assert/strict';
import test from 'node:test';
import { Flag, PacketType, type Contact } from '../../../host_tools/web/src/line/line_facts';
import { History } from '../../../host_tools/web/src/model/history';
import { Buckets, Trust, intervalOf, roundAbove } from '../../../host_tools/web/src/view/buckets';
import { cameraOf, picked, seen, type Point } from '../../../host_tools/web/src/view/camera';
import { chartOf, clock, spansOf, ticksOf } from '../../../host_tools/web/src/view/curves';
import { leaving } from '../../../host_tools/web/src/view/notices';
import { momentAt } from '../../../host_tools/web/src/view/recorded_contact';
import { sceneOf } from '../../../host_tools/web/src/view/pad_scene';
import { HEAT_STOPS, contrast, paletteOf, parsed } from '../../../host_tools/web/src/view/palette';
import { Speech } from '../../../host_tools/web/src/view/speech';
import { core, source } from './library';

const FITTED = Flag.CONTACT | Flag.FIT_VALID | Flag.UNCERTAINTY_VALID | Flag.TARED;

function contactOf(more: Partial<Contact>): Contact {
  return { ...(core.blank(PacketType.CONTACT) as unknown as Contact), flags: FITTED, ...more };
}

/** A frame each millisecond, from frame 0 at 0 s on. */
function historyOf(count: number, contact: (i: number) => Partial<Contact> | null, capacity = 1 << 15): History {
  const history = new History(15, capacity);
  for (let i = 0; i < count; i++) {
    const more = contact(i);
    if (more) {
      history.addContact(contactOf({ frame: i, t_us: i * 1000, ...more }));
    }
  }
  return history;
}

/** Of a history of so many frames, one each millisecond, in intervals of that width; and the numbers of its first and last interval. */
function bucketsOf(history: History, width_s: number, capacity = 500, end_s = (history.end - 1) / 1000): [Buckets, number, number] {
  const buckets = new Buckets(capacity);
  const { first, last } = buckets.read(history, width_s, 0, end_s);
  return [buckets, first, last];
}

const forceOf = (buckets: Buckets) => buckets.tracks.get('force_N')!;

test('an interval keeps the lowest and the highest value, and which came first', () => {
  const history = historyOf(1000, (i) => ({ force_N: i === 503 ? 9 : i === 507 ? -1 : 2, force_sd_N: 0.5 }));
  const [buckets, first, last] = bucketsOf(history, 0.01);
  assert.deepEqual([first, last], [0, 99]);
  const { high, low, rises, sdHigh, sdLow } = forceOf(buckets);
  const at = buckets.slot(50);
  assert.deepEqual([high[at], low[at], rises[at], sdHigh[at], sdLow[at]], [9, -1, 0, 9.5, -1.5]);
  assert.equal(high[buckets.slot(51)], 2);
});

test('read in many small steps, or back and forth, intervals are those of one reading', () => {
  const value = (i: number) => ({ force_N: Math.sin(i * 0.37) * 3, force_sd_N: 0.1, flags: i % 7 ? FITTED : FITTED | Flag.MODEL });
  const whole = new Buckets(400);
  whole.read(historyOf(3000, value), 0.02, 0, 2.999);
  const history = new History(15, 1 << 15);
  const steps = new Buckets(400);
  for (let i = 0; i < 3000; i++) {
    history.addContact(contactOf({ frame: i, t_us: i * 1000, ...value(i) }));
    if (i % 17 === 0) {
      steps.read(history, 0.02, Math.max(0, i / 1000 - 1), i / 1000);
    }
  }
  steps.read(history, 0.02, 0.3, 0.9);
  steps.read(history, 0.02, 0, 2.999);
  for (let b = 0; b < 150; b++) {
    for (const [name, track] of whole.tracks) {
      const other = steps.tracks.get(name);
      for (const part of ['trust', 'low', 'high', 'rises', 'sdLow', 'sdHigh'] as const) {
        assert.equal(other?.[part][steps.slot(b)], track[part][whole.slot(b)], `${name} ${part} of interval ${b}`);
      }
    }
  }
});

test('a ring that is full gives the newest intervals alone', () => {
  const history = historyOf(5000, (i) => ({ force_N: i }), 1000);
  const [buckets, first, last] = bucketsOf(history, 0.01, 4000);
  const there = Array.from({ length: last - first + 1 }, (_, i) => first + i).filter((b) => buckets.slot(b) >= 0);
  assert.deepEqual([there[0], there.length], [400, 100]);
  assert.equal(forceOf(buckets).low[buckets.slot(400)], 4000);
});

test('a fingertip that restarts goes on in time, and its frame numbers are no loss', () => {
  const history = historyOf(3000, () => ({ force_N: 5 }));
  const [buckets] = bucketsOf(history, 0.01);
  for (let i = 0; i < 100; i++) {
    history.addContact(contactOf({ frame: i, t_us: i * 1000, force_N: 1 }));
  }
  const { last } = buckets.read(history, 0.01, 1, history.t_s[history.slot(history.end - 1)] ?? 0);
  assert.equal(forceOf(buckets).high[buckets.slot(last)], 1);
  assert.equal(forceOf(buckets).high[buckets.slot(200)], 5);
  assert.deepEqual(spansOf(buckets, 'lost', 100, last, 0.02), []);
  const wrapped = historyOf(10, (i) => ({ frame: (0xfffffffb + i) >>> 0 }));
  assert.deepEqual([wrapped.end, Math.max(...wrapped.lost)], [10, 0]);
});

test('the intervals of another fingertip at the same time are its own', () => {
  const [five, one] = [5, 1].map((force_N) => historyOf(1000, () => ({ force_N }))) as [History, History];
  const [buckets] = bucketsOf(five, 0.01);
  buckets.read(one, 0.01, 0, 0.999);
  assert.equal(forceOf(buckets).high[buckets.slot(50)], 1);
});

test('doubtful frames count only where there is no other; a value without its flag is none', () => {
  const flagsOf = (i: number) => (i < 20 && i % 2 === 0 ? FITTED : FITTED | Flag.UNCERTAIN);
  const [buckets] = bucketsOf(
    historyOf(40, (i) => ({ force_N: i % 2 ? 50 : 2, flags: flagsOf(i) })),
    0.02,
  );
  const { trust, high } = forceOf(buckets);
  const found = [0, 1].flatMap((b) => [trust[buckets.slot(b)], high[buckets.slot(b)]]);
  assert.deepEqual(found, [Trust.good, 2, Trust.doubtful, 50]);
  const [without] = bucketsOf(
    historyOf(10, () => ({ force_N: 7, flags: Flag.TARED })),
    0.01,
  );
  assert.ok(['force_N', 'slip_mm'].every((name) => without.tracks.get(name as 'force_N')?.trust[0] === Trust.none));
});

test('a line is broken where frames were lost, and where none came, and nowhere else', () => {
  const history = historyOf(3000, (i) => (i === 1005 || (i >= 1500 && i < 2400) ? null : { force_N: 1, force_sd_N: 0.1 }));
  const [buckets, first, last] = bucketsOf(history, 0.01, 500, 2.999);
  const chart = chartOf(buckets, ['force_N'], first, last, 0.25);
  const good = chart.curves.get('force_N')?.good ?? [];
  const broken = chart.t_s.filter((_, i) => good[i] === null);
  assert.equal(chart.t_s.length, good.length);
  const lost = spansOf(buckets, 'lost', first, last, 0.02).map(({ from_s }) => from_s);
  for (const all of [broken, lost]) {
    assert.equal(all.map((t_s) => Math.round(t_s * 100)).join(), '100,240');
  }
  assert.equal(buckets.lost[buckets.slot(240)], 900);
});

test('solid where it can be trusted, dashed where not, and the two meet', () => {
  const history = historyOf(60, (i) => ({ force_N: i, flags: i >= 20 && i < 40 ? FITTED | Flag.FLAT : FITTED }));
  const [buckets, first, last] = bucketsOf(history, 0.01);
  const { good, doubtful } = chartOf(buckets, ['force_N'], first, last, 0.25).curves.get('force_N')!;
  const both = good.flatMap((value, i) => (value !== null && doubtful[i] !== null ? [i] : []));
  assert.deepEqual(both, [3, 8]);
  good.forEach((value, i) => assert.ok(value !== null || doubtful[i] !== null, `point ${i}`));
  assert.equal(good[5], null);
});

test('limits of axes, ticks and intervals are round; times go on beyond a minute', () => {
  assert.deepEqual([0.11, 1, 5.01, NaN].map(roundAbove), [0.2, 1, 10, 1]);
  assert.deepEqual([ticksOf(-24, 24, 2.3), ticksOf(0, 5, 1), ticksOf(-0.5, 0.5, 4)].map(String), ['-20,0,20', '0,2,4', '-0.5,0,0.5']);
  for (const [span_s, pixels] of [
    [20, 900],
    [180, 333],
    [5, 5000],
  ] as const) {
    const width_s = intervalOf(span_s, pixels);
    assert.ok(width_s >= span_s / pixels - 1e-12 && width_s <= Math.max(2.5 * (span_s / pixels), 0.001));
  }
  assert.deepEqual([0, 2.5, 59.9996, 60, 62.5, 615.025].map(clock), ['0 s', '2.5 s', '1:00', '1:00', '1:02.5', '10:15.025']);
});

const PART = [0.9, 0.8] as const;
const BOX = [-15, 15].flatMap((x) => [-24, 24].flatMap((y) => [-6, 16].map((z): Point => [x, y, z])));

test('from every side the whole pad is in the picture and fills it, and what is picked is what is seen there', () => {
  for (const turn_deg of [-170, -90, -32, 0, 45, 120]) {
    for (const tilt_deg of [12, 40, 75, 90]) {
      for (const aspect of [0.4, 1, 2.6]) {
        const camera = cameraOf({ turn_deg, tilt_deg }, aspect, BOX, PART);
        for (const point of BOX.map(([x, y, z]): Point => [0.9 * x, 0.7 * y, 0.5 * z])) {
          const { right, up } = seen(camera, point);
          const { x_mm, y_mm } = picked(camera, right, up, point[2])!;
          assert.ok(Math.hypot(x_mm - point[0], y_mm - point[1]) < 0.01, `${turn_deg} ${tilt_deg} ${aspect}: ${x_mm} ${y_mm}`);
        }
        const sides = (['right', 'up'] as const).flatMap((axis, i) =>
          [1, -1].map((sign) => Math.max(...BOX.map((point) => (sign * seen(camera, point)[axis]) / PART[i]))),
        );
        const full = sides.filter((side) => side > 1 - 1e-9).length;
        assert.ok(full >= 2 && Math.max(...sides) < 1 + 1e-9, `${turn_deg} ${tilt_deg} ${aspect}: ${sides}`);
      }
    }
  }
});

test('from above x is to the right and y up; the sky is no place on the pad', () => {
  const above = cameraOf({ turn_deg: 0, tilt_deg: 90 }, 1, BOX, PART);
  assert.ok(seen(above, [9, 0, 0]).right > 0.1 && Math.abs(seen(above, [9, 0, 0]).up) < 1e-5);
  assert.ok(seen(above, [0, 9, 0]).up > 0.1 && Math.abs(seen(above, [0, 9, 0]).right) < 1e-5);
  assert.equal(picked(cameraOf({ turn_deg: 0, tilt_deg: 2 }, 1, BOX, PART), 0, 0.99), null);
});

const tokens = source('host_tools/web/src/styles/tokens.css').toString();

for (const dark of [false, true]) {
  test(`contrast of ${dark ? 'dark' : 'light'} colours is WCAG AA's`, () => {
    const palette = paletteOf((name) => new RegExp(`--${name}:([^;]*);`).exec(tokens)?.[1] ?? '', dark);
    const atLeast = (front: string, behind: string, least: number) => {
      const is = contrast(palette.of(front), palette.of(behind));
      assert.ok(is >= least, `${front} on ${behind}: ${is.toFixed(2)}, at least ${least}`);
    };
    for (const behind of ['ground', 'surface', 'raised']) {
      for (const text of ['text', 'faint', 'accent', 'good', 'warning', 'bad']) {
        atLeast(text, behind, 4.5);
      }
      atLeast('edge', behind, 3);
    }
    atLeast('on-accent', 'accent', 4.5);
    atLeast('text', 'rubber', 4.5);
    atLeast('faint', 'rubber', 4.5);
    for (let finger = 0; finger < 8; finger++) {
      atLeast(`finger-${finger}`, 'surface', 3);
    }
    assert.equal(contrast(parsed('#777777'), [1, 1, 1]).toFixed(2), '4.48'); // WCAG's
    /* The scale's order can be told without its hue. */
    const steps = Array.from({ length: HEAT_STOPS }, (_, i) => contrast(palette.of(`heat-${i}`), [0, 0, 0]));
    steps.forEach((step, i) => {
      const before = steps[i - 1];
      assert.ok(before === undefined || (dark ? step > before : i === 1 || step < before), `heat ${i}`);
    });
  });
}

test('readers of the screen are told what begins, ends and changes, no faster than one can listen', () => {
  const speech = new Speech();
  assert.equal(speech.sentence(null, 'live', 0), 'Live.');
  const pressed = contactOf({ force_N: 3.24, x_mm: 2, y_mm: -4 });
  assert.equal(speech.sentence(pressed, 'live', 1000), null);
  assert.equal(speech.sentence(pressed, 'live', 3000), 'Contact, 3.2 newtons at 2, -4 millimetres.');
  assert.equal(speech.sentence({ ...pressed, force_N: 3.4 }, 'live', 60_000), null);
  assert.match(speech.sentence({ ...pressed, force_N: 8 }, 'live', 70_000) ?? '', /8\.0 newtons/);
  const slips = { ...pressed, force_N: 8, flags: FITTED | Flag.SLIP | Flag.ELONGATED };
  assert.match(speech.sentence(slips, 'live', 80_000) ?? '', /^Slips; .*round/);
  assert.equal(speech.sentence(slips, 'live', 90_000), null);
  assert.equal(speech.sentence(null, 'stalled', 95_000), 'Stalled.', 'whether it is touched is not known');
  assert.equal(speech.sentence(contactOf({ flags: Flag.TARED }), 'live', 100_000), 'Live; no contact.');
});

test('of plain notices three stay, and every fault, once', () => {
  const leave = (...all: string[]) => leaving(all.map((text) => ({ text, is_plain: !text.includes('fault') })));
  assert.deepEqual([leave('a fault', 'a', 'b', 'fault', 'c'), leave('fault', 'a', 'fault', 'b', 'c', 'd')], [[], [0, 1]]);
});

const LAYOUT = { x_mm: [-9, 0, 9], y_mm: [0, 0, 0] };
const pictureOf = (contact: Contact) => sceneOf(LAYOUT, contact, READINGS, [], null);
const READINGS = { valid: 0b011, saturated: 0, doubtful: 0b010, pressure_Pa: new Float32Array([1000, 2000, NaN]) };

test('a picture shows doubt and broken sensors', () => {
  const contact = contactOf({ force_N: 2, p0_Pa: 9000, sigma_mm: 3, location_sd_mm: 0.3, flags: FITTED | Flag.MODEL });
  const scene = pictureOf(contact);
  assert.deepEqual(scene.broken, [false, false, true]);
  assert.deepEqual(scene.doubtful, [false, true, false]);
  assert.equal(scene.fit?.doubtful, true);
  assert.ok(Math.abs((scene.fit?.sd_mm ?? 0) - 0.3) < 1e-6);
  assert.equal(pictureOf(contactOf({ flags: Flag.TARED })).fit, null);
});

test('an arrow has a direction only where the load is no noise', () => {
  const flags = FITTED | Flag.TANGENTIAL_VALID;
  const pull = { flags, force_N: 4, qx_N: 0, qy_N: 2, tangential_ratio: 0.5 };
  const sure = pictureOf(contactOf({ ...pull, q_sd_N: 0.1 })).fit?.arrow;
  assert.deepEqual([sure?.along_x, sure?.along_y, sure?.length_mm], [0, 1, 15]);
  const unsure = pictureOf(contactOf({ ...pull, q_sd_N: 1.5 })).fit?.arrow;
  assert.equal(unsure?.length_mm, 0);
  assert.ok((unsure?.sd_mm ?? 0) > 10);
  assert.equal(pictureOf(contactOf({ ...pull, flags: FITTED })).fit?.arrow, null);
});

test('two contacts are two spots, and a long one has its ends', () => {
  const two = { x1_mm: -5, y1_mm: 7, location1_sd_mm: 0.25, x2_mm: 4, y2_mm: -2, location2_sd_mm: 0.5 };
  const both = pictureOf(contactOf({ ...two, flags: FITTED | Flag.SHAPE_VALID | Flag.TWO_CONTACTS })).fit;
  assert.deepEqual(both?.two, [
    { x_mm: -5, y_mm: 7, sd_mm: 0.25 },
    { x_mm: 4, y_mm: -2, sd_mm: 0.5 },
  ]);
  assert.ok(both?.doubtful && both.edge === null);
  const long = pictureOf(contactOf({ edge_angle_deg: -90, edge_length_mm: 20, flags: FITTED | Flag.SHAPE_VALID | Flag.EDGE })).fit;
  assert.deepEqual([long?.edge?.x_mm.toFixed(3), long?.edge?.y_mm, long?.two, long?.doubtful], ['0.000', -10, [], false]);
});

test('a moment of the past is the contact of then, its trail that of the second before', () => {
  const history = historyOf(3000, (i) => ({
    force_N: i / 1000,
    x_mm: i / 100,
    qx_N: 1,
    flags: i < 1400 || (i >= 1450 && i < 1500) ? Flag.TARED : FITTED,
  }));
  const { contact, trail } = momentAt(history, 2, 0.7);
  assert.ok(Math.abs(contact!.force_N - 2) < 1e-5);
  assert.equal(contact!.qx_N, 0, 'without its flag');
  assert.ok(trail.length > 5);
  trail.forEach(({ x_mm }, i) => assert.ok(x_mm >= 15 && x_mm <= 20.001 && (i === 0 || x_mm > (trail[i - 1]?.x_mm ?? 0))));
  const ring = historyOf(5000, (i) => ({ force_N: i }), 1000);
  const forces_N = [1, 3.5, 4.5, Infinity].map((t_s) => momentAt(ring, t_s, 0.7).contact?.force_N);
  assert.deepEqual(forces_N, [undefined, 4000, 4500, 4999]);
  const parted = historyOf(3000, (i) => (i < 1000 || i >= 2000 ? {} : null));
  assert.deepEqual(
    [0.999, 1.1, 1.4].map((t_s) => momentAt(parted, t_s, 0.7).contact !== null),
    [true, false, true],
  );
});
