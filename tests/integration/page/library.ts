/** The page's library, loaded before the tests that import this. */
import { readFileSync } from 'node:fs';
import * as core from '../../../host_tools/web/src/core';

await core.loadCore(readFileSync(process.env['FINGERTIP_CORE'] ?? ''));

export { core };
