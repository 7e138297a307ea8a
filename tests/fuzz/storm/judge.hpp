// What must hold of a fingertip whatever happens to it, judged from its line alone and the truth of what it feels.
//
//   time     device time and frame numbers only rise; no packet is from the future; uptime is the
//            time
//   loss     packets that are missing on the line are those that the sequence numbers, and in the
//            next health packet packets_dropped, say; frames that are missing are frames_skipped;
//            a command that was sent is answered
//   damaged  a packet is whole, but for one cut by the opening of the port
//   answer   an acknowledgement is of a command that was sent, once; stages add up
//   wrong    a frame without a warning tells the truth within the bounds below
//
// A contact of less than a quarter of the strongest in the last minute may go unfelt, for it may be rubber that has not let go yet
// (condition.h). Bounds of what is said of any: the simulated pad is what the fit takes a contact for, its gains are all 1, and a frame
// without a warning says that its location is good to 0.6 mm of standard deviation (UNCERTAIN has that limit): LOCATION_BOUND_mm is twice
// that, FORCE_BOUND what an unwarned corner contact may be off by. READING_BOUND_Pa is what a temperature makes of a reading that is 5 degC
// wrong: so far from the others a sensor's first one may be (readings.h), 245 Pa a degree; beside the noise.
#pragma once

#include "libfingertip/wire.hpp"
#include "world.hpp"

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace storm {

constexpr double LOCATION_BOUND_mm = 1.2;
constexpr double FORCE_BOUND_N = 0.1, FORCE_BOUND_SHARE = 0.15;
constexpr double READING_BOUND_Pa = 1300;
// So many good frames in a row are a recovery.
constexpr unsigned GOOD_FRAMES = 5;

struct Finding {
  std::string kind; // as above
  std::uint64_t t_us;
  std::string text;
};

struct Figures {
  std::uint64_t frames = 0;  // contact packets
  std::uint64_t judged = 0;  // frames and readings that say without a warning what is so
  std::uint64_t missing = 0; // packets
  std::uint64_t skipped = 0; // frames
  std::uint64_t late = 0;    // frames that state that their tangential force was late
  std::uint64_t excused = 0; // wrong frames and readings after what nothing can detect
};

class Judge {
public:
  explicit Judge(const World &world) : world_(world) {}

  // The chip starts: by power, or by a reset. All times are the bench's.
  void begin_life(std::uint64_t t_us);
  // When the device's clock was 0; before the bench began, too.
  void set_clock_zero(double t_us);
  // The host can hear from now on, or hears no more.
  void open(std::uint64_t t_us);
  void close(std::uint64_t t_us);
  void sent(std::uint64_t t_us, const wire_packet &command);
  void received(std::uint64_t t_us, const std::uint8_t *bytes, std::size_t count);
  // Bits of a conversion's result were inverted on the way, which no check can tell: wrong frames are counted apart.
  void excuse_until(std::uint64_t t_us) { excused_until_us_ = t_us; }
  // The supply of a sensor dipped, which a pad that moves hides until its next temperature
  // (readings.h): wrong readings, not frames, are counted apart.
  void excuse_readings_until(std::uint64_t t_us) { readings_excused_until_us_ = t_us; }

  // A location may be off by so many of its own standard deviations, besides the bound: of millions
  // of frames the noise takes some further than two.
  void allow_standard_deviations(double count) { allowed_sds_ = count; }

  // Counts good frames again.
  void expect_recovery() { good_in_a_row_ = 0; }
  bool has_recovered() const { return good_in_a_row_ >= GOOD_FRAMES; }
  std::uint64_t last_frame_us() const { return last_frame_heard_us_; }

  // What happens meanwhile: part of each finding.
  void set_scene(const std::string &scene) { scene_ = scene; }
  void find(const std::string &kind, std::uint64_t t_us, const std::string &text);
  const std::vector<Finding> &findings() const { return findings_; }
  const Figures &figures() const { return figures_; }

private:
  struct Question {
    std::uint8_t type;
    std::uint64_t t_us, host_time_us;
  };
  struct Counted { // since the last health packet of this session
    wire_health health;
    std::uint64_t received = 0, missing = 0; // packets, that one included
    std::uint64_t contacts = 0, skipped = 0; // frames
    bool follows = false;                    // contact packets came before it
    std::int64_t contacts_over = 0, skipped_over = 0;
  };

  void packet(std::uint64_t t_us, const wire_packet &packet);
  void count_sequence(std::uint64_t t_us, const wire_packet &packet);
  void check_clock(std::uint64_t t_us, const wire_packet &packet);
  // Pressed by more than what the gate may take for a zero that has moved.
  bool is_firm(std::uint64_t t_us) const;
  void judge_contact(std::uint64_t t_us, const wire_packet &packet);
  void judge_raw(std::uint64_t t_us, const wire_packet &packet);
  void judge_health(std::uint64_t t_us, const wire_packet &packet);
  void judge_ack(std::uint64_t t_us, const wire_packet &packet);
  void wrong(std::uint64_t t_us, const std::string &text);
  std::uint64_t bench_us(std::uint64_t device_us) const;

  const World &world_;
  Figures figures_;
  std::string scene_;
  std::vector<Finding> findings_;

  // Of a life
  double zero_us_ = 0, began_us_ = 0;                    // began_us_: what the clock showed at first
  std::uint64_t last_answer_us_ = 0, last_frame_us_ = 0; // device time
  std::optional<std::uint32_t> contact_frame_, raw_frame_;
  std::uint64_t raw_us_ = 0;
  std::optional<wire_health> health_of_life_;
  // Of a session
  bool open_ = false;
  bool joining_ = false;
  wire_receiver receiver_{};
  std::optional<std::uint16_t> sequence_;
  std::uint64_t session_missing_ = 0;
  bool contact_follows_ = false; // since the last contact packet none is missing
  std::optional<Counted> counted_;
  std::map<std::uint16_t, Question> asked_;

  double allowed_sds_ = 0;
  std::uint64_t excused_until_us_ = 0, readings_excused_until_us_ = 0;
  unsigned good_in_a_row_ = 0;
  std::uint64_t last_frame_heard_us_ = 0;
};

} // namespace storm
