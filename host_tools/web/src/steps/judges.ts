/** The judges of calibrations and of the doctor, wasm/judges.mjs; one for the page. */
import { load } from '../../wasm/judges.mjs';
import { WasmError } from '../../wasm/module.mjs';

/** Fetched when a dialog needs them: 150 kB compressed. */
export async function loadJudges(): ReturnType<typeof load> {
  const url = new URL('wasm/judges.wasm', document.baseURI);
  const response = await fetch(url);
  if (!response.ok) {
    throw new WasmError(`${url.href}: ${response.status}; load the page again`);
  }
  return load(await response.arrayBuffer());
}
