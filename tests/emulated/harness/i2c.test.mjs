/** The I2C block and the bus of board pico_mux under small images. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { run } from './bench.mjs';

const main = (body) =>
  `void main(void) { start_clocks(); start_i2c(); uint8_t b[16] = {0}; uint8_t in[16]; (void)in; (void)b; ${body} done(); }`;

function failsWith(name, body, pattern) {
  test(`fails: ${name}`, () => {
    const { result } = run(main(body));
    assert.equal(result.end_reason, 'failure');
    assert.match(result.warnings.join('\n'), pattern);
  });
}

test('a transfer takes its bus time', () => {
  const transfers = [];
  const { result } = run(main('b[0] = 1; i2c_run(0x70, b, 1, 0, 0);'), { onBusTransfer: (t) => transfers.push(t) });
  assert.deepEqual(result.warnings, []);
  const bit_ns = (126 + 11 + 7 + 187 + 1) * 8 + 100;
  const expected = 18 * bit_ns + (126 + 11 + 7) * 8 + bit_ns;
  const took = transfers[0].end_ns - transfers[0].start_ns;
  assert.ok(Math.abs(took - expected) < 100, `${took} ${expected}`);
});

test('select, reset, PROM and conversion through multiplexer 2, channel 3 reach sensor 13', () => {
  const { results, machine, result } = run(
    main(`
    b[0] = 1 << 3; RESULT(0) = i2c_run(0x72, b, 1, 0, 0); b[0] = 0x1e; RESULT(1) = i2c_run(0x76, b, 1, 0, 0); wait_us(3000);
    for (int i = 0; i < 7; i++) { b[0] = (uint8_t)(0xa0 + 2 * i); i2c_run(0x76, b, 1, in, 2); RESULT(2 + i) = (uint32_t)in[0] << 8 | in[1]; }
    b[0] = 0x44; i2c_run(0x76, b, 1, 0, 0); wait_us(2300); b[0] = 0; i2c_run(0x76, b, 1, in, 3);
    RESULT(9) = (uint32_t)in[0] << 16 | in[1] << 8 | in[2];`),
  );
  assert.deepEqual(result.warnings, []);
  assert.deepEqual(results.slice(0, 2), [0, 0]);
  assert.deepEqual(results.slice(2, 9), machine.board.sensors[13].prom);
  assert.ok(results[9] > 5e6 && results[9] < 8e6);
});

test('address not acknowledged: source, flush, STOP; data not acknowledged: the same', () => {
  const { results } = run(
    main(`RESULT(0) = i2c_run(0x76, b, 3, 0, 0); b[0] = 1; i2c_run(0x70, b, 1, 0, 0);
    b[0] = 0xae; b[1] = 1; RESULT(1) = i2c_run(0x76, b, 2, 0, 0);`),
  );
  assert.equal(results[0] & 0xffff, 1);
  assert.equal(results[0] >>> 23, 3);
  assert.equal(results[1] & 0xffff, 8);
});

test('writes to the FIFO are lost until the abort is cleared, by its own register', () => {
  const { results } = run(
    main(`REG(0x40044004) = 0x33; REG(0x4004406c) = 1; REG(0x40044010) = 0x200;
    while (!(REG(0x40044034) & 64)) { } (void)REG(0x40044040); REG(0x40044010) = 0x201; RESULT(0) = REG(0x40044074); (void)REG(0x40044054);
    while (REG(0x40044070) & 32) { } REG(0x40044010) = 0x202; RESULT(1) = REG(0x40044070) >> 5 & 1;`),
  );
  assert.deepEqual(results.slice(0, 2), [0, 1]);
});

const STUCK = [{ type: 'sda_stuck_low', sensor: 0, from_s: 0.01 }];
const SELECT = 'b[0] = 1; i2c_run(0x70, b, 1, 0, 0); wait_us(20000);';

test('a stuck SDA keeps the bus busy; nine GPIO clocks free it', () => {
  const { results, result } = run(
    main(`${SELECT}
    REG(0x4004406c) = 0; REG(0x40044004) = 0x70; REG(0x4004406c) = 1; REG(0x40044010) = 0x200; wait_us(1000);
    RESULT(0) = REG(0x40044070) >> 5 & 1; REG(0x4004406c) = 0; while (REG(0x4004409c) & 1) { }
    REG(0xd000002c) = 0; REG(0x4001402c) = 5; REG(0x40014024) = 5;
    RESULT(1) = REG(0xd0000004) >> 4 & 3;
    for (int i = 0; i < 9; i++) { REG(0xd0000024) = 1 << 5; wait_us(5); REG(0xd0000028) = 1 << 5; wait_us(5); RESULT(2 + i) = REG(0xd0000004) >> 4 & 3; }
    REG(0x4001402c) = 3; REG(0x40014024) = 3; b[0] = 2; RESULT(11) = i2c_run(0x70, b, 1, 0, 0);`),
    { faults: STUCK },
  );
  assert.deepEqual(result.warnings, []);
  assert.deepEqual(results.slice(0, 12), [1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 3, 0]);
});

test('a RESET pulse frees the bus and a stuck multiplexer', () => {
  const pulse = (gpio) =>
    `REG(${0x40014004 + 8 * gpio}) = 5; REG(0xd0000024) = 1 << ${gpio}; wait_us(2); REG(0xd0000028) = 1 << ${gpio}; wait_us(2);`;
  const { results } = run(
    main(`${SELECT} RESULT(0) = REG(0xd0000004) >> 4 & 1; ${pulse(6)} RESULT(1) = REG(0xd0000004) >> 4 & 1;
    b[0] = 1; RESULT(2) = i2c_run(0x71, b, 1, 0, 0); ${pulse(7)} RESULT(3) = i2c_run(0x71, b, 1, 0, 0);`),
    { faults: [...STUCK, { type: 'mux_stuck', mux: 1, from_s: 0.01 }] },
  );
  assert.deepEqual([results[0], results[1], results[2] & 1, results[3]], [0, 1, 1, 0]);
});

failsWith('IC_TAR written while enabled', 'REG(0x4004406c) = 1; REG(0x40044004) = 0x70;', /IC_TAR written while the block is enabled/);
failsWith('command while disabled', 'REG(0x40044010) = 0;', /while the block is disabled/);
failsWith('too fast for the sensors', 'REG(0x40044020) = 100; REG(0x4004406c) = 1;', /fast mode needs/);
const SEND = 'REG(0x4004406c) = 1; REG(0x40044010) = 0x200; wait_us(1);';
failsWith('no pull-up', `REG(0x4001c014) = 0x42; ${SEND}`, /GPIO4 \(SDA\) has no pull-up/);
failsWith('no I2C function', `REG(0x4001402c) = 5; ${SEND}`, /GPIO5 \(SCL\) has function 5/);
failsWith('bus line driven high', 'REG(0x40014024) = 5; REG(0xd0000014) = 1 << 4; REG(0xd0000024) = 1 << 4;', /drives the bus high/);
failsWith('receive FIFO underflow', 'REG(0x4004406c) = 1; (void)REG(0x40044010);', /receive FIFO is empty/);
const FILL = 'REG(0x4004406c) = 1; for (int i = 0; i < 20; i++) REG(0x40044010) = 0;';
failsWith('transmit FIFO overflow', FILL, /transmit FIFO overflow/);
