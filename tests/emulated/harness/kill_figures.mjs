/**
 * Core 1 of scene grasp killed at many instants of a frame, as figures for the report: prints one JSON object.
 *
 * usage: kill_figures.mjs FOLDER_OF_IMAGE FINGERTIP COMMAND_FRAME KILLS HOURS    hours: of a soak in which it is killed now and then
 */
import { killedAt, soaked } from './second_core.mjs';

const [folder, fingertip, command_frame, count, hours] = process.argv.slice(2);
const { kills, reboots, lost } = killedAt(folder, { fingertip, command_frame }, Number(count));
const soak = soaked(folder, { fingertip, command_frame }, Number(hours));
const number = (what) => kills.filter(what).length;
process.stdout.write(
  JSON.stringify({
    core1_killed: kills.length,
    core1_hangs: number((kill) => !kill.estimates_again) + reboots,
    core1_frames_lost: lost,
    core1_unflagged: number((kill) => kill.late === 0 || kill.both > 0),
    core1_late_frames_max: Math.max(...kills.map((kill) => kill.late)),
    core1_frames_without_load_max: Math.max(...kills.map((kill) => kill.without_load)),
    core1_soak_hours: Number(hours),
    core1_soak_kills: soak.kills,
    core1_soak_frames: soak.frames,
    core1_soak_lost: soak.lost,
    core1_soak_hangs: soak.reboots + soak.long_without_load,
  }) + '\n',
);
