/**
 * Core 1 of scene grasp killed, as figures for the report: prints one JSON object.
 *
 * usage: kill_figures.mjs FOLDER_OF_IMAGE FINGERTIP COMMAND_FRAME kills COUNT        at so many instants of a frame
 *        kill_figures.mjs FOLDER_OF_IMAGE FINGERTIP COMMAND_FRAME soak HOURS SEED    now and then, for so long
 *        kill_figures.mjs FOLDER_OF_IMAGE FINGERTIP COMMAND_FRAME absent            for good, and at a start
 */
import { killedAt, soaked, withoutCore1 } from './second_core.mjs';

function killed({ kills, reboots, lost }) {
  const number = (what) => kills.filter(what).length;
  return {
    core1_killed: kills.length,
    core1_hangs: number((kill) => !kill.estimates_again) + reboots,
    core1_frames_lost: lost,
    core1_unflagged: number((kill) => kill.late === 0 || kill.both > 0),
    core1_late_frames_max: Math.max(...kills.map((kill) => kill.late)),
    core1_frames_without_load_max: Math.max(...kills.map((kill) => kill.without_load)),
  };
}

const [folder, fingertip, command_frame, kind, amount, seed] = process.argv.slice(2);
const tools = { fingertip, command_frame };
const found = {
  kills: () => killed(killedAt(folder, tools, Number(amount))),
  soak: () => soaked(folder, tools, Number(amount), Number(seed)),
  absent: () => ({ core1_absent_reported: Number(withoutCore1(folder, tools).reported.length === 2) }),
}[kind]();
process.stdout.write(`${JSON.stringify(found)}\n`);
