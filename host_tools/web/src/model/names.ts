/** Names of what the wire protocol numbers, in the tool's words. */
import { Capability, PacketType, Result, Stored } from '../line/packets';

const COMMANDS: Record<number, string> = {
  [PacketType.CMD_STREAM]: 'stream',
  [PacketType.CMD_TARE]: 'tare',
  [PacketType.CMD_RATE]: 'rate',
  [PacketType.CMD_OSR]: 'osr',
  [PacketType.CMD_SLIP]: 'slip',
  [PacketType.CMD_INFO]: 'info',
  [PacketType.CMD_HEALTH]: 'health',
  [PacketType.CMD_CRASH]: 'crash',
  [PacketType.CMD_LOADER]: 'loader',
  [PacketType.CMD_CALIBRATE]: 'calibrate',
  [PacketType.CMD_ERASE_CALIBRATION]: 'erase calibration',
  [PacketType.CMD_KEEP]: 'keep',
  [PacketType.CMD_PRIOR]: 'prior',
  [PacketType.CMD_LOCATION_LIMIT]: 'limit',
  [PacketType.CMD_PAD]: 'pad',
  [PacketType.CMD_ERASE_PAD]: 'erase pad',
};

export function commandName(type: number): string {
  return COMMANDS[type] ?? `0x${type.toString(16)}`;
}

/** For the end of a sentence. */
export function resultText(result: number): string {
  switch (result) {
    case Result.DONE:
      return 'done';
    case Result.UNKNOWN_COMMAND:
      return 'its firmware does not know this command';
    case Result.OUT_OF_RANGE:
      return 'the value is out of range for this firmware';
    case Result.NOT_NOW:
      return 'not possible now; try again in a moment';
    default:
      return `result ${result}`;
  }
}

function bitsText(names: readonly [number, string][], bits: number, none: string): string {
  const text = names.filter(([bit]) => bits & bit).map(([, name]) => name);
  return text.length > 0 ? text.join(',') : none;
}

/** "fit,slip,raw,tangential": what a firmware can do; "none". */
export function capabilitiesText(capabilities: number): string {
  return bitsText(
    [
      [Capability.FIT, 'fit'],
      [Capability.SLIP, 'slip'],
      [Capability.RAW_STREAM, 'raw'],
      [Capability.TANGENTIAL, 'tangential'],
    ],
    capabilities,
    'none',
  );
}

/** "calibration,settings,pad": what a fingertip keeps without power; "nothing". */
export function storedText(stored: number): string {
  return bitsText(
    [
      [Stored.CALIBRATION, 'calibration'],
      [Stored.SETTINGS, 'settings'],
      [Stored.WRITING, 'writing'],
      [Stored.DAMAGED, 'damaged'],
      [Stored.PAD, 'pad'],
    ],
    stored,
    'nothing',
  );
}
