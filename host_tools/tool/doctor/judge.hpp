/* What the facts about a fingertip mean. Pure: the same facts, the same findings. */
#pragma once

#include "libfingertip/decoder.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/wire.hpp"
#include "tool/doctor/baseline.hpp"
#include "tool/doctor/crash.hpp"
#include "tool/doctor/system.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

struct Failure {
  ErrorCode code;
  std::string text;
};

struct Facts {
  std::array<unsigned, 3> tool_version{};
  bool knows_computer = true; /* false: a web page asks, so nothing is known of rule and holders */
  std::string rule;           /* path of a file; empty: none */
  bool is_plugged_in = true;  /* false: a pseudo-terminal, as simulated ones have, which udev knows nothing of */
  std::string port;           /* as it is opened; empty: none was found */
  bool is_shared = false;     /* the one that has it open serves it to others */
  Holders holders{{}, true};
  std::optional<Failure> failure; /* what ended the examination */
  std::optional<wire_info> info;
  std::optional<wire_health> before, after; /* the measurement */
  std::optional<Crash> crash;               /* the last since power-on */
  std::optional<Baseline> baseline;
  LineStatistics line; /* in the measurement */
};

enum class Verdict { ok, warn, bad };

struct Finding {
  Verdict verdict;
  std::string check; /* "rule", "port", ... */
  std::string text;
  std::string advice;            /* what to do; empty where all is well */
  std::vector<unsigned> sensors; /* those that are meant; empty: all, or none in particular */
};

/* One finding for each check that the facts allow; for sensors one for each that is not well. */
std::vector<Finding> judge(const Facts &facts);

Verdict worst_of(const std::vector<Finding> &findings);

/* "ok", "warn", "bad" */
std::string verdict_text(Verdict verdict);

/* Frames a second that a fingertip with these settings makes; nothing where its board is unknown. */
std::optional<double> expected_rate_Hz(const wire_info &info);

/* The data sheet's, of one reading at this oversampling, rms; nothing for none of the sensor's. */
std::optional<double> expected_noise_Pa(unsigned osr);

} // namespace fingertip
