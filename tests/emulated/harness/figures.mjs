/**
 * The storms on all boards, as figures for the report: prints one JSON object.
 *
 * usage: figures.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME FOLDER_WITH_IMAGE_FOR_MS5837_30BA
 */
import { Storms } from './storms.mjs';
import { streamExample } from './sensor_example.mjs';

const [images, fingertip, command_frame, sensor_images] = process.argv.slice(2);
const tools = { fingertip, command_frame };
const storms = new Storms(images, tools);
const BOARDS = ['pico_mux', 'pico_parallel'];

const sum = (values) => values.reduce((total, value) => total + value, 0);
const onEach = (count) => sum(BOARDS.map(count));

const writes = BOARDS.map((board) => storms.codeWrites(board));
const collisions = storms.promCollisions('pico_parallel', 30);
const resets = BOARDS.flatMap((board) =>
  [
    [6.5e6, 10],
    [12e6, 10],
    [12e6, 100],
  ].flatMap(([rosc_hz, after_ms]) => ['fault', 'unfed'].map((how) => storms.eraseResetRecovered(board, rosc_hz, after_ms, how))),
);
const example = streamExample(sensor_images, tools);

process.stdout.write(
  JSON.stringify({
    ehci_detaches: onEach((board) => storms.ehciDetaches(board, 1) + storms.ehciDetaches(board, 2)),
    se0_bites: onEach((board) =>
      sum(
        [
          [1, 920],
          [2, 920],
          [1, 3000],
          [2, 3000],
        ].map(([revision, ms]) => storms.se0Bites(board, revision, ms)),
      ),
    ),
    code_writes_tried: sum(writes.map(({ tried }) => tried)),
    code_writes_trapped: writes.every(({ tried, trapped }) => tried === trapped) ? 1 : 0,
    resumes: 2 * 100,
    torn_after_resume: onEach((board) => storms.tornAfterResume(board, 100)),
    erase_resets: resets.length,
    erase_reset_recovered: resets.every(Boolean) ? 1 : 0,
    withdrawals_wrong: onEach((board) => storms.wrongAfterWithdrawal(board, 1, 100) + storms.wrongAfterWithdrawal(board, 2, 100)),
    stored_lost_after_stall: onEach((board) => storms.lostAfterStall(board, 16)),
    prom_collisions_planted: collisions.planted,
    prom_collisions_wrong: collisions.wrong,
    prom_collisions_undoubted: collisions.undoubted,
    prom_collisions_innocent: collisions.innocent_doubted,
    ms5837_figures: 16 * example.rows.length,
    ms5837_wrong: example.wrong,
  }),
);
