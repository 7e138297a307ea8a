/* What the firmware reports of a pad's pressures: its stages (firmware/app/stages.h) in this process, without sensors, a bus or a line; as
 * many at a time as memory holds. Each thread has its own. The scene is that of the build. */
#pragma once

#include "common/calibration.h"
#include "common/pad_profile.h"
#include "wire/packet.h"

#ifdef __cplusplus
extern "C" {
#endif

struct native_stages;

/* Both are copied; profile NULL: no tangential force. NULL: no memory. */
struct native_stages *native_stages_new(const struct calibration *calibration, const struct pad_profile *profile);
void native_stages_free(struct native_stages *all);

/* The next frame, t_us later than all before. pressure_Pa_q10: [geometry.sensor_count], absolute, 1/1024 Pa, with its noise of
 * noise_Pa_q10 rms. packet: WIRE_CONTACT, as it would be sent. */
void native_stages_frame(struct native_stages *all, uint64_t t_us, const int32_t *pressure_Pa_q10, int32_t noise_Pa_q10,
                         struct wire_packet *packet);

/* The same of what a fingertip has sent. Its info packet has the layout, the settings, the calibration and the profile. NULL: that cannot
 * be; the packet is not to be trusted. */
struct native_stages *native_stages_of(const struct wire_info *info);
/* A tare command was obeyed. */
void native_stages_tare(struct native_stages *all);
/* Fills in the contact packet to this raw packet; stages are left as they are. held: no new pressures came. */
void native_stages_repeat(struct native_stages *all, const struct wire_packet *raw, bool held, struct wire_contact *contact);

#ifdef __cplusplus
}
#endif
