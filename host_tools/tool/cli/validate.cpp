#include "tool/cli/validate.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/recording.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/profile.hpp"
#include "tool/calibration/gain_session.hpp"
#include "tool/cli/validate_live.hpp"
#include "tool/validation/assess.hpp"
#include "tool/validation/card.hpp"
#include "tool/validation/sheet.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace fingertip {
namespace {

using validating::Card;
using validating::Gatherer;
using validating::Measured;

Measured measured_in(const ValidateOptions &options) {
  RecordingReader reader(options.from, false, options.choice.device);
  std::optional<Gatherer> gatherer;
  while (auto item = reader.next()) {
    if (item->kind == RecordingReader::Item::Kind::event) {
      if (const auto step = validating::step_of(item->event); step && gatherer) {
        gatherer->step(*step);
      }
    } else if (item->packet.type == WIRE_INFO && !gatherer) {
      gatherer.emplace(item->packet.body.info);
    } else if (gatherer) {
      gatherer->packet(item->packet);
    }
  }
  if (!gatherer) {
    throw Error(printable(options.from) + ": holds no fingertip; give a recording that `fingertip "
                                          "validate` kept");
  }
  return gatherer->finish();
}

nlohmann::json json_of(const Card &card) {
  nlohmann::json figures = nlohmann::json::object(), findings = nlohmann::json::array(),
                 presses = nlohmann::json::array();
  for (const validating::Figure &figure : card.figures) {
    figures[figure.key] =
        std::round(figure.value * std::pow(10.0, figure.digits + 2)) / std::pow(10.0, figure.digits + 2);
  }
  for (const validating::Finding &finding : card.findings) {
    findings.push_back({{"finding", finding.code}, {"sensors", finding.sensors}, {"text", finding.text}});
  }
  for (std::size_t i = 0; i < card.measured.presses.size(); i++) {
    const validating::Press &press = card.measured.presses[i];
    presses.push_back({{"mark", press.mark + 1},
                       {"frames", press.estimate.frames},
                       {"x_mm", press.estimate.x_mm},
                       {"y_mm", press.estimate.y_mm},
                       {"force_N", press.estimate.force_N},
                       {"warned", press.estimate.warned},
                       {"off_mm", card.locations[i].off_mm},
                       {"pressed_x_mm", card.fit.presses[i].x_mm},
                       {"pressed_y_mm", card.fit.presses[i].y_mm}});
  }
  nlohmann::json pulls = nlohmann::json::array();
  for (const validating::Pulled &pulled : card.measured.pulls) {
    pulls.push_back({{"toward_deg", pulled.toward_deg},
                     {"rest_x_mm", pulled.rest.x_mm},
                     {"rest_y_mm", pulled.rest.y_mm},
                     {"x_mm", pulled.pull.x_mm},
                     {"y_mm", pulled.pull.y_mm},
                     {"force_N", pulled.pull.force_N},
                     {"frames", pulled.pull.pull_frames},
                     {"qx_N", pulled.pull.qx_N - pulled.rest.qx_N},
                     {"qy_N", pulled.pull.qy_N - pulled.rest.qy_N}});
  }
  return {{"figures", figures},
          {"findings", findings},
          {"presses", presses},
          {"gain", card.gain},
          {"gain_sd", card.gain_sd},
          {"pulls", pulls},
          {"pull_note", card.pull_note},
          {"calibrated", card.is_calibrated},
          {"calibration", card.judgement.text}};
}

bool is_pdf(const std::string &path) {
  const std::string ends = ".pdf";
  return path.size() > ends.size() && path.compare(path.size() - ends.size(), ends.size(), ends) == 0;
}

void print(const Card &card) {
  for (const validating::Figure &figure : card.figures) {
    std::printf("%9s %-7s %s\n", fixed(figure.value, figure.digits).c_str(), figure.unit.c_str(), figure.says.c_str());
  }
  std::printf("%s\n", card.findings.empty() ? "\nnothing is wrong that this validation can see" : "");
  if (!card.pull_note.empty()) {
    std::printf("%s\n", card.pull_note.c_str());
  }
  for (const validating::Finding &finding : card.findings) {
    std::printf("%s: %s\n", finding.code.c_str(), finding.text.c_str());
  }
  std::fflush(stdout);
}

void write_text(const std::string &path, bool overwrite, const std::string &text) {
  OutputFile file(path, overwrite, OutputFile::Appears::when_finished);
  file.append(text.data(), text.size());
  file.finish();
}

} // namespace

int run_validate(const ValidateOptions &options) {
  for (const std::string *path : {&options.card, &options.figures, &options.sheet}) {
    if (!path->empty()) {
      check_output(*path, options.overwrite);
    }
  }
  if (!options.sheet.empty()) {
    const calibrating::Array array = calibrating::array_of(pad::own_sensors());
    write_text(options.sheet, options.overwrite,
               is_pdf(options.sheet) ? validating::sheet_pdf(array) : validating::sheet_svg(array));
    std::printf("%s: print it at 100 %%, and measure its line of %s mm\n", printable(options.sheet).c_str(),
                fixed(validating::RULER_mm, 0).c_str());
    return 0;
  }
  const Card card = validating::assess(options.from.empty() ? validate_live(options) : measured_in(options),
                                       printable(options.from.empty() ? options.recording : options.from));
  if (!options.card.empty()) {
    write_text(options.card, options.overwrite, validating::card_html(card, FINGERTIP_VERSION));
  }
  if (!options.figures.empty()) {
    write_text(options.figures, options.overwrite, json_of(card).dump(1) + "\n");
  }
  print(card);
  return 0;
}

} // namespace fingertip
