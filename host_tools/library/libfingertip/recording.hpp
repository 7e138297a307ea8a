/* Writes and reads recordings; RECORDING.md has the formats. */
#pragma once

#include "libfingertip/joint_recording_writer.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/recording_reader.hpp"
#include "libfingertip/recording_writer.hpp"
