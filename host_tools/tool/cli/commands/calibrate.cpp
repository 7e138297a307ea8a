/* fingertip calibrate: gains of the sensors, and the scale of the force, from placements of one weight, or the scale of
 * the tangential force from pulls of one, live or in a recording, and into the fingertip. */
#include "libfingertip/clock.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/profile.hpp"
#include "tool/calibration/from_recording.hpp"
#include "tool/calibration/judge.hpp"
#include "tool/calibration/pulls.hpp"
#include "tool/cli/calibrate_view.hpp"
#include "tool/cli/canvas.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/installed_files.hpp"
#include "tool/cli/names_of_values.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <memory>
#include <poll.h>
#include <string>
#include <unistd.h>

namespace fingertip {

namespace {

using calibrating::check_pad;
using calibrating::GainSession;
using calibrating::Judgement;
using calibrating::Placement;
using calibrating::PullFinder;
using calibrating::PullJudgement;
using calibrating::PullSession;

constexpr std::chrono::milliseconds DEVICE_POLL{20};
constexpr std::int64_t PATIENCE_us = 5000000;        /* without a frame */
constexpr std::chrono::milliseconds ASKED_STOP{100}; /* between two checks for a stop */

struct CalibrateOptions {
  Choice choice;
  std::optional<double> force_N; /* of the weight, where it is known; pulls must have it */
  bool drag = false;             /* pulls along the rubber instead of placements */
  std::string from;              /* a recording; empty: live */
  std::string pad;               /* of what measured the columns of a table; empty: a recording */
  bool dry_run = false;          /* of a recording, write nothing */
  bool yes = false;              /* ask nothing */
  bool show = false, erase = false;
  ColourMode colour = ColourMode::automatic;
};

/* Throws Error with `otherwise` unless the answer is yes; Interrupted. */
void confirm(const CalibrateOptions &options, const std::string &question, const std::string &otherwise) {
  if (options.yes) {
    return;
  }
  if (!isatty(STDIN_FILENO)) {
    throw Error(otherwise + "; give --yes without a terminal");
  }
  std::printf("\n%s [y/N] ", question.c_str());
  std::fflush(stdout);
  char line[64] = "";
  pollfd waiting = {STDIN_FILENO, POLLIN, 0};
  while (wait_for(&waiting, 1, host_now() + ASKED_STOP) <= 0) {
    if (stop_requested()) {
      throw Interrupted();
    }
  }
  if (!std::fgets(line, sizeof line, stdin) || (line[0] != 'y' && line[0] != 'Y')) {
    throw Error(otherwise);
  }
}

/* The fingertip that is calibrated. */
class CalibratedDevice {
public:
  explicit CalibratedDevice(const CalibrateOptions &options)
      : transport_(open_endpoint(choose_endpoint(options.choice))), session_(*transport_, [this] { return !ending_ && stop_requested(); }),
        info_(session_.info().body.info) {}
  ~CalibratedDevice() {
    if (streaming_) {
      session_.send(command_stream(0));
    }
  }

  /* Throws Error where a sensor does not answer. */
  void check_sensors() {
    const sensor_map missing = missing_sensors(session_.health().body.health.sensors_present, info_.sensor_count);
    if (missing) {
      throw Error(name() + ": sensors do not answer: " + sensors_text(missing) +
                  "; mend their wiring first, a calibration is of all of them");
    }
  }

  /* Throws Error where a recording is of another fingertip. */
  void check_is(const wire_info &recorded, const std::string &recording) const {
    if (std::strncmp(recorded.serial, info_.serial, WIRE_TEXT_BYTES) != 0) {
      throw Error(printable(recording) + ": is of fingertip " + text_field(recorded.serial) + ", and this is " + text_field(info_.serial) +
                  "; calibrate each by its own");
    }
  }

  /* Streams, with a packet of this type for each frame, until goes_on() is false. Throws Error where no frames come, Interrupted. */
  void follow(std::uint8_t streams, std::uint8_t of_frames, const std::function<void(const wire_packet &)> &take,
              const std::function<bool()> &goes_on) {
    std::int64_t last_frame_us = steady_now_us();
    session_.on_packet([&](const wire_packet &packet) {
      if (packet.type == of_frames) {
        last_frame_us = steady_now_us();
        take(packet);
      }
    });
    session_.command(command_stream(streams));
    streaming_ = true;
    while (goes_on()) {
      if (stop_requested()) {
        throw Interrupted();
      }
      if (session_.poll(DEVICE_POLL) == Transport::Result::gone) {
        throw Error(name() + ": vanished; nothing was written, plug it in and try again");
      }
      if (steady_now_us() - last_frame_us > PATIENCE_us) {
        throw Error(name() + ": sends no frames; see that its sensors answer (fingertip info)");
      }
    }
    session_.on_packet({});
    streaming_ = false;
    session_.command(command_stream(0));
  }

  /* What is begun is done whole, whatever signals come. Throws Error where it was not kept. */
  void write(const calibration &made) {
    send(command_calibrate(made, info_.sensor_count));
    if (!(info_.stored & WIRE_STORED_CALIBRATION) || info_.calibration.date_s != made.date_s) {
      throw Error(name() + ": did not keep the calibration; see fingertip info");
    }
  }
  void write(const pad_profile &pad) {
    send(command_pad(pad));
    if (!(info_.stored & WIRE_STORED_PAD) || info_.pad.tangential_scale != pad.tangential_scale) {
      throw Error(name() + ": did not keep the pad's profile; see fingertip info");
    }
  }
  void erase() { send(command_erase_calibration()); }

  const wire_info &info() const { return info_; }
  std::string name() const { return transport_->description(); }

private:
  void send(const wire_packet &command) {
    ending_ = true;
    session_.command(command);
    info_ = session_.info().body.info;
  }

  std::unique_ptr<Transport> transport_;
  bool ending_ = false;
  Session session_;
  wire_info info_;
  bool streaming_ = false;
};

void print_result(const GainSession &work, const calibration &made, std::optional<double> force_N) {
  const Judgement &judgement = work.judgement();
  const calibrating::Scatter before = work.scatter(false), after = work.scatter(true);
  std::printf("%s, from %zu of %zu placements\n", judgement.text.c_str(), judgement.solution.kept, work.placements().size());
  print_gains(made, static_cast<std::uint8_t>(work.array().sensors()), judgement.solution.misfit_share);
  std::printf("\nof the placements      before     after\n");
  std::printf("location off by     %6.2f mm %6.2f mm   median\n", before.location_mm, after.location_mm);
  std::printf("force differs by    %6.1f %%  %6.1f %%    median\n", 100.0 * before.force, 100.0 * after.force);
  if (force_N) {
    std::printf("force scale         %9s %9s    sd %s\n", "1.000", number(made.force_scale, 3).c_str(),
                number(made.force_scale_sd, 3).c_str());
  } else {
    std::printf("force scale         unknown: give the weight, to calibrate forces too\n");
  }
  std::printf("%s\n", shape_text(made).c_str());
  if (const auto found = pad::thickness_of(made)) {
    std::printf("rubber %s\n", text_of(*found).c_str());
  }
  std::fflush(stdout);
}

void work_live(CalibratedDevice &device, GainSession &work, ColourMode colour) {
  CalibrateView view(colour);
  const auto take = [&](const wire_packet &packet) {
    if (work.judgement().state == Judgement::State::more && work.take(packet)) {
      work.judge(false);
      view.update(work, true);
    }
  };
  device.follow(WIRE_STREAM_RAW, WIRE_RAW, take, [&] {
    view.update(work, false);
    while (auto key = view.key()) {
      if (*key == 'q') {
        throw Interrupted();
      } else if (*key == 'u') {
        work.take_back();
      }
    }
    return work.judgement().state == Judgement::State::more;
  });
}

/* What a calibration is of: a session, live or of a recording, that is good, and the fingertip, unless it is only shown. */
template <typename Session> struct Work {
  std::optional<CalibratedDevice> device;
  std::optional<Session> session;
  wire_info info{}; /* of the session */

  /* live: leads the session that make makes. from: of a recording. Throws Error. */
  template <typename Check, typename Make, typename Live, typename From>
  Work(const CalibrateOptions &options, const Check &check, const Make &make, const Live &live, const From &from) {
    if (options.from.empty()) {
      device.emplace(options);
      info = device->info();
      check(info, device->name());
      device->check_sensors();
      session.emplace(make(info));
      live(*device, *session);
    } else {
      calibrating::Recorded<Session> recorded = from();
      info = recorded.info;
      session.emplace(std::move(recorded.session));
    }
    calibrating::refuse_unless_good(session->judgement());
    if (!device && !options.dry_run) {
      device.emplace(options);
      device->check_is(info, options.from);
    }
  }
};

void show(const CalibrateOptions &options) {
  CalibratedDevice device(options);
  const wire_info &info = device.info();
  if (!(info.stored & WIRE_STORED_CALIBRATION)) {
    std::printf("not calibrated%s\n", info.stored & WIRE_STORED_DAMAGED ? "; what was stored cannot be read" : "");
    return;
  }
  std::printf("calibrated %s from %u placements, force scale %s sd %s\n", date_text(info.calibration.date_s).c_str(),
              info.calibration.placements, number(info.calibration.force_scale, 3).c_str(),
              number(info.calibration.force_scale_sd, 3).c_str());
  std::printf("%s\n", shape_text(info.calibration).c_str());
  print_gains(info.calibration, info.sensor_count);
}

// The coefficients of the pad's ends are of a calibration, or of none.
void advise_ends(const wire_info &info, const std::string &thickness) {
  if ((info.stored & WIRE_STORED_PAD) && info.pad.overhang_mm > 0) {
    std::printf("where the rubber ends, once more: fingertip pad%s --overhang %s\n", thickness.c_str(),
                shortest(info.pad.overhang_mm).c_str());
  }
}

void erase(const CalibrateOptions &options) {
  CalibratedDevice device(options);
  if (!(device.info().stored & (WIRE_STORED_CALIBRATION | WIRE_STORED_DAMAGED))) {
    std::printf("not calibrated\n");
    return;
  }
  confirm(options, "Forget the calibration of " + text_field(device.info().serial) + "?", "not erased");
  device.erase();
  std::printf("erased: it is as if never calibrated\n");
  advise_ends(device.info(), " --thickness " + shortest(device.info().pad.thickness_mm));
}

template <typename Made> void write(const CalibrateOptions &options, CalibratedDevice &device, const Made &made) {
  confirm(options, "Write this into " + text_field(device.info().serial) + "?", "not written");
  device.write(made);
}

/* A fingertip that estimates tangential force needs the thickness. If the user has set one, this
 * reports whether it is the one found. Otherwise the pad's profile follows from the one found. */
void use_thickness(CalibratedDevice &device, const calibration &made, const std::optional<pad::Thickness> &for_profile) {
  const wire_info &info = device.info();
  const auto found = pad::thickness_of(made);
  if (for_profile) {
    device.write(pad::profile_of({for_profile->shown_mm()}, info));
    std::printf("profile of a pad without end of %s mm: fingertip pad --overhang MM where the rubber ends\n",
                fixed(for_profile->mm, 1).c_str());
  } else if ((info.capabilities & WIRE_CAPABILITY_TANGENTIAL) && (info.stored & WIRE_STORED_PAD) && found) {
    const std::string other = pad::disagreement(*found, static_cast<double>(info.pad.thickness_mm));
    if (!other.empty()) {
      std::fprintf(stderr, "fingertip: %s; fingertip pad takes the one that was found\n", other.c_str());
    }
    advise_ends(info, "");
  }
}

void calibrate(const CalibrateOptions &options) {
  Work<GainSession> work(
      options, calibrating::check_firmware, [](const wire_info &info) { return GainSession(info); },
      [&](CalibratedDevice &device, GainSession &session) { work_live(device, session, options.colour); },
      [&] {
        return calibrating::gain_session_from(options.from, options.choice.device, [](const GainSession &session, double t_s) {
          const Placement &found = session.placements().back();
          std::printf("placement %zu, %.1f s: strongest reading %.1f kPa\n", session.placements().size(), t_s,
                      1e-3 * *std::max_element(found.reading_Pa.begin(), found.reading_Pa.end()));
        });
      });
  const wire_info &info = work.device ? work.device->info() : work.info;
  const auto date_s = static_cast<std::uint32_t>(std::chrono::system_clock::to_time_t(wall_now()));
  calibration made = work.session->made(options.force_N, date_s);
  const auto for_profile = pad::thickness_for_profile(info, made);
  if (for_profile || (info.stored & WIRE_STORED_PAD)) {
    work.session->expect_profile();
    made = work.session->made(options.force_N, date_s);
  }
  print_result(*work.session, made, options.force_N);
  if (work.device) {
    write(options, *work.device, made);
    use_thickness(*work.device, made, for_profile);
    std::printf("calibrated: it applies from now on\n");
  }
}

void pull_live(CalibratedDevice &device, PullSession &work) {
  std::string printed;
  const auto print_advice = [&] {
    if (work.advice() != printed) {
      printed = work.advice();
      std::printf("%s\n", printed.c_str());
      std::fflush(stdout);
    }
  };
  const auto take = [&](const wire_packet &packet) {
    if (work.judgement().state == PullJudgement::State::more && work.take(packet)) {
      work.judge(false);
      std::printf("%s; %s\n", work.last_pull_text().c_str(), work.judgement().text.c_str());
    }
    print_advice();
  };
  print_advice();
  device.follow(WIRE_STREAM_CONTACT, WIRE_CONTACT, take, [&] { return work.judgement().state == PullJudgement::State::more; });
}

calibrating::Recorded<PullSession> pull_session_from(const CalibrateOptions &options) {
  std::string weak;
  bool was_ready = false; /* somewhere a pull could have been read */
  auto recorded = calibrating::session_from(
      options.from, options.choice.device,
      [&](const wire_info &info) {
        check_pad(info, printable(options.from));
        return PullSession(info, *options.force_N);
      },
      [&](const PullSession &session, const wire_packet &, bool taken) {
        if (taken) {
          std::printf("%s\n", session.last_pull_text().c_str());
        }
        weak = session.finder().refusal() == PullFinder::Refusal::weak ? session.weak_text() : weak;
        was_ready = was_ready || session.finder().state() == PullFinder::State::resting;
      });
  if (!recorded) {
    throw Error(printable(options.from) + ": holds no frames");
  }
  if (recorded->session.pulls().empty()) {
    throw Error("not calibrated: " +
                (weak.empty() || was_ready ? "no pull was found; leave the object alone for a second, then pull and hold for two" : weak));
  }
  return std::move(*recorded);
}

void check_same_pad(const pad_profile &recorded, const pad_profile &stored, const std::string &recording) {
  if (stored.thickness_mm != recorded.thickness_mm || stored.overhang_mm != recorded.overhang_mm ||
      stored.from_touch != recorded.from_touch) {
    throw Error(printable(recording) + ": is of a pad of " + shortest(recorded.thickness_mm) +
                " mm, and this fingertip's profile has changed since; record again");
  }
}

void print_result(const PullSession &work, const pad_profile &before, const pad_profile &after, bool has_force_scale) {
  std::printf("%s, from %zu of %zu pulls\n", work.judgement().text.c_str(), work.judgement().kept, work.pulls().size());
  std::printf("tangential scale    %s sd %s before, %s sd %s now\n", number(before.tangential_scale, 3).c_str(),
              number(before.tangential_scale_sd, 3).c_str(), number(after.tangential_scale, 3).c_str(),
              number(after.tangential_scale_sd, 3).c_str());
  if (!has_force_scale) {
    std::printf("the force's scale is not calibrated, of which this is a multiple: once it is, do this again\n");
  }
  std::fflush(stdout);
}

void calibrate_drag(const CalibrateOptions &options) {
  Work<PullSession> work(
      options, check_pad, [&](const wire_info &info) { return PullSession(info, *options.force_N); }, pull_live,
      [&] { return pull_session_from(options); });
  if (work.device && !options.from.empty()) {
    check_pad(work.device->info(), work.device->name());
    check_same_pad(work.info.pad, work.device->info().pad, options.from);
  }
  const pad_profile made = work.session->scaled(work.device ? work.device->info().pad : work.info.pad);
  print_result(*work.session, work.info.pad, made, work.info.stored & WIRE_STORED_CALIBRATION);
  if (work.device) {
    write(options, *work.device, made);
    std::printf("calibrated: it applies from now on\n");
  }
}

int run_calibrate(const CalibrateOptions &options) {
  const auto chosen = options.show ? show : options.erase ? erase : options.drag ? calibrate_drag : calibrate;
  try {
    chosen(options);
  } catch (const Interrupted &) {
    throw Error("interrupted; the fingertip is as it was");
  }
  return 0;
}

/* Of pressures in the columns of a table. more: options of fingertip fit. */
[[noreturn]] void calibrate_pad(const CalibrateOptions &options, std::vector<std::string> more) {
  more.insert(more.begin(), {options.from, "--pad", options.pad, "--calibrate", "--device", options.choice.device});
  if (options.force_N) {
    more.insert(more.end(), {"--weight", std::to_string(*options.force_N / calibrating::GRAVITY_N_PER_g)});
  }
  run_in_package("fit", std::move(more));
}

CLI::Option *with_weight(CLI::App *command, const std::string &option, double unit_N, std::optional<double> &force_N,
                         const std::string &help) {
  const double lightest = 0.1 / unit_N, heaviest = 50 / unit_N;
  return with_number(
      command, option, lightest, heaviest, fixed(lightest, 1) + " to " + fixed(heaviest, 0),
      [&force_N, unit_N](double weight) { force_N = weight * unit_N; }, help);
}

} // namespace

void add_calibrate(CommandLine &line) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App *command = line.add("calibrate", "Find the sensors' gains by setting down one weight at some twenty places", [options] {
    if (options->dry_run && options->from.empty()) {
      throw WrongUsage("--dry-run goes with --from; without, it asks before it writes");
    }
    if (options->drag && !options->force_N) {
      throw WrongUsage("--drag needs the pull: --weight GRAMS on the string, or --force N");
    }
    return run_calibrate(*options);
  });
  command->parse_complete_callback([options, command] {
    if (!options->pad.empty()) {
      calibrate_pad(*options, command->remaining());
    }
  });
  command->footer("Examples: fingertip calibrate --weight 200\n"
                  "          fingertip calibrate --from theirs.csv --pad 2x4 -o gains.json");
  with_port(command, options->choice);
  CLI::Option *weight =
      with_weight(command, "--weight", calibrating::GRAVITY_N_PER_g, options->force_N, "Mass of the weight: then forces are calibrated too")
          ->type_name("GRAMS");
  CLI::Option *force = with_weight(command, "--force", 1.0, options->force_N, "The same in newtons")->excludes(weight)->type_name("N");
  CLI::Option *drag = command->add_flag("--drag", options->drag,
                                        "Find the tangential force's scale: the weight hangs on a string that pulls an "
                                        "object level along the pad, several times in each direction");
  CLI::Option *from =
      with_value(command, "FILE.csv", "--from", options->from, "Use the placements of a recording with pressures, not live ones");
  CLI::Option *dry_run = command->add_flag("--dry-run", options->dry_run, "With --from: only show");
  CLI::Option *yes = command->add_flag("--yes", options->yes, "Write, or erase, without asking");
  with_value(command, "NAME|FILE.json", "--pad", options->pad,
             "With --from: its columns are pressures of this array. Takes the other options of fingertip fit, and writes what its "
             "--calibration takes")
      ->needs(from)
      ->excludes(drag, dry_run, yes, command->get_option("--port"), command->get_option("--transport"));
  CLI::Option *show =
      command->add_flag("--show", options->show, "Show the fingertip's calibration")->excludes(weight, force, drag, from, dry_run, yes);
  command->add_flag("--erase", options->erase, "Erase its calibration, after a question")
      ->excludes(weight, force, drag, from, dry_run, show);
  with_colour(command, options->colour);
}

} // namespace fingertip
