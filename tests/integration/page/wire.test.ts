import assert from 'node:assert/strict';
import test from 'node:test';
import { CoreError } from '../../../host_tools/web/src/core';
import { Flag, PacketType, WIRE_VERSION, type Contact, type DevicePacket } from '../../../host_tools/web/src/line/line_facts';
import { core } from './library';
import { cobsDecode, cobsEncode, crc32, readVectors, vector } from './vectors';

/** The packet of a frame, as a decoder hands it out. */
function decoded(frame: Uint8Array): DevicePacket | null {
  const decoder = core.newDecoder();
  let found: DevicePacket | null = null;
  decoder.feed(Uint8Array.of(0, ...frame), (packet) => (found = packet));
  return found;
}

test('CRC-32/ISO-HDLC has its check value', () => {
  assert.equal(crc32(new TextEncoder().encode('123456789')), 0xcbf43926); // that of the tests
});

for (const each of readVectors()) {
  test(`${each.name}: frame, packet, fields and back, as the C codec has them`, () => {
    assert.deepEqual(cobsDecode(each.frame), each.packet);
    assert.deepEqual(cobsEncode(each.packet), each.frame);
    const fields = decoded(each.frame);
    assert.ok(fields);
    assert.equal(fields.type, each.packet[1]);
    const again = core.encode(fields);
    // A double has counts of microseconds up to 2^53.
    const wide = Object.values(fields).some((value) => typeof value === 'number' && !Number.isSafeInteger(value) && value > 2 ** 53);
    if (wide) {
      assert.deepEqual(decoded(again), fields);
    } else {
      assert.deepEqual(again, each.frame);
    }
  });
}

test('every field of every packet has the value that its vector names', () => {
  let compared = 0;
  for (const each of readVectors()) {
    const fields = decoded(each.frame) as unknown as Record<string, unknown>;
    for (const [name, value] of each.values) {
      if (typeof fields[name] === 'number' && name !== 'sequence') {
        assert.equal(fields[name], value, `${each.name}: ${name}`);
        compared++;
      }
    }
  }
  assert.ok(compared >= 80, `${compared} values`);
});

test('fields have the values that the vectors name', () => {
  const decoder = core.newDecoder();
  const seen: DevicePacket[] = [];
  decoder.feed(Uint8Array.of(0), () => assert.fail());
  for (const name of ['contact_grasp', 'info_grasp', 'raw', 'crash', 'acknowledgement']) {
    decoder.feed(vector(name).frame, (packet) => seen.push(packet));
  }
  const [contact, info, raw, crash] = seen;
  assert.ok(contact?.type === PacketType.CONTACT);
  assert.equal(contact.t_us, 123456789012);
  assert.equal(contact.frame, 70000);
  assert.equal(contact.total_us, 8163);
  assert.equal(contact.x_mm, -4.5);
  assert.equal(contact.sigma_mm, 5.625);
  assert.equal(contact.slip_mm, 0.375);
  assert.equal(contact.vy_mm_s, 2.25);
  assert.ok(contact.flags & Flag.MOVING);
  assert.ok(info?.type === PacketType.INFO);
  assert.equal(info.serial, 'E66058388347A12C');
  assert.equal(info.git_hash, '0123456789ab+');
  assert.deepEqual([...info.gain], [0.875, 1.125]);
  assert.deepEqual([...info.gain_sd], [0.0078125, 0.015625]);
  assert.deepEqual([...info.off_x_um], [250, -2000]);
  assert.deepEqual([...info.off_y_um], [-125, 2000]);
  assert.deepEqual([...info.wider_q15], [1638, -9830]);
  assert.deepEqual([...info.x_mm], [-4.5, 4.5]);
  assert.equal(info.pad_edge_force[2], 0.0390625);
  assert.ok(raw?.type === PacketType.RAW);
  assert.equal(raw.temperature_cC, -125);
  assert.equal(raw.pressure_Pa_q10[0], 100000 * 1024);
  assert.equal(raw.baseline_Pa_q10[2], -(2 ** 31));
  assert.ok(crash?.type === PacketType.CRASH);
  assert.equal(crash.sp, 0x20041fa8);
  assert.equal(crash.end_us, Number(0x0102030405060708n));
  assert.equal(decoder.counts.packets, 5);
});

test('frames that are cut anywhere are put together; what was before the first 0 counts as nothing', () => {
  const vectors = readVectors().filter((each) => each.packet[1]! < 0x80);
  const stream = vectors.flatMap((each) => [...each.frame]);
  for (const part of [1, 2, 3, 7, 64, 1000]) {
    const decoder = core.newDecoder();
    let packets = 0;
    const bytes = Uint8Array.from([1, 2, 3, 0, ...stream]);
    for (let at = 0; at < bytes.length; at += part) {
      decoder.feed(bytes.subarray(at, at + part), () => packets++);
    }
    assert.equal(packets, vectors.length, `parts of ${part}`);
    assert.equal(decoder.counts.format_errors + decoder.counts.crc_errors, 0);
    assert.equal(decoder.counts.bytes, bytes.length);
  }
});

test('quantities of a contact before are gone where their flag is off', () => {
  const decoder = core.newDecoder();
  decoder.feed(vector('contact_grasp').frame, () => undefined);
  decoder.feed(vector('contact_none').frame, () => undefined);
  const contact: Contact = decoder.contact;
  assert.equal(contact.flags & Flag.FIT_VALID, 0);
  assert.equal(contact.x_mm, 0);
  assert.equal(contact.vx_mm_s, 0);
});

test('damage, gaps, other versions and unknown types are counted, each as what it is', () => {
  const make = (sequence: number): Uint8Array =>
    core.encode({ ...core.blank(PacketType.HEALTH), type: PacketType.HEALTH, sequence, t_us: 1 });
  const decoder = core.newDecoder();
  let packets = 0;
  const feed = (bytes: Uint8Array): void => decoder.feed(bytes, () => packets++);
  feed(make(65534));
  feed(make(65535));
  feed(make(3)); // 0, 1, 2 are lost
  feed(make(2));
  assert.equal(decoder.counts.dropped_packets, 3);
  assert.equal(decoder.counts.out_of_order, 1);
  const damaged = make(3);
  damaged[3]! ^= 8; // its sequence
  feed(damaged);
  assert.equal(decoder.counts.crc_errors, 1);
  feed(new Uint8Array(2000).fill(7));
  feed(Uint8Array.of(0));
  feed(Uint8Array.of(9, 1, 1, 0));
  assert.equal(decoder.counts.format_errors, 2);
  const packet = vector('health').packet.slice();
  packet[0] = 4;
  new DataView(packet.buffer).setUint32(packet.length - 4, crc32(packet.subarray(0, -4)), true);
  feed(cobsEncode(packet));
  assert.equal(decoder.counts.version_errors, 1);
  assert.equal(decoder.other_version, 4);
  packet[0] = WIRE_VERSION;
  packet[1] = 0x7f;
  new DataView(packet.buffer).setUint32(packet.length - 4, crc32(packet.subarray(0, -4)), true);
  feed(cobsEncode(packet));
  assert.equal(decoder.counts.unknown_types, 1);
  assert.equal(packets, 4);
});

test('values that no packet may hold are refused', () => {
  const contact = { ...core.blank(PacketType.CONTACT), type: PacketType.CONTACT, sequence: 0, t_us: 0 };
  assert.throws(() => core.encode({ ...contact, flags: Flag.FIT_VALID, x_mm: NaN } as object as Contact), /x_mm/);
  assert.throws(() => core.encode({ ...contact, frame: 2 ** 32 } as object as Contact), /frame/);
  assert.throws(() => core.encode({ ...contact, type: 0x7f } as object as Contact), CoreError);
  const text = { ...core.blank(PacketType.INFO), type: PacketType.INFO, sensor_count: 1, board: 'longer than sixteen' };
  assert.throws(() => core.encode(text), /board/);
  const packet = vector('contact').packet.slice();
  const framed = (bytes: Uint8Array): Uint8Array => {
    new DataView(bytes.buffer).setUint32(bytes.length - 4, crc32(bytes.subarray(0, -4)), true);
    return cobsEncode(bytes);
  };
  assert.ok(decoded(framed(packet)));
  new DataView(packet.buffer).setUint32(12 + 4 + 4 + 14 + 4, 0x7f800000, true);
  assert.equal(decoded(framed(packet)), null);
  assert.equal(decoded(framed(vector('contact').packet.slice(0, -1))), null);
});
