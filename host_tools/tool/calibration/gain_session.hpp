/* One session of finding the gains: a fingertip's packets in, placements, what to do next, and the
 * calibration in the end. For every program that calibrates. */
#pragma once

#include "libfingertip/wire.hpp"
#include "tool/calibration/judge.hpp"
#include "tool/calibration/placements.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::calibrating {

/* Its sensors; the pitch of a free layout is the distance of the nearest two. Throws Error where they lie nowhere, or far apart. */
Array array_of(const wire_info &info);
/* The frame of a raw packet. */
Frame frame_of(const wire_packet &packet);

/* What a fingertip must be able to do. what: it, for the message. Throws Error. */
void check_firmware(const wire_info &info, const std::string &what);

/* What a fingertip keeps of a solution; scale: none where the weight is not known. Its own ambient pressure is not in it. */
calibration calibration_of(const Solution &solution, const std::optional<ForceScale> &scale, std::uint32_t date_s);

class GainSession {
public:
  explicit GainSession(const wire_info &info);

  /* True if it completed a placement; judge then. Packets but raw ones are nothing to it. */
  bool take(const wire_packet &packet);
  void take_back();
  /* Some 50 ms. */
  void judge(bool last);

  /* "hold on": what to do now. */
  std::string advice() const;
  /* "12 placements, gains known to 3.1 % of 1.5 %" */
  std::string progress() const;

  /* A pad's profile will act beside the calibration, though the info packet had none. The fit then
   * assumes no width of a contact, and the force's scale is of such a fit. */
  void expect_profile() { has_profile_ = true; }
  /* The calibration for the fingertip; date_s: Unix time. Of a good judgement. Throws Error where
   * the readings are not those of force_N, or a gain is none. */
  calibration made(std::optional<double> force_N, std::uint32_t date_s) const;
  /* Scatter of the firmware's own fit to the placements, without and with the calibration. */
  Scatter scatter(bool calibrated) const;

  const Array &array() const { return array_; }
  const PlacementFinder &finder() const { return finder_; }
  const std::vector<Placement> &placements() const { return placements_; }
  const Judgement &judgement() const { return judgement_; }       /* of the placements so far */
  const std::optional<Wanted> &wanted() const { return wanted_; } /* the best next place */

private:
  Shape shape() const; /* that will act: found, but for a prior that the user has set */

  Array array_;
  Shape prior_;             /* that the user has set */
  bool has_profile_;        /* a pad profile is in use: no width is assumed */
  double ambient_Pa_ = 0.0; /* the mean zero at the last placement */
  PlacementFinder finder_;
  std::vector<Placement> placements_;
  Judgement judgement_;
  std::optional<Wanted> wanted_;
};

} // namespace fingertip::calibrating
