#include "tool/validation/card.hpp"

#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/validation/plot.hpp"
#include "tool/validation/twin_says.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::validating {
namespace {

constexpr double MAGNIFIED = 5.0; /* errors in the picture of the pad */
constexpr double ROOM_mm = 6.0;
constexpr double PACKAGE_mm = 3.3; /* of an MS5840, each way */
constexpr double PITCH_SAME_mm = 0.05;
constexpr double BLIND_REACH_mm = 3.0, PULL_REACH = 0.6; /* of the picture of pulls */
constexpr std::size_t TWIN_SENSORS = 15;
constexpr double TWIN_PITCH_mm = 9.0;

const char *const STYLE = "body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 "
                          "1rem;color:#1c1d22;background:#fff}"
                          "h1{font-size:1.6rem;margin:0}h2{font-size:1.15rem;margin:2rem 0 .4rem}p{margin:.4rem 0}"
                          "table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:.25rem "
                          ".6rem;border-bottom:1px solid #ddd;vertical-align:top}"
                          "td.n,th.n{text-align:right;white-space:nowrap}.faint{color:#60626b}"
                          ".find{border-left:4px solid #c62828;padding:.2rem .8rem;margin:.5rem 0;background:#fdecea}"
                          ".note{border-left:4px solid #999;padding:.2rem .8rem;margin:.5rem 0}"
                          ".good{border-left:4px solid #2e7d32;padding:.2rem .8rem;margin:.5rem 0;background:#e9f5ea}"
                          ".pictures{display:flex;flex-wrap:wrap;gap:1.2rem}figure{margin:0;max-width:100%}figcaption{"
                          "max-width:28rem;font-size:.9rem;color:#444}"
                          "svg{max-width:100%;height:auto}svg text{font:11px system-ui,sans-serif;fill:#333}svg "
                          ".frame{fill:#fafafa;stroke:#999}"
                          "svg .tick{stroke:#999}svg .ours{fill:none;stroke:#1565c0;stroke-width:1.5}svg "
                          ".thin{fill:none;stroke:#1565c0;stroke-opacity:.45}"
                          "svg .red{fill:none;stroke:#c62828;stroke-width:1.5}svg .dot{fill:#1565c0}svg "
                          ".mark{fill:none;stroke:#333}"
                          "svg .open{fill:none;stroke:#c62828;stroke-width:1.5}svg .bar{fill:#90b4dc}svg "
                          ".badbar{fill:#c62828}svg .sensor{fill:none;stroke:#bbb}"
                          "svg .grey{fill:none;stroke:#888;stroke-dasharray:4 3}svg .error{stroke:#333}"
                          "@media(prefers-color-scheme:dark){body{color:#dedee4;background:#14151c}td,th{border-color:#"
                          "34364a}.faint,figcaption{color:#9a9cab}"
                          ".find{background:#3a1d1d}.good{background:#1b3320}svg text{fill:#c8c8d0}svg "
                          ".frame{fill:#1b1c26;stroke:#666}"
                          "svg .mark,svg .error{stroke:#ddd}svg .sensor{stroke:#555}}";

std::string row(const std::vector<std::string> &cells, const std::vector<bool> &is_number, const char *tag) {
  std::string text = "<tr>";
  for (std::size_t i = 0; i < cells.size(); i++) {
    text += std::string("<") + tag + (is_number[i] ? " class=\"n\">" : ">") + cells[i] + "</" + tag + ">";
  }
  return text + "</tr>\n";
}

class Page {
public:
  Page(const Card &card, const std::string &version) : card_(card), version_(version) {
    for (const Finding &finding : card.findings) {
      for (std::size_t k : finding.sensors) {
        named_ |= 1u << k;
      }
    }
  }

  std::string html() {
    text_ = "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
            "content=\"width=device-width\"><title>A pad's report card</title><style>" +
            std::string(STYLE) + "</style>\n";
    head();
    findings();
    figures();
    text_ += "<h2>Pictures</h2>\n<div class=\"pictures\">\n";
    pad();
    forces();
    gains();
    profile();
    empty();
    hold();
    pulls();
    text_ += "</div>\n";
    notes();
    return text_ + "</html>\n";
  }

private:
  void picture(const Plot &plot, const std::string &title, const std::string &says) {
    text_ += "<figure>" + plot.svg(title) + "<figcaption><b>" + escaped(title) + ".</b> " + escaped(says) +
             "</figcaption></figure>\n";
  }

  void head() {
    const Measured &measured = card_.measured;
    const wire_info &info = measured.info;
    const std::string serial = text_field(info.serial);
    text_ += "<h1>A pad's report card</h1>\n<p class=\"faint\">" +
             escaped((serial.empty() ? "" : "Fingertip " + serial + ", ") + "board " + text_field(info.board) + ", " +
                     std::to_string(measured.array.sensors()) + " sensors, firmware " +
                     std::to_string(info.firmware_version[0]) + "." + std::to_string(info.firmware_version[1]) + "." +
                     std::to_string(info.firmware_version[2]) + ", " +
                     (card_.is_calibrated ? "calibrated" : "never calibrated") + ", rubber stated as " +
                     fixed(measured.skin_mm, 0) + " mm. " + std::to_string(measured.presses.size()) + " presses of " +
                     fixed(measured.weight_g, 0) + " g. Made by fingertip " + version_ + ".") +
             "</p>\n";
  }

  void findings() {
    if (card_.findings.empty()) {
      text_ += "<p class=\"good\">Nothing is wrong that this validation can see.</p>\n";
    }
    for (const Finding &finding : card_.findings) {
      text_ += "<p class=\"find\">" + escaped(finding.text) + "</p>\n";
    }
    if (!card_.pull_note.empty()) {
      text_ += "<p class=\"note\">" + escaped(card_.pull_note) + "</p>\n";
    }
    if (!card_.measured.ended) {
      text_ += "<p class=\"find\">The validation was not led to its end: some figures are "
               "missing.</p>\n";
    }
  }

  bool is_like_twin() const {
    const Measured &measured = card_.measured;
    return measured.array.sensors() == TWIN_SENSORS &&
           std::abs(measured.array.pitch_mm - TWIN_PITCH_mm) < PITCH_SAME_mm &&
           std::abs(measured.skin_mm - TWIN_SKIN_mm) <= TWIN_SKIN_OFF_mm;
  }

  bool is_pulled_as_twin() const {
    const auto &pulls = card_.measured.pulls;
    return !pulls.empty() &&
           std::abs(pulls.back().pulling.weight_g / card_.measured.weight_g - TWIN_PULL) < TWIN_PULL_OFF;
  }

  std::string about_twin() const {
    if (!is_like_twin()) {
      return "The twin was asked only for 12 mm of rubber over fifteen sensors 9 mm apart.";
    }
    std::string text = "The twin is the project's simulation: healthy pads of 12 mm, with the "
                       "errors that recordings of real pads show, validated in the same way. No "
                       "real pad has been compared with it yet.";
    if (card_.figure("pull_true") != nullptr) {
      text += " Beside a pull that is found stand pads whose sensors differ in their gains alone: "
              "on those with all errors the simulated fingertip mostly estimates no pull.";
    }
    return text;
  }

  void figures() {
    const std::vector<bool> numbers = {false, true, true, true};
    text_ += "<h2>Figures</h2>\n<table>\n" +
             row({"", "this pad", "the twin's median", "nine in ten of the twin's"}, numbers, "th");
    for (const Figure &figure : card_.figures) {
      const auto shown = [&](double value) {
        return fixed(value, figure.digits) + (figure.unit.empty() ? "" : " " + figure.unit);
      };
      const bool is_compared = is_like_twin() && (figure.key.rfind("pull_", 0) != 0 || is_pulled_as_twin());
      const auto twin = is_compared ? twin_says(figure.key, card_.is_calibrated) : std::nullopt;
      text_ += row({escaped(figure.says), shown(figure.value), twin ? shown(twin->middle) : "",
                    twin ? fixed(twin->low, figure.digits) + " to " + shown(twin->high) : ""},
                   numbers, "td");
    }
    text_ += "</table>\n<p class=\"faint\">" + about_twin() + "</p>\n";
  }

  void pad() {
    const calibrating::Array &array = card_.measured.array;
    std::vector<double> x = array.x_mm, y = array.y_mm;
    const Range rx = {*std::min_element(x.begin(), x.end()) - ROOM_mm, *std::max_element(x.begin(), x.end()) + ROOM_mm};
    const Range ry = {*std::min_element(y.begin(), y.end()) - ROOM_mm, *std::max_element(y.begin(), y.end()) + ROOM_mm};
    Plot plot(420, 520, rx, ry, "x, mm", "y, mm", true);
    const double half = 0.5 * PACKAGE_mm;
    for (std::size_t k = 0; k < array.sensors(); k++) {
      const double l = array.x_mm[k] - half, r = l + PACKAGE_mm, b = array.y_mm[k] - half, t = b + PACKAGE_mm;
      plot.line({{l, b}, {r, b}, {r, t}, {l, t}, {l, b}}, named_ >> k & 1u ? "red" : "sensor");
      plot.text(array.x_mm[k], array.y_mm[k] - half - 2.2, std::to_string(k));
    }
    for (std::size_t i = 0; i < card_.locations.size(); i++) {
      const FoundPress &press = card_.fit.presses[i];
      const Location &location = card_.locations[i];
      plot.dot(press.x_mm, press.y_mm, 2.0, "mark");
      if (location.off_mm >= 0.0) {
        const double to_x = press.x_mm + MAGNIFIED * location.x_mm, to_y = press.y_mm + MAGNIFIED * location.y_mm;
        plot.line({{press.x_mm, press.y_mm}, {to_x, to_y}}, card_.measured.presses[i].estimate.warned ? "red" : "ours");
      }
    }
    picture(plot, "Where it was pressed, and where the fingertip says",
            "Circles: presses. Lines: to the estimate, five times as long as the error; red where the "
            "fingertip warned. Squares: sensors; red where something is wrong.");
  }

  void forces() {
    std::vector<double> values = {1.0};
    const double weight_N = calibrating::GRAVITY_N_PER_g * card_.measured.weight_g;
    for (const Press &press : card_.measured.presses) {
      if (press.estimate.frames > 0) {
        values.push_back(press.estimate.force_N / weight_N);
      }
    }
    const double count = double(card_.measured.presses.size());
    Plot plot(440, 240, {0.0, count + 1.0}, range_of(values, true), "press", "force over the weight");
    plot.line({{0.0, 1.0}, {count + 1.0, 1.0}}, "grey");
    for (std::size_t i = 0; i < card_.measured.presses.size(); i++) {
      const Press &press = card_.measured.presses[i];
      if (press.estimate.frames > 0) {
        plot.dot(double(i + 1), press.estimate.force_N / weight_N, 3.0, press.estimate.warned ? "open" : "dot");
      }
    }
    picture(plot, "Force of each press", "Open: with a warning. The dashed line is the weight.");
  }

  void gains() {
    std::vector<double> values = {1.0};
    for (std::size_t k = 0; k < card_.gain.size(); k++) {
      if (card_.gain[k] > 0.0) {
        values.push_back(card_.gain[k] * (1.0 + 2.0 * card_.gain_sd[k]));
        values.push_back(card_.gain[k] * (1.0 - 2.0 * card_.gain_sd[k]));
      }
    }
    Plot plot(440, 240, {-0.7, double(card_.gain.size()) - 0.3}, range_of(values), "sensor", "gain");
    plot.bars_from(1.0);
    for (std::size_t k = 0; k < card_.gain.size(); k++) {
      if (!(card_.gain[k] > 0.0)) {
        continue;
      }
      const double at = double(k), sd = card_.gain[k] * card_.gain_sd[k];
      plot.bar(at, 0.35, card_.gain[k], named_ >> k & 1u ? "badbar" : "bar");
      plot.line({{at, card_.gain[k] - 2.0 * sd}, {at, card_.gain[k] + 2.0 * sd}}, "error");
      if (card_.is_calibrated) {
        plot.dot(at, static_cast<double>(card_.measured.info.calibration.sensors[k].gain), 3.0, "open");
      }
    }
    picture(plot, "Gains of the sensors",
            std::string("Lines: two standard deviations. A sensor that is dead or loose has none.") +
                (card_.is_calibrated ? " Circles: the stored calibration." : ""));
  }

  void profile() {
    const calibrating::Solution &solution = card_.judgement.solution;
    if (!solution.solved || !(solution.peak_Pa > 0.0)) {
      return;
    }
    Plot plot(440, 260, {0.0, 30.0}, {-0.1, 1.15}, "distance from the press, mm", "reading over gain, of the peak");
    for (std::size_t i = 0; i < card_.measured.presses.size(); i++) {
      const Press &press = card_.measured.presses[i];
      for (std::size_t k = 0; k < card_.gain.size(); k++) {
        const std::size_t place = card_.fit.sensors[k].place;
        const double r = std::hypot(card_.measured.array.x_mm[place] - card_.fit.presses[i].x_mm,
                                    card_.measured.array.y_mm[place] - card_.fit.presses[i].y_mm);
        if (card_.gain[k] > 0.0 && (press.placement.usable >> k & 1u) && r < 30.0) {
          plot.dot(r, press.placement.reading_Pa[k] / card_.gain[k] / solution.peak_Pa, 1.2, "dot");
        }
      }
    }
    std::vector<std::pair<double, double>> curve;
    for (double r = 0.0; r <= 30.0; r += 0.5) {
      const auto gauss = [&](double sd) { return std::exp(-0.5 * r * r / (sd * sd)); };
      const double dip_sd = solution.dip_sd_mm;
      curve.push_back({r, (1.0 - solution.mixing) * gauss(solution.width_mm) +
                              solution.mixing * gauss(calibrating::NARROW * solution.width_mm) -
                              solution.dip * gauss(dip_sd)});
    }
    plot.line(curve, "red");
    picture(plot, "The response that the presses teach",
            "Dots: each reading. Curve: what fits all of them; dots that leave it are what the "
            "findings are made of.");
  }

  void empty() {
    if (!card_.measured.empty || card_.measured.empty->seconds_Pa.empty()) {
      return;
    }
    const Empty &minute = *card_.measured.empty;
    std::vector<double> values;
    for (const auto &second : minute.seconds_Pa) {
      values.insert(values.end(), second.begin(), second.end());
    }
    Plot plot(440, 240, {0.0, double(minute.seconds_Pa.size())}, range_of(values), "s", "zero, Pa");
    for (std::size_t k = 0; k < minute.noise_Pa.size(); k++) {
      std::vector<std::pair<double, double>> line;
      for (std::size_t t = 0; t < minute.seconds_Pa.size(); t++) {
        line.push_back({double(t) + 0.5, minute.seconds_Pa[t][k]});
      }
      plot.line(line, named_ >> k & 1u ? "red" : "thin");
    }
    picture(plot, "The empty minute", "One line a sensor, from its first second; red where something is wrong.");
  }

  void hold() {
    if (!card_.measured.hold || card_.measured.hold->sum_Pa.empty()) {
      return;
    }
    std::vector<std::pair<double, double>> line;
    std::vector<double> times, values;
    for (const auto &[t_s, sum_Pa] : card_.measured.hold->sum_Pa) {
      line.push_back({t_s, 1e-3 * sum_Pa});
      times.push_back(t_s);
      values.push_back(1e-3 * sum_Pa);
    }
    Plot plot(440, 240, range_of(times), range_of(values, true), "s after the touch", "all sensors, kPa");
    plot.line(line, "ours");
    picture(plot, "The hold, the release and the rest", "Readings above those before the touch, summed.");
  }

  void pulls() {
    if (card_.figure("pull_true") == nullptr && card_.figure("pull_blind_true") == nullptr) {
      return;
    }
    const bool is_blind = card_.figure("pull_true") == nullptr;
    const double reach = is_blind ? BLIND_REACH_mm : PULL_REACH;
    Plot plot(330, 330, {-reach, reach}, {-reach, reach},
              is_blind ? "location against the rest, x, mm" : "pull over force, x", is_blind ? "y, mm" : "y", true);
    for (const Pulled &pulled : card_.measured.pulls) {
      const Estimate &rest = pulled.rest, &pull = pulled.pull;
      if (rest.frames == 0 || pull.frames == 0) {
        continue;
      }
      if (is_blind) {
        plot.line({{0.0, 0.0}, {pull.x_mm - rest.x_mm, pull.y_mm - rest.y_mm}}, "ours");
        continue;
      }
      const double share = pulled.pulling.weight_g / card_.measured.weight_g;
      const double angle = pulled.toward_deg * M_PI / 180.0;
      plot.dot(share * std::cos(angle), share * std::sin(angle), 5.0, "mark");
      if (rest.pull_frames > 0 && pull.pull_frames > 0) {
        plot.line({{rest.qx_N / rest.force_N, rest.qy_N / rest.force_N},
                   {pull.qx_N / pull.force_N, pull.qy_N / pull.force_N}},
                  pull.warned ? "red" : "ours");
      }
    }
    picture(plot, "The pulls",
            is_blind ? "Lines: how each pull moves the location. The fingertip estimates no pull."
                     : "Lines: the pull that is found, from the rest before to each pull; red where "
                       "the fingertip warned. Circles: the pull of the thread.");
  }

  void notes() {
    text_ += "<h2>How to read it</h2>\n"
             "<p>The location's error is the distance from the fingertip's estimate to where the "
             "press was. Where it was "
             "follows from the readings of all sensors and from the marks together, whatever the "
             "gains are. The print's shift "
             "and turn on the pad are found from the sensors' own places. So this cannot see a "
             "shift that all sensors "
             "have in common against the board's drawing.</p>\n"
             "<p>The hand's error is taken out of location and repeatability. The figure \"from "
             "the marks themselves\" has "
             "it. A press is read from half a second to a second after it stood.</p>\n"
             "<p>" +
             std::string(card_.measured.pulls_asked > 0
                             ? "A pull is the change from the rest before it. The thread pulls "
                               "above the rubber, and the card corrects the location for that. The "
                               "weight itself moves by some tenths of a millimetre as the rubber "
                               "shears. The card does not correct for this, here or in the twin's "
                               "figures. A pulley with friction pulls less than the mass on "
                               "it.</p>\n<p>Not measured here: other forces, other objects, "
                               "temperature."
                             : "Not measured here: other forces, other objects, pulls, "
                               "temperature.") +
             "</p>\n";
  }

  const Card &card_;
  const std::string version_;
  std::uint32_t named_ = 0; /* sensors in a finding */
  std::string text_;
};

} // namespace

std::string card_html(const Card &card, const std::string &version) {
  return Page(card, version).html();
}

} // namespace fingertip::validating
