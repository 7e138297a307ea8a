/* Recordings: what a fingertip said, as a CSV file that people, pandas and numpy read as it is; or,
 * where its name ends with .mcap, the same lines as ROS 2 messages (mcap_recording.hpp).
 *
 *   # fingertip-recording 1
 *   # key: value
 *   t_us,frame,sequence,flags,...,total_us,qx_N,...,vy_mm_s,raw_sequence,...,s0_Pa,...,tare0_Pa,...
 *   (rows and comments)
 *   # end: reason=... frames=... seconds=... packets=... dropped_packets=... crc_errors=... ...
 *
 * Keys: those of the info packet (serial, board, scene, firmware, git, sensors, rate_mHz, osr, ...,
 * x_mm and y_mm of the sensors), of a calibrated fingertip (stored, bit 0) also date, force scale,
 * gains, ...; of one that knows its pad pad_thickness_mm, ...; and the recorder's own (recorded_by,
 * started_utc, port, ...).
 *
 * Recordings of before there was a tangential load have no columns from qx_N to vy_mm_s; a reader
 * takes them.
 *
 * A row is a frame: a contact and a raw packet. Cells of a packet that did not come are empty, and
 * so are those of a quantity whose flag is off (contact_flags.h): no fit, no x.
 *
 * Between the rows:
 *   # packet: NAME key=value ...   every other packet, where it came; before an info packet those
 * of its fields that are new, as "# key: value" # event: text                  "gone" and "back" of
 * the port among others
 *
 * The end line has the totals over all runs of a device that restarted: rows, device time, and what
 * the recorder counted on the line. It is absent if the recorder was killed or the disk was full.
 *
 * Times are device time in us, pressures Pa with four decimals (exact: the wire carries 1/1024 Pa),
 * floats the shortest text that reads back the same. So nothing of the packets is lost. Pressures
 * are as measured, whatever the calibration: reading - tare, over gain, is what the fit got.
 *
 * Several fingertips on one clock are a recording of format 2:
 *
 *   # fingertip-recording 2
 *   # devices: SERIAL SERIAL...    numbered from 0
 *   # host_zero_us: N              time_us 0 on the recorder's steady clock (CLOCK_MONOTONIC)
 *   # 0/key: value                 every comment of format 1, the number of its fingertip before it
 *   device,time_us,t_us,frame,...  the number; the recorder's clock; then the columns of format 1
 *   # 0/clock: t_us=... time_us=... drift_ppm=... uncertainty_us=...
 *   # 0/end: frames=... jumps=... drift_ppm=... uncertainty_us=... packets=... ...
 *   # end: reason=... frames=... seconds=... alignment_us=... packets=... ...
 *
 * clock, once a second: the device time t_us is time_us on the recorder's clock, surely within the
 * uncertainty; a positive drift is a fast fingertip. alignment_us: no two rows of different
 * fingertips were ever further from their true distance in time.
 *
 * Between the rows the recorder may have lines of its own, "# key: value", whose keys no reader has
 * to know; those of a grasp are in grasp/grip_row.hpp.
 *
 * What one fingertip said stands in the order in which it said it, so that its sequence numbers
 * tell what was lost. Rows of different fingertips are in order of time_us, unless one came more
 * than a quarter of a second late; and where a fingertip's clock turns out to be another than
 * thought, its time_us may step back, its t_us never does.
 *
 * Lines end with \n (a reader takes \r\n too) and are written whole, one at a time: a killed
 * recorder loses at most the line under way.
 */
#pragma once

#include "libfingertip/joint_recording_writer.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/recording_reader.hpp"
#include "libfingertip/recording_writer.hpp"
