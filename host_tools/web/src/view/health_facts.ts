/** Lines of the health panel out of what a fingertip and its line count. */
import { Flag, Stored } from '../line/line_facts';
import { capabilitiesText, storedText } from '../core';
import { hasSensor } from '../model/history';
import type { Level, Shown } from './shown';

export interface Fact {
  readonly name: string;
  readonly value: string;
  readonly level: Level;
}

export interface FactGroup {
  readonly title: string;
  readonly facts: readonly Fact[];
}

/** A processor without a rest drops frames soon. */
const BUSY_permille = 950;
const LITTLE_STACK_bytes = 512;
/** The largest value of the packet: no chip's stack, so firmware on a host, where neither load nor stack is measured. */
const HOST_STACK_bytes = 65535;

function fact(name: string, value: string, level: Level = 'plain'): Fact {
  return { name, value, level };
}

function counted(name: string, count: number): Fact {
  return fact(name, String(count), count > 0 ? 'warning' : 'plain');
}

/** now_ms: performance.now(). */
export function factsOf(shown: Shown, now_ms: number): FactGroup[] {
  const { info, health } = shown.fingertip;
  const current = shown.isCurrent(now_ms);
  return [
    { title: 'Line', facts: lineFacts(shown, current) },
    ...(info ? [{ title: 'Sensors', facts: sensorFacts(shown, info.sensor_count, now_ms) }] : []),
    ...(health
      ? [
          {
            title: 'Bus',
            facts: [
              counted('not acknowledged', health.bus_nacks),
              counted('timeouts', health.bus_timeouts),
              counted('recovered', health.bus_recoveries),
              counted('zero readings', health.zero_readings),
            ],
          },
          { title: 'Processor', facts: processorFacts(health) },
        ]
      : []),
    ...(info ? [{ title: 'Firmware', facts: firmwareFacts(shown, info) }] : []),
  ];
}

function lineFacts({ fingertip, frames_per_s }: Shown, current: boolean): Fact[] {
  const { counts, contact, contacts } = fingertip;
  return [
    fact('frames', `${current ? frames_per_s.toFixed(0) : 0} /s`),
    counted('lost', counts.dropped_packets),
    counted('damaged', counts.crc_errors + counts.format_errors),
    fact('received', counts.bytes < 1e6 ? `${(counts.bytes / 1e3).toFixed(0)} kB` : `${(counts.bytes / 1e6).toFixed(1)} MB`),
    ...(contacts > 0 && current ? [fact('latency', `${(contact.total_us / 1000).toFixed(2)} ms`)] : []),
  ];
}

function sensorFacts(shown: Shown, count: number, now_ms: number): Fact[] {
  const { state, health, raw } = shown.fingertip;
  const facts: Fact[] = [];
  if (health && state === 'live') {
    const answering = sensorsOf(health.sensors_present, count).length;
    facts.push(fact('answer', `${answering} of ${count}`, answering < count ? 'bad' : 'good'));
  }
  const { readings } = shown.moment(Infinity, now_ms);
  if (readings) {
    const doubtful = sensorsOf(readings.doubtful, count).join(', ');
    facts.push(fact('in doubt', doubtful || 'none', doubtful ? 'warning' : 'plain'));
    if (readings.valid !== 2 ** count - 1) {
      facts.push(fact('without reading', sensorsOf(2 ** count - 1 - readings.valid, count).join(', '), 'bad'));
    }
    facts.push(fact('temperature', raw.temperature_cC ? `${(raw.temperature_cC / 100).toFixed(1)} °C` : '–'));
  }
  if (health) {
    facts.push(counted('implausible', health.implausible_readings));
    if (health.sensors_prom_bad) {
      facts.push(fact('bad PROM', sensorsOf(health.sensors_prom_bad, count).join(', '), 'bad'));
    }
  }
  return facts;
}

function processorFacts(health: NonNullable<Shown['fingertip']['health']>): Fact[] {
  const { cpu_busy_permille, stack_free_bytes } = health;
  const on_host = stack_free_bytes === HOST_STACK_bytes;
  const busy = fact('busy', `${(cpu_busy_permille / 10).toFixed(0)} %`, cpu_busy_permille > BUSY_permille ? 'warning' : 'plain');
  const stack = fact('stack free', `${stack_free_bytes} B`, stack_free_bytes < LITTLE_STACK_bytes ? 'bad' : 'plain');
  return [
    ...(on_host ? [] : [busy]),
    counted('frames skipped', health.frames_skipped),
    counted('incomplete', health.frames_incomplete),
    counted('packets dropped', health.packets_dropped),
    ...(on_host ? [] : [stack]),
    fact('running for', duration(health.uptime_s)),
    counted('watchdog resets', health.watchdog_resets),
  ];
}

function firmwareFacts({ fingertip }: Shown, info: NonNullable<Shown['fingertip']['info']>): Fact[] {
  const { contact, contacts } = fingertip;
  const facts = [
    fact('version', `${info.firmware_version.join('.')} ${info.git_hash}`),
    fact('board', info.board),
    fact('scene', info.scene),
    fact('serial', info.serial),
    fact('oversampling', String(info.osr)),
    fact('can', capabilitiesText(info.capabilities).replaceAll(',', ', ')),
    fact('keeps', storedText(info.stored).replaceAll(',', ', '), info.stored & Stored.DAMAGED ? 'bad' : 'plain'),
  ];
  if (info.stored & Stored.CALIBRATION) {
    facts.push(fact('calibrated', new Date(info.calibration_date_s * 1000).toISOString().slice(0, 10)));
  } else if (contacts > 0 && !(contact.flags & Flag.CALIBRATED)) {
    facts.push(fact('calibrated', 'no'));
  }
  return facts;
}

/** The sensors in a bitmap. */
export function sensorsOf(map: number, count: number): number[] {
  return Array.from({ length: count }, (_, k) => k).filter((k) => hasSensor(map, k));
}

function duration(seconds: number): string {
  const parts: [number, string][] = [
    [Math.floor(seconds / 86400), 'd'],
    [Math.floor(seconds / 3600) % 24, 'h'],
    [Math.floor(seconds / 60) % 60, 'min'],
    [Math.floor(seconds) % 60, 's'],
  ];
  const from = parts.findIndex(([count]) => count > 0);
  return (from < 0 ? parts.slice(3) : parts.slice(from, from + 2)).map(([count, unit]) => `${count} ${unit}`).join(' ');
}
