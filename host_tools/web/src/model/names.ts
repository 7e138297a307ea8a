/** Names of what the wire protocol numbers, in the tool's words. */
import { CAPABILITY_WORDS, COMMAND_WORDS, RESULT_WORDS, STORED_WORDS } from '../line/line_facts';

export function commandName(type: number): string {
  return COMMAND_WORDS.find(([each]) => each === type)?.[1] ?? `0x${type.toString(16)}`;
}

/** For the end of a sentence. */
export function resultText(result: number): string {
  return RESULT_WORDS.find(([each]) => each === result)?.[1] ?? `result ${result}`;
}

function bitsText(names: readonly (readonly [number, string])[], bits: number, none: string): string {
  const text = names.filter(([bit]) => bits & bit).map(([, name]) => name);
  return text.length > 0 ? text.join(',') : none;
}

/** "fit,slip,raw,tangential": what a firmware can do; "none". */
export function capabilitiesText(capabilities: number): string {
  return bitsText(CAPABILITY_WORDS, capabilities, 'none');
}

/** "calibration,settings,pad": what a fingertip keeps without power; "nothing". */
export function storedText(stored: number): string {
  return bitsText(STORED_WORDS, stored, 'nothing');
}
