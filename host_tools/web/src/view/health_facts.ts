/** Lines of the health panel out of what a fingertip and its line count. */
import { Flag, Stored } from '../line/line_facts';
import { core } from '../core';
import type { Level, Shown } from './shown';

export interface Fact {
  readonly name: string;
  readonly value: string;
  readonly level?: Level;
}

export interface FactGroup {
  readonly title: string;
  readonly facts: readonly Fact[];
}

const ENDS = ['none', 'hard fault', 'panic', 'watchdog', 'an exception without a handler', 'stack overflow', 'start-up gave up'];
/** A processor without a rest drops frames soon. */
const BUSY_permille = 950;
const LITTLE_STACK_bytes = 512;
/** The largest value of the packet: no chip's stack, so firmware on a host, where neither load nor stack is measured. */
const HOST_STACK_bytes = 65535;

export function factsOf(shown: Shown): FactGroup[] {
  const { fingertip } = shown;
  const { info, health, counts, crash, raw, raws } = fingertip;
  const groups: FactGroup[] = [];
  const line: Fact[] = [
    { name: 'frames', value: `${shown.frames_per_s.toFixed(0)} /s` },
    counted('lost', counts.dropped_packets),
    counted('damaged', counts.crc_errors + counts.format_errors),
    { name: 'received', value: bytesText(counts.bytes) },
  ];
  if (fingertip.contacts > 0) {
    line.push({ name: 'latency', value: `${(fingertip.contact.total_us / 1000).toFixed(2)} ms` });
  }
  groups.push({ title: 'Line', facts: line });
  if (info) {
    const count = info.sensor_count;
    const sensors: Fact[] = [];
    if (raws > 0) {
      const readings = shown.readings;
      const answering = health ? bits(health.sensors_present) : count;
      sensors.push({
        name: 'answer',
        value: `${answering} of ${count}`,
        level: answering < count ? 'bad' : 'good',
      });
      const doubtful = named(readings?.doubtful ?? 0, count);
      sensors.push({
        name: 'in doubt',
        value: doubtful || 'none',
        level: doubtful ? 'warning' : 'plain',
      });
      if (readings && readings.valid !== 2 ** count - 1) {
        const out = named(~readings.valid, count);
        sensors.push({ name: 'without reading', value: out, level: 'bad' });
      }
      sensors.push({
        name: 'temperature',
        value: raw.temperature_cC ? `${(raw.temperature_cC / 100).toFixed(1)} °C` : '–',
      });
    }
    if (health) {
      sensors.push(counted('implausible', health.implausible_readings));
      if (health.sensors_prom_bad) {
        sensors.push({ name: 'bad PROM', value: named(health.sensors_prom_bad, count), level: 'bad' });
      }
    }
    groups.push({ title: 'Sensors', facts: sensors });
  }
  if (health) {
    groups.push({
      title: 'Bus',
      facts: [
        counted('not acknowledged', health.bus_nacks),
        counted('timeouts', health.bus_timeouts),
        counted('recovered', health.bus_recoveries),
        counted('zero readings', health.zero_readings),
      ],
    });
    const on_host = health.stack_free_bytes === HOST_STACK_bytes;
    const busy: Fact = {
      name: 'busy',
      value: `${(health.cpu_busy_permille / 10).toFixed(0)} %`,
      level: health.cpu_busy_permille > BUSY_permille ? 'warning' : 'plain',
    };
    const stack: Fact = {
      name: 'stack free',
      value: `${health.stack_free_bytes} B`,
      level: health.stack_free_bytes < LITTLE_STACK_bytes ? 'bad' : 'plain',
    };
    groups.push({
      title: 'Processor',
      facts: [
        ...(on_host ? [] : [busy]),
        counted('frames skipped', health.frames_skipped),
        counted('incomplete', health.frames_incomplete),
        counted('packets dropped', health.packets_dropped),
        ...(on_host ? [] : [stack]),
        { name: 'running for', value: duration(health.uptime_s) },
        counted('watchdog resets', health.watchdog_resets),
      ],
    });
  }
  if (info) {
    const firmware: Fact[] = [
      { name: 'version', value: `${info.firmware_version.join('.')} ${info.git_hash}` },
      { name: 'board', value: info.board },
      { name: 'scene', value: info.scene },
      { name: 'serial', value: info.serial },
      { name: 'oversampling', value: String(info.osr) },
      { name: 'can', value: core.capabilitiesText(info.capabilities).replaceAll(',', ', ') },
      {
        name: 'keeps',
        value: core.storedText(info.stored).replaceAll(',', ', '),
        level: info.stored & Stored.DAMAGED ? 'bad' : 'plain',
      },
    ];
    if (info.stored & Stored.CALIBRATION) {
      const date = new Date(info.calibration_date_s * 1000).toISOString().slice(0, 10);
      firmware.push({ name: 'calibrated', value: date });
    } else if (fingertip.contacts > 0 && !(fingertip.contact.flags & Flag.CALIBRATED)) {
      firmware.push({ name: 'calibrated', value: 'no' });
    }
    if (crash) {
      firmware.push({
        name: 'last crash',
        value: ENDS[crash.kind] ?? `kind ${crash.kind}`,
        level: crash.kind === 0 ? 'plain' : 'bad',
      });
    }
    groups.push({ title: 'Firmware', facts: firmware });
  }
  return groups;
}

function counted(name: string, count: number): Fact {
  return { name, value: String(count), level: count > 0 ? 'warning' : 'plain' };
}

function bits(map: number): number {
  let count = 0;
  for (let rest = map >>> 0; rest > 0; rest >>>= 1) {
    count += rest & 1;
  }
  return count;
}

/** "3, 7" */
function named(map: number, count: number): string {
  return Array.from({ length: count }, (_, k) => k)
    .filter((k) => (map >>> k) & 1)
    .join(', ');
}

export function duration(seconds: number): string {
  const parts: [number, string][] = [
    [Math.floor(seconds / 86400), 'd'],
    [Math.floor(seconds / 3600) % 24, 'h'],
    [Math.floor(seconds / 60) % 60, 'min'],
    [Math.floor(seconds) % 60, 's'],
  ];
  const from = parts.findIndex(([count]) => count > 0);
  return (from < 0 ? parts.slice(3) : parts.slice(from, from + 2)).map(([count, unit]) => `${count} ${unit}`).join(' ');
}

function bytesText(bytes: number): string {
  return bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
