import assert from 'node:assert/strict';
import test from 'node:test';
import { Decoder } from '../../../host_tools/web/src/line/decoder';
import { cobsDecode, cobsEncode, crc32 } from '../../../host_tools/web/src/line/framing';
import {
  Flag,
  PacketType,
  blank,
  decodeBody,
  encodePacket,
  type Contact,
  type DevicePacket,
} from '../../../host_tools/web/src/line/packets';
import { readVectors, vector } from './vectors';

test('CRC-32/ISO-HDLC has its check value', () => {
  assert.equal(crc32(new TextEncoder().encode('123456789')), 0xcbf43926);
});

test('COBS: what goes in comes out, around the lengths where a code is full', () => {
  const out = new Uint8Array(1024);
  for (const length of [0, 1, 253, 254, 255, 256, 507, 508, 509, 510, 800]) {
    for (const zero_every of [1, 7, 254, 255, 10000]) {
      const bytes = Uint8Array.from({ length }, (_, i) => (i % zero_every === zero_every - 1 ? 0 : 1 + (i % 255)));
      const frame = cobsEncode(bytes);
      assert.equal(frame.indexOf(0), frame.length - 1);
      assert.equal(cobsDecode(frame, 0, frame.length - 1, out), length);
      assert.deepEqual(out.slice(0, length), bytes);
    }
  }
  assert.equal(cobsDecode(Uint8Array.of(3, 1), 0, 2, out), 0);
});

for (const each of readVectors()) {
  test(`${each.name}: frame, packet, fields and back, as the C codec has them`, () => {
    const out = new Uint8Array(1024);
    const length = cobsDecode(each.frame, 0, each.frame.length - 1, out);
    assert.deepEqual(out.slice(0, length), each.packet);
    const view = new DataView(out.buffer);
    const fields = blank(each.packet[1]!);
    assert.ok(decodeBody(view, length - 4, fields));
    fields['sequence'] = view.getUint16(2, true);
    const again = encodePacket({ ...fields, t_us: view.getBigUint64(4, true) } as unknown as DevicePacket);
    assert.deepEqual(again, each.frame);
  });
}

test('every field of every packet has the value that its vector names', () => {
  let compared = 0;
  for (const each of readVectors()) {
    const fields = blank(each.packet[1]!);
    const body = new DataView(each.packet.slice().buffer);
    assert.ok(decodeBody(body, each.packet.length - 4, fields), each.name);
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
  const decoder = new Decoder();
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
  assert.deepEqual([...info.x_mm], [-4.5, 4.5]);
  assert.equal(info.pad[43], 0.0390625);
  assert.ok(raw?.type === PacketType.RAW);
  assert.equal(raw.temperature_cC, -125);
  assert.equal(raw.pressure_Pa_q10[0], 100000 * 1024);
  assert.equal(raw.baseline_Pa_q10[2], -(2 ** 31));
  assert.ok(crash?.type === PacketType.CRASH);
  assert.equal(crash.registers[8], 0x20041fa8);
  assert.equal(crash.end_us, 0x0102030405060708n);
  assert.equal(decoder.counts.packets, 5);
});

test('frames that are cut anywhere are put together; what was before the first 0 counts as nothing', () => {
  const vectors = readVectors().filter((each) => each.packet[1]! < 0x80);
  const stream = vectors.flatMap((each) => [...each.frame]);
  for (const part of [1, 2, 3, 7, 64, 1000]) {
    const decoder = new Decoder();
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
  const decoder = new Decoder();
  decoder.feed(vector('contact_grasp').frame, () => undefined);
  decoder.feed(vector('contact_none').frame, () => undefined);
  const contact: Contact = decoder.contact;
  assert.equal(contact.flags & Flag.FIT_VALID, 0);
  assert.equal(contact.x_mm, 0);
  assert.equal(contact.vx_mm_s, 0);
});

test('damage, gaps, other versions and unknown types are counted, each as what it is', () => {
  const make = (sequence: number): Uint8Array =>
    encodePacket({ ...blank(PacketType.HEALTH), type: PacketType.HEALTH, sequence, t_us: 1 });
  const decoder = new Decoder();
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
  new DataView(packet.buffer).setUint32(packet.length - 4, crc32(packet, packet.length - 4), true);
  feed(cobsEncode(packet));
  assert.equal(decoder.counts.version_errors, 1);
  assert.equal(decoder.other_version, 4);
  packet[0] = 5;
  packet[1] = 0x7f;
  new DataView(packet.buffer).setUint32(packet.length - 4, crc32(packet, packet.length - 4), true);
  feed(cobsEncode(packet));
  assert.equal(decoder.counts.unknown_types, 1);
  assert.equal(packets, 4);
});

test('values that no packet may hold are refused', () => {
  const contact = { ...blank(PacketType.CONTACT), type: PacketType.CONTACT, sequence: 0, t_us: 0 };
  assert.throws(() => encodePacket({ ...contact, flags: Flag.FIT_VALID, x_mm: NaN } as object as Contact), /x_mm/);
  assert.throws(() => encodePacket({ ...contact, frame: 2 ** 32 } as object as Contact), /frame/);
  const packet = vector('contact').packet.slice();
  const view = new DataView(packet.buffer);
  view.setUint32(12 + 4 + 4 + 14 + 4, 0x7f800000, true);
  assert.equal(decodeBody(view, packet.length - 4, blank(PacketType.CONTACT)), false);
  assert.equal(decodeBody(new DataView(vector('contact').packet.buffer), packet.length - 5, blank(PacketType.CONTACT)), false);
});
