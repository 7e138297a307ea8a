#include "simulation/twin/scenario_file.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/text.hpp"
#include "simulation/twin/best_gaussian.hpp"
#include "simulation/twin/traction_table.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

namespace fingertip::twin {
namespace {

constexpr double STEP_s = 1e-3;
constexpr double QUIET_STEP_s = 0.1;

class Text {
public:
  Text &operator<<(std::string_view text) {
    bytes_ += text;
    return *this;
  }
  void number(double value, int digits) {
    char buffer[64];
    char *end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, digits).ptr;
    // No "-0.00".
    const bool zero = std::all_of(buffer, end, [](char c) { return c == '-' || c == '0' || c == '.'; });
    const std::string_view text(buffer, static_cast<std::size_t>(end - buffer));
    bytes_ += zero && text[0] == '-' ? text.substr(1) : text;
  }
  void cell(double value, int digits) {
    bytes_ += ',';
    number(value, digits);
  }
  const std::string &bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

private:
  std::string bytes_;
};

struct Row {
  double t_s = 0.0;
  bool contact = false, slip = false;
  double x_mm = 0.0, y_mm = 0.0, force_N = 0.0, p0_Pa = 0.0, sigma_mm = 0.0;
  double pull_x_N = 0.0, pull_y_N = 0.0;
  double temperature_degC = ROOM_degC;
  std::vector<double> sensors_Pa;
};

// Leaves out rows that lie on the line through their neighbours.
class RowWriter {
public:
  RowWriter(OutputFile &file, bool pulls, bool temperature) : file_(file), pulls_(pulls), temperature_(temperature) {}

  void add(const Row &row) {
    if (!anchor_) {
      write(row);
      return;
    }
    if (row.contact != last_.contact || row.slip != last_.slip) {
      if (pending_) {
        write(last_);
      }
      write(row);
      return;
    }
    if (pending_ && !on_the_line(row)) {
      write(last_);
    }
    narrow(row);
    last_ = row;
    pending_ = true;
  }

  void finish() {
    if (pending_) {
      write(last_);
    }
    flush();
  }

  std::size_t rows() const { return rows_; }
  std::size_t bytes() const { return bytes_; }

private:
  struct Channel {
    double value, tolerance;
    double lowest, highest; // slope from the anchor that keeps all rows since within tolerance
  };

  std::vector<std::pair<double, double>> values_of(const Row &row) const {
    double peak_Pa = 0.0;
    for (double sensor_Pa : row.sensors_Pa) {
      peak_Pa = std::max(peak_Pa, std::abs(sensor_Pa));
    }
    std::vector<std::pair<double, double>> values{
        {row.x_mm, 2e-3},
        {row.y_mm, 2e-3},
        {row.force_N, 1e-4 + 1e-4 * row.force_N},
        {row.p0_Pa, 0.2 + 1e-4 * row.p0_Pa},
        {row.sigma_mm, 1e-3},
        {row.pull_x_N, 1e-4 + 1e-4 * row.force_N},
        {row.pull_y_N, 1e-4 + 1e-4 * row.force_N},
        {row.temperature_degC, 2e-3},
    };
    for (double sensor_Pa : row.sensors_Pa) {
      values.emplace_back(sensor_Pa, 0.2 + 1e-4 * peak_Pa);
    }
    return values;
  }

  bool on_the_line(const Row &row) const {
    const auto values = values_of(row);
    const double step_s = row.t_s - anchor_s_;
    for (std::size_t i = 0; i < values.size(); i++) {
      const double slope = (values[i].first - channels_[i].value) / step_s;
      if (slope < channels_[i].lowest || slope > channels_[i].highest) {
        return false;
      }
    }
    return true;
  }

  void narrow(const Row &row) {
    const auto values = values_of(row);
    const double step_s = row.t_s - anchor_s_;
    for (std::size_t i = 0; i < values.size(); i++) {
      Channel &channel = channels_[i];
      const double change = values[i].first - channel.value;
      channel.lowest = std::max(channel.lowest, (change - values[i].second) / step_s);
      channel.highest = std::min(channel.highest, (change + values[i].second) / step_s);
    }
  }

  void write(const Row &row) {
    text_.number(row.t_s, 3);
    text_ << (row.contact ? ",1" : ",0");
    text_.cell(row.x_mm, 4);
    text_.cell(row.y_mm, 4);
    text_.cell(row.force_N, 5);
    text_.cell(row.p0_Pa, 1);
    text_.cell(row.sigma_mm, 3);
    text_ << (row.slip ? ",1" : ",0");
    for (double sensor_Pa : row.sensors_Pa) {
      text_.cell(sensor_Pa, 2);
    }
    if (pulls_) {
      text_.cell(row.pull_x_N, 5);
      text_.cell(row.pull_y_N, 5);
    }
    if (temperature_) {
      text_.cell(row.temperature_degC, 3);
    }
    text_ << "\n";
    rows_++;
    if (text_.bytes().size() > 1 << 20) {
      flush();
    }
    channels_.clear();
    for (const auto &[value, tolerance] : values_of(row)) {
      channels_.push_back({value, tolerance, -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()});
    }
    anchor_ = true;
    anchor_s_ = row.t_s;
    pending_ = false;
    last_ = row;
  }

  void flush() {
    file_.append(text_.bytes().data(), text_.bytes().size());
    bytes_ += text_.bytes().size();
    text_.clear();
  }

  OutputFile &file_;
  bool pulls_, temperature_;
  Text text_;
  std::vector<Channel> channels_;
  bool anchor_ = false, pending_ = false;
  double anchor_s_ = 0.0;
  Row last_;
  std::size_t rows_ = 0, bytes_ = 0;
};

void metadata(Text &text, const std::string &key, const std::string &value) { text << "# " << key << ": " << value << "\n"; }

std::string number(double value) { return shortest(static_cast<float>(value)); }

std::string list(const std::vector<double> &values, double factor, int digits) {
  return joined(values, " ", [&](double value) { return fixed(factor * value, digits); });
}

std::string file_name(const std::string &path) { return std::filesystem::path(path).filename().string(); }

bool moves_under_load(const std::string &kind) { return kind == "lift" || kind == "drag" || kind == "slide" || kind == "screw"; }

// What is drawn for each sensor of an effect that has a share and a time.
template <typename Own> void describe_own(Text &text, const char *shares, const char *times, const std::vector<Own> &sensors) {
  if (sensors.empty()) {
    return;
  }
  std::vector<double> each, each_s;
  for (const Own &sensor : sensors) {
    each.push_back(sensor.share);
    each_s.push_back(sensor.time_s);
  }
  metadata(text, shares, list(each, 100.0, 3));
  metadata(text, times, list(each_s, 1.0, 3));
}

void describe(Text &text, const Scenario &scenario, const Layer &layer, const Pad &pad, const std::string &path) {
  const ScenarioOptions &options = scenario.options;
  metadata(text, "name", scenario.name);
  metadata(text, "description", scenario_kind(options.kind).description + "; simulated by twin");
  metadata(text, "kind", options.kind);
  metadata(text, "seed", std::to_string(options.seed));
  metadata(text, "pad_seed", std::to_string(*options.pad_seed));
  metadata(text, "ambient_Pa", number(AMBIENT_Pa));
  metadata(text, "temperature_degC", number(pad.temperature_degC(0.0)));
  metadata(text, "sensors", std::to_string(geometry.sensor_count));
  metadata(text, "indenter", options.indenter + ", " + indenter(options.indenter).description);
  metadata(text, "layer_mm", number(layer.thickness_mm));
  if (options.overhang_mm) {
    metadata(text, "overhang_mm", number(*options.overhang_mm));
  }
  metadata(text, "layer_youngs_modulus_MPa", fixed(1e-6 * layer.youngs_modulus_Pa, 4));
  metadata(text, "layer_poisson", number(layer.poisson));
  metadata(text, "force_N", options.forces);
  metadata(text, "margin_mm", number(*options.margin_mm));
  metadata(text, "quiet_s", number(options.quiet_s));
  if (scenario.pulls) {
    metadata(text, "tangential", options.tangential);
    metadata(text, "friction", options.friction);
  }
  if (moves_under_load(options.kind) || options.kind == "slip") {
    metadata(text, "dead_travel_mm", number(options.dead_travel_mm));
  }
  if (options.kind == "slide") {
    metadata(text, "kinetic_share", number(options.kinetic_share));
    metadata(text, "mass_kg", options.mass_kg);
  }
  if (options.kind == "slip") {
    metadata(text, "creep_share", number(options.creep_share));
    metadata(text, "stick_slip_mm", number(options.stick_slip_mm));
  }
  for (const Effect &effect : effects()) {
    const auto chosen = options.effects.find(effect.name);
    if (chosen != options.effects.end()) {
      metadata(text, "effect_" + effect.name, number(chosen->second) + " " + effect.unit + "; " + effect.source);
    }
  }
  if (options.effects.count("places") + options.effects.count("widths") > 0) {
    std::vector<double> dx_mm, dy_mm, widths;
    for (const Pad::Seat &seat : pad.seats()) {
      dx_mm.push_back(seat.dx_mm);
      dy_mm.push_back(seat.dy_mm);
      widths.push_back(seat.width);
    }
    metadata(text, "places_dx_mm", list(dx_mm, 1.0, 3));
    metadata(text, "places_dy_mm", list(dy_mm, 1.0, 3));
    metadata(text, "widths", list(widths, 1.0, 4));
  }
  if (!pad.gain_errors().empty()) {
    metadata(text, "gain_errors_percent", list(pad.gain_errors(), 100.0, 3));
  }
  if (!pad.drifts_Pa_s().empty()) {
    metadata(text, "drifts_Pa_s", list(pad.drifts_Pa_s(), 1.0, 5));
  }
  describe_own(text, "memories_percent", "memory_times_s", pad.memories());
  describe_own(text, "aftereffects_percent", "aftereffect_times_s", pad.aftereffects());
  if (!pad.branches().empty()) {
    std::vector<double> steps_Pa;
    for (const Pad::Branch &branch : pad.branches()) {
      steps_Pa.push_back(branch.step_Pa);
    }
    metadata(text, "branch_steps_Pa", list(steps_Pa, 1.0, 2));
  }
  metadata(text, "gaussian",
           scenario.options.kind == "two" ? "none: p0_Pa and sigma_mm are 0" : "p0_Pa and sigma_mm: closest to the pressure on the base");
  metadata(text, "truth", file_name(truth_path(path)));
}

std::string truth_of(const Scenario &scenario, const std::string &path) {
  Text text;
  text << "# fingertip-truth 1\n";
  metadata(text, "name", scenario.name);
  metadata(text, "scenario", file_name(path));
  metadata(text, "indenter", scenario.options.indenter);
  text << "act,press,phase,t_begin_s,t_end_s,x_mm,y_mm,force_N,angle_deg,x_end_mm,y_end_mm,"
          "force_end_N,angle_end_deg,x2_mm,y2_mm,force2_N,force2_end_N,sensors_near,speed_mm_s,"
          "dead_travel_mm,stick_slip_mm"
       << (scenario.pulls ? ",Qx_N,Qy_N,Qx_end_N,Qy_end_N,friction,mass_kg\n" : "\n");
  for (std::size_t n = 0; n < scenario.episodes.size(); n++) {
    const Episode &episode = scenario.episodes[n];
    const bool pushed = scenario.options.kind == "slip";
    for (const Phase &phase : episode.phases) {
      const double begin_s = phase.begin_s - episode.begin_s, end_s = phase.end_s - episode.begin_s;
      text << std::to_string(n + 1) << "," << episode.press << "," << phase.name;
      text.cell(phase.begin_s, 3);
      text.cell(phase.end_s, 3);
      for (double t_s : {begin_s, end_s}) {
        const Touch contact = episode.tracks[0].at(t_s);
        text.cell(contact.x_mm, 4);
        text.cell(contact.y_mm, 4);
        text.cell(contact.force_N, 5);
        text.cell(contact.angle_rad * 180.0 / M_PI, 3);
      }
      if (episode.tracks.size() > 1) {
        const Touch contact = episode.tracks[1].at(begin_s);
        text.cell(contact.x_mm, 4);
        text.cell(contact.y_mm, 4);
        text.cell(contact.force_N, 5);
        text.cell(episode.tracks[1].at(end_s).force_N, 5);
      } else {
        text << ",,,,";
      }
      text << "," << std::to_string(episode.sensors_near);
      text.cell(episode.speed_mm_s, 1);
      text.cell(pushed || moves_under_load(scenario.options.kind) ? scenario.options.dead_travel_mm : 0.0, 3);
      text.cell(pushed ? scenario.options.stick_slip_mm : 0.0, 3);
      if (scenario.pulls) {
        for (double t_s : {begin_s, end_s}) {
          const Touch contact = episode.tracks[0].at(t_s);
          text.cell(contact.pull_x_N, 5);
          text.cell(contact.pull_y_N, 5);
        }
        text.cell(episode.friction, 4);
        text.cell(episode.mass_kg, 4);
      }
      text << "\n";
    }
  }
  return text.bytes();
}

// A contact that rolls off has its edge already.
void check_inside(const Block &block, const Touch &contact, const Track &track, double radius_mm) {
  const bool rolls = std::isfinite(track.edge_x_mm);
  const double room_mm = rolls ? 0.0 : radius_mm;
  if (contact.force_N > 0.0 && (std::abs(contact.x_mm) + room_mm > block.half_x_mm || std::abs(contact.y_mm) + room_mm > block.half_y_mm)) {
    throw Error("a contact of " + fixed(radius_mm, 1) + " mm radius at " + fixed(contact.x_mm, 1) + ", " + fixed(contact.y_mm, 1) +
                " mm leaves the pad, which ends at " + fixed(block.half_x_mm, 1) + ", " + fixed(block.half_y_mm, 1) +
                " mm; give a larger --overhang, a smaller --margin or less --force");
  }
}

} // namespace

std::string truth_path(const std::string &scenario_path) {
  std::filesystem::path path(scenario_path);
  if (path.extension() == ".csv") {
    path.replace_extension();
  }
  return path.string() + ".truth.csv";
}

Written write_scenario(const Scenario &scenario, const Layer &layer, const ContactTable &table, const BlockTable *block,
                       const std::string &path, bool replace, const std::function<void(double share)> &on_progress) {
  const ScenarioOptions &options = scenario.options;
  OutputFile truth(truth_path(path), replace, OutputFile::Appears::when_finished);
  OutputFile file(path, replace, OutputFile::Appears::when_finished);
  const bool temperature = options.effects.count("temperature") + options.effects.count("branch") > 0;
  const std::size_t sensors = geometry.sensor_count;
  Pad pad(options.effects, sensors, layer.thickness_mm, AMBIENT_Pa, *options.pad_seed);
  const BestGaussian gaussian(table, layer.thickness_mm);
  std::optional<TractionTable> traction;
  if (scenario.pulls) {
    traction.emplace(table, layer);
  }
  Written written;

  Text head;
  head << "# fingertip-scenario 1\n";
  describe(head, scenario, layer, pad, path);
  head << "t_s,contact,x_mm,y_mm,force_N,p0_Pa,sigma_mm,slip";
  for (std::size_t k = 0; k < sensors; k++) {
    head << ",s" << std::to_string(k) << "_Pa";
  }
  head << (scenario.pulls ? ",Qx_N,Qy_N" : "");
  head << (temperature ? ",temperature_degC\n" : "\n");
  file.append(head.bytes().data(), head.bytes().size());

  RowWriter writer(file, scenario.pulls, temperature);
  const std::vector<double> none_Pa(sensors, 0.0);
  Row row;
  row.sensors_Pa.resize(sensors);
  const auto add = [&](double t_s, const std::vector<double> &base_Pa) {
    row.t_s = t_s;
    pad.report(t_s, base_Pa, row.sensors_Pa);
    row.temperature_degC = pad.temperature_degC(t_s);
    written.peak_Pa = std::max(written.peak_Pa, *std::max_element(row.sensors_Pa.begin(), row.sensors_Pa.end()));
    writer.add(row);
  };
  double t_s = 0.0;
  const auto quiet_until = [&](double end_s) {
    row.contact = row.slip = false;
    row.x_mm = row.y_mm = row.force_N = row.p0_Pa = row.sigma_mm = 0.0;
    row.pull_x_N = row.pull_y_N = 0.0;
    while (t_s < end_s - 1e-9) {
      add(t_s, none_Pa);
      t_s = std::min(t_s + QUIET_STEP_s, end_s);
    }
  };

  // Weights rest on the pad, and grips that carry are of controlled force: elsewhere the travel is held.
  const bool holds_travel = options.kind != "placements" && !moves_under_load(options.kind);
  Row travel; // what the travel asks for of rubber that has not relaxed
  std::vector<Touch> contacts, before;
  std::vector<double> base_Pa(sensors), relaxed_Pa(sensors);
  for (const Episode &episode : scenario.episodes) {
    quiet_until(episode.begin_s);
    const long long steps = std::llround((episode.end_s - episode.begin_s) / STEP_s);
    before.clear();
    for (long long i = 0; i < steps; i++) {
      t_s = episode.begin_s + static_cast<double>(i) * STEP_s;
      contacts.clear();
      for (const Track &track : episode.tracks) {
        contacts.push_back(track.at(t_s - episode.begin_s));
      }
      if (contacts != before) {
        std::fill(base_Pa.begin(), base_Pa.end(), 0.0);
        row.x_mm = row.y_mm = row.force_N = row.pull_x_N = row.pull_y_N = 0.0;
        for (std::size_t c = 0; c < contacts.size(); c++) {
          const Touch &contact = contacts[c];
          const double radius_mm = table.contact_radius_mm(contact.force_N);
          if (block) {
            check_inside(block->block(), contact, episode.tracks[c], radius_mm);
          }
          const double cosine = std::cos(contact.angle_rad), sine = std::sin(contact.angle_rad);
          for (std::size_t k = 0; k < sensors; k++) {
            const Pad::Seat &seat = pad.seats()[k];
            const double dx = (static_cast<double>(geometry.x_mm[k]) + seat.dx_mm - contact.x_mm) / seat.width;
            const double dy = (static_cast<double>(geometry.y_mm[k]) + seat.dy_mm - contact.y_mm) / seat.width;
            const double along_x = cosine * dx + sine * dy, along_y = cosine * dy - sine * dx;
            base_Pa[k] += table.base_pressure_Pa(contact.force_N, along_x, along_y, pad.dip_share());
            if (block) {
              base_Pa[k] +=
                  block->added_Pa(k, {contact.force_N, contact.pull_x_N, contact.pull_y_N, radius_mm}, contact.x_mm, contact.y_mm);
            }
            if (scenario.pulls) {
              const TractionTable::Load load{contact.force_N, contact.stuck_N, cosine * contact.pull_x_N + sine * contact.pull_y_N,
                                             cosine * contact.pull_y_N - sine * contact.pull_x_N};
              base_Pa[k] += traction->base_pressure_Pa(load, along_x, along_y);
            }
          }
          row.pull_x_N += contact.pull_x_N;
          row.pull_y_N += contact.pull_y_N;
          row.force_N += contact.force_N;
          row.x_mm += contact.force_N * contact.x_mm;
          row.y_mm += contact.force_N * contact.y_mm;
        }
        row.contact = row.force_N > 0.0;
        row.x_mm = row.contact ? row.x_mm / row.force_N : 0.0;
        row.y_mm = row.contact ? row.y_mm / row.force_N : 0.0;
        const bool one = row.contact && contacts.size() == 1;
        const BestGaussian::Fit fit = gaussian.at(row.force_N);
        row.p0_Pa = one ? fit.p0_Pa : 0.0;
        row.sigma_mm = one ? fit.sigma_mm : 0.0;
        before = contacts;
        travel = row;
      }
      const double share = holds_travel ? pad.relaxed_share(t_s, travel.force_N) : 1.0;
      row.contact = share * travel.force_N > 0.0;
      row.force_N = share * travel.force_N;
      row.p0_Pa = share * travel.p0_Pa;
      row.pull_x_N = share * travel.pull_x_N;
      row.pull_y_N = share * travel.pull_y_N;
      std::transform(base_Pa.begin(), base_Pa.end(), relaxed_Pa.begin(), [&](double Pa) { return share * Pa; });
      row.slip = row.contact && episode.slips(t_s);
      add(t_s, relaxed_Pa);
    }
    pad.relaxed_share(t_s, 0.0);
    t_s = episode.end_s;
    if (on_progress) {
      on_progress(t_s / *options.seconds);
    }
  }
  quiet_until(*options.seconds);
  add(*options.seconds, none_Pa);
  writer.finish();

  const std::string events = truth_of(scenario, path);
  truth.append(events.data(), events.size());
  truth.finish();
  file.finish();
  written.rows = writer.rows();
  written.bytes = head.bytes().size() + writer.bytes();
  return written;
}

} // namespace fingertip::twin
