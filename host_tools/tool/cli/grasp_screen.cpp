#include "grasp/words.hpp"
#include "libfingertip/packet_fields.hpp"
#include "tool/cli/chart.hpp"
#include "tool/cli/monitor.hpp"
#include "tool/cli/pad_picture.hpp"
#include "tool/cli/panel.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

namespace {

/* Three charts of two rows each, and the time. */
constexpr int CHART_ROWS = 7;
/* The share of all rows on a higher screen. */
constexpr int CHARTS_PERCENT = 40;
constexpr Colour LEFT = ACCENT, RIGHT = {200, 140, 255};
constexpr const char *SIDES[] = {"left", "right"};

Colour colour_of(std::uint8_t state) {
  switch (state) {
  case GRIP_HOLDING:
  case GRIP_READY: return GOOD;
  case GRIP_SLIPPING:
  case GRIP_DROPPED:
  case GRIP_MISSED:
  case GRIP_FAULT: return BAD;
  case GRIP_IDLE:
  case GRIP_OPEN: return FAINT;
  default: return WARNING;
  }
}

void draw_head(Canvas &canvas, const GripModel &grip) {
  draw_bar(canvas, {0, 0, canvas.columns(), 1});
  int column = canvas.text(1, 0, "FINGERTIP ", {WHITE, BAR, true});
  canvas.text(column, 0, "grasp  " + printable(grip.gripper()), {FAINT, BAR, false});
  std::uint8_t state = grip.row() ? grip.row()->report.state : std::uint8_t{GRIP_IDLE};
  std::string text = "● " + upper(state_name(state)) + " " + fixed(grip.state_seconds(), 1) + " s ";
  canvas.text(canvas.columns() - columns_of(text), 0, text, {colour_of(state), BAR, true});
}

struct Measured {
  std::optional<float> force_N;
  bool doubtful = false, at_least = false;
};

Measured measured_by(const Model &model) {
  if (!model.is_current() || !model.contact()) {
    return {};
  }
  const wire_contact &contact = *model.contact();
  if (!(contact.flags & CONTACT_FLAG_FIT_VALID)) {
    return {contact.flags & CONTACT_FLAG_CONTACT ? std::nullopt : std::optional<float>(0)};
  }
  return {contact.force_N, is_doubtful(contact), (contact.flags & CONTACT_FLAG_FORCE_LOWER_BOUND) != 0};
}

/* Its width; the pad below its name and state. */
int draw_fingertip(Canvas &canvas, const Area &area, const Model &model, std::size_t side) {
  const auto [state, colour, calm] = state_of(model);
  int width = 0;
  if (model.info() && model.info()->sensor_count > 0) {
    width = draw_pad(canvas, {area.left, area.top + 1, area.width, area.height - 1}, model).width;
  }
  std::string name = model.info() ? text_field(model.info()->serial) : printable(model.source());
  int room = std::max(width, 12);
  int column = canvas.text(area.left, area.top, SIDES[side], text_style(side == 0 ? LEFT : RIGHT, true)) + 1;
  canvas.text(column, area.top, "●", text_style(colour, true));
  column += 2;
  bool fine = model.state() == Model::State::replay || colour == GOOD;
  canvas.text(column, area.top, first_columns(fine ? name : state, area.left + room - column), text_style(fine ? FAINT : colour));
  return room;
}

/* Filled up to the force, with a mark where it is wanted; the whole is the cap. */
void draw_force(Canvas &canvas, const Area &area, const Measured &measured, float wanted_N, float cap_N, Colour colour) {
  float full_N = cap_N > 0 ? cap_N : 20;
  auto cells = [&](float force_N) {
    return static_cast<int>(std::lround(std::clamp(force_N / full_N, 0.0f, 1.0f) * static_cast<float>(area.width)));
  };
  int filled = measured.force_N ? cells(*measured.force_N) : 0;
  bool over = measured.force_N && *measured.force_N > full_N;
  for (int i = 0; i < area.width; i++) {
    canvas.text(area.left + i, area.top, i < filled ? "█" : "░",
                text_style(i >= filled         ? RULE
                           : over              ? BAD
                           : measured.doubtful ? WARNING
                                               : colour));
  }
  if (wanted_N > 0) {
    int at = std::min(cells(wanted_N), area.width - 1);
    canvas.text(area.left + at, area.top, "┃", text_style(WHITE, true));
  }
}

void draw_panel(Canvas &canvas, const Area &area, const std::vector<Model> &fingertips, const GripModel &grip) {
  int row = area.top, bottom = area.top + area.height;
  if (!grip.row()) {
    canvas.text(area.left, row, "nothing known of the gripper", text_style(FAINT));
    return;
  }
  const GripReport &report = grip.row()->report;
  const auto &status = grip.row()->status;
  auto newton = [](double force_N) { return fixed(force_N, 2); };
  for (const std::string &line : flowed({state_text(report.state)}, " ", area.width)) {
    canvas.text(area.left, row++, first_columns(line, area.width), text_style(colour_of(report.state), true));
  }
  int column =
      draw_quantity(canvas, area.left, row, {"width ", status ? std::optional(fixed(status->width_mm, 1)) : std::nullopt, 6, "mm"});
  if (status && status->moving) {
    canvas.text(column + 1, row, "moving", text_style(WARNING));
  } else if (status && status->object) {
    canvas.text(column + 1, row, *status->object ? "held" : "", text_style(FAINT));
  }
  row++;
  for (std::size_t i = 0; i < fingertips.size() && i < 2; i++, row++) {
    const Measured measured = measured_by(fingertips[i]);
    column = draw_quantity(canvas, area.left, row,
                           {i == 0 ? "left  " : "right ",
                            measured.force_N ? std::optional((measured.at_least ? "≥" : "") + number(*measured.force_N, 2)) : std::nullopt,
                            6, "N ", measured.doubtful});
    int width = area.left + area.width - column - 1;
    if (width >= 4) {
      draw_force(canvas, {column + 1, row, width, 1}, measured, static_cast<float>(report.wanted_N), grip.cap_N(), i == 0 ? LEFT : RIGHT);
    }
  }
  column = draw_quantity(canvas, area.left, row, {"wanted", newton(report.wanted_N), 6, "N "});
  draw_quantity(canvas, column + 1, row, {"cap", number(grip.cap_N(), 1), 5, "N"});
  row++;
  bool loaded = report.load_N > 0;
  column = draw_quantity(canvas, area.left, row, {"load  ", loaded ? std::optional(newton(report.load_N)) : std::nullopt, 6, "N "});
  draw_quantity(canvas, column + 1, row, {"margin", report.margin > 0 ? std::optional(fixed(report.margin, 2)) : std::nullopt, 5, ""});
  row++;
  column = draw_quantity(canvas, area.left, row, {"slides", std::to_string(report.slides), 6, "  "});
  column = draw_quantity(canvas, column + 1, row, {"friction", fixed(report.friction, 2), 4, " "});
  draw_quantity(canvas, column + 1, row, {"delay", fixed(1e3 * report.delay_s, 0), 3, "ms"});
  row++;
  column = area.left;
  for (std::size_t i = 0; i < fingertips.size() && i < 2; i++) {
    const Model &model = fingertips[i];
    bool slips = model.is_current() && (model.slid_lately() || model.slipped_lately());
    column = draw_lamp(canvas, column, row, slips, std::string("SLIP ") + SIDES[i], BAD) + 2;
  }
  row++;
  std::vector<std::string> troubles = trouble_texts(report);
  if (report.gripper_fault != 0) {
    troubles.push_back("gripper's fault " + std::to_string(report.gripper_fault));
  }
  for (const std::string &line : flowed(troubles, "; ", area.width)) {
    if (row < bottom) {
      canvas.text(area.left, row++, first_columns(line, area.width), text_style(WARNING, true));
    }
  }
}

Curve grip_curve(const GripModel &grip, bool GripModel::Sample::*there, float GripModel::Sample::*value, Colour colour) {
  return {[&grip, there, value](std::int64_t interval) {
            const GripModel::Sample &sample = grip.samples()[interval];
            return ChartPoint{sample.*there ? std::optional<float>(sample.*value) : std::nullopt, false, sample.slipping};
          },
          grip.samples().last(), true, colour};
}

void draw_over_time(Canvas &canvas, const Area &area, const std::vector<Model> &fingertips, const GripModel &grip) {
  if (!has_room_for_charts(area)) {
    return;
  }
  using Shown = GripModel::Sample;
  float force_N = 1, load_N = 0.5f, width_mm = 10;
  std::vector<Curve> forces = {grip_curve(grip, &Shown::controlled, &Shown::wanted_N, INK)};
  for (std::size_t i = 0; i < fingertips.size() && i < 2; i++) {
    Curve curve = force_curve(fingertips[i]);
    curve.colour = i == 0 ? LEFT : RIGHT;
    each_shown(area, curve.last, [&](std::int64_t interval) {
      const ChartPoint point = curve.at(interval);
      force_N = point.value && !point.doubtful ? std::max(force_N, *point.value) : force_N;
    });
    forces.push_back(std::move(curve));
  }
  each_shown(area, grip.samples().last(), [&](std::int64_t interval) {
    const Shown &sample = grip.samples()[interval];
    force_N = sample.controlled ? std::max(force_N, sample.wanted_N) : force_N;
    load_N = sample.loaded ? std::max(load_N, sample.load_N) : load_N;
    width_mm = sample.answered ? std::max(width_mm, sample.width_mm) : width_mm;
  });
  draw_charts(canvas, area,
              {{"force", "N", 0, round_above(force_N), std::nullopt, std::move(forces)},
               {"load", "N", 0, round_above(load_N), std::nullopt, {grip_curve(grip, &Shown::loaded, &Shown::load_N, ACCENT)}},
               {"width", "mm", 0, round_above(width_mm), std::nullopt, {grip_curve(grip, &Shown::answered, &Shown::width_mm, ACCENT)}}});
}

} // namespace

Canvas draw_grasp(const std::vector<Model> &fingertips, const GripModel &grip, const Caption &caption, int columns, int rows) {
  Canvas canvas(columns, rows);
  if (is_too_small(canvas)) {
    int row = 1;
    for (const std::string &line :
         flowed({state_text(grip.row() ? grip.row()->report.state : std::uint8_t{GRIP_IDLE}), grip_line(grip)}, "\n", columns)) {
      canvas.text(0, row++, line);
    }
    draw_caption(canvas, caption);
    return canvas;
  }
  draw_head(canvas, grip);
  int charts = std::max(CHART_ROWS, rows * CHARTS_PERCENT / 100);
  int top = 1, height = rows - 1 - top - charts;
  int left = 1;
  for (std::size_t i = 0; i < fingertips.size() && i < 2; i++) {
    left += draw_fingertip(canvas, {left, top, columns / 3, height}, fingertips[i], i) + 1;
  }
  draw_panel(canvas, {left + 1, top, columns - left - 2, height}, fingertips, grip);
  draw_over_time(canvas, {1, top + height, columns - 2, charts}, fingertips, grip);
  draw_caption(canvas, caption);
  return canvas;
}

} // namespace fingertip
