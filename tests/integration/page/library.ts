/** The page's library, loaded before the tests that import this. */
import { readFileSync } from 'node:fs';
import { loadCore } from '../../../host_tools/web/src/core';

await loadCore(readFileSync(process.env['FINGERTIP_CORE'] ?? ''));

export { core } from '../../../host_tools/web/src/core';
