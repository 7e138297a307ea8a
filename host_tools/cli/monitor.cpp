#include "cli/monitor.hpp"

#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"
#include "tool/advice.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace fingertip {

namespace {

constexpr Colour INK = {222, 222, 228};
constexpr Colour FAINT = {128, 130, 145};
constexpr Colour RULE = {66, 68, 84};
constexpr Colour PAD = {16, 16, 28};
constexpr Colour WHITE = {255, 255, 255};
constexpr Colour BLACK = {0, 0, 0};
constexpr Colour GOOD = {92, 214, 140};
constexpr Colour WARNING = {250, 190, 60};
constexpr Colour BAD = {255, 84, 84};
constexpr Colour ACCENT = {96, 190, 255};

constexpr Style text_style(Colour colour, bool bold = false) {
  return {colour, std::nullopt, bold};
}

/* The rim of the pad beyond the outermost sensors, half a pitch of 9 mm and some. */
constexpr float RIM_mm = 6.0f;
/* Pressure of the brightest colour. The scale is the square root, so that a light touch shows. */
constexpr float FULL_SCALE_Pa = 100000.0f;
constexpr float FORCE_SCALE_N = 20.0f;

/* Perceptually ordered, dark to bright, for 0 to 1. */
Colour heat(float part) {
  constexpr Colour stops[] = {PAD,           {44, 18, 92},   {104, 24, 112}, {164, 46, 98},
                              {216, 76, 62}, {246, 130, 26}, {250, 196, 44}, {253, 252, 180}};
  constexpr int last = static_cast<int>(sizeof stops / sizeof *stops) - 1;
  float at = std::clamp(part, 0.0f, 1.0f) * static_cast<float>(last);
  int below = std::min(static_cast<int>(at), last - 1);
  return mix(stops[below], stops[below + 1], at - static_cast<float>(below));
}

float heat_part(float pressure_Pa) {
  return std::sqrt(std::max(pressure_Pa, 0.0f) / FULL_SCALE_Pa);
}

std::string number(float value, int digits) {
  return fixed(static_cast<double>(value), digits);
}

/* "+3.20": always with a sign, so that columns stand still. */
std::string signed_number(float value, int digits) {
  std::string text = number(value, digits);
  return text[0] == '-' ? text : "+" + text;
}

std::string right_aligned(const std::string &text, std::size_t width) {
  return std::string(width > text.size() ? width - text.size() : 0, ' ') + text;
}

/* The picture of the pad in square pixels, two to a character cell. */
class PadPicture {
public:
  PadPicture(const wire_info &info, int columns_available, int rows_available) {
    auto [x_low, x_high] = std::minmax_element(info.x_mm, info.x_mm + info.sensor_count);
    auto [y_low, y_high] = std::minmax_element(info.y_mm, info.y_mm + info.sensor_count);
    left_mm_ = *x_low - RIM_mm;
    top_mm_ = *y_high + RIM_mm;
    float width_mm = *x_high + RIM_mm - left_mm_;
    float height_mm = top_mm_ - *y_low + RIM_mm;
    pixel_mm_ = std::max(width_mm / static_cast<float>(std::max(columns_available, 4)),
                         height_mm / static_cast<float>(2 * std::max(rows_available, 2)));
    columns_ = static_cast<int>(std::lround(width_mm / pixel_mm_));
    rows_ = static_cast<int>(std::lround(height_mm / pixel_mm_ / 2));
    pixels_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) * 2, PAD);
  }

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  float x_mm(int column) const {
    return left_mm_ + (static_cast<float>(column) + 0.5f) * pixel_mm_;
  }
  float y_mm(int pixel_row) const {
    return top_mm_ - (static_cast<float>(pixel_row) + 0.5f) * pixel_mm_;
  }
  int column_of(float x_mm) const {
    return static_cast<int>(std::floor((x_mm - left_mm_) / pixel_mm_));
  }
  int pixel_row_of(float y_mm) const {
    return static_cast<int>(std::floor((top_mm_ - y_mm) / pixel_mm_));
  }
  Colour *pixel(int column, int pixel_row) {
    if (column < 0 || column >= columns_ || pixel_row < 0 || pixel_row >= 2 * rows_) {
      return nullptr;
    }
    return &pixels_[static_cast<std::size_t>(pixel_row) * static_cast<std::size_t>(columns_) +
                    static_cast<std::size_t>(column)];
  }
  void paint(int column, int pixel_row, Colour colour, float part) {
    if (Colour *at = pixel(column, pixel_row)) {
      *at = mix(*at, colour, part);
    }
  }

private:
  float left_mm_, top_mm_, pixel_mm_;
  int columns_, rows_;
  std::vector<Colour> pixels_;
};

void paint_contact(PadPicture &picture, const Model &model) {
  if (!model.contact() || !(model.contact()->flags & CONTACT_FLAG_FIT_VALID)) {
    return;
  }
  const wire_contact &contact = *model.contact();
  for (int row = 0; row < 2 * picture.rows(); row++) {
    for (int column = 0; column < picture.columns(); column++) {
      float dx = picture.x_mm(column) - contact.x_mm;
      float dy = picture.y_mm(row) - contact.y_mm;
      float exponent = -0.5f * (dx * dx + dy * dy) / (contact.sigma_mm * contact.sigma_mm);
      *picture.pixel(column, row) = heat(heat_part(contact.p0_Pa * std::exp(exponent)));
    }
  }
  if (!model.trail().empty()) {
    float newest_us = static_cast<float>(model.trail().back().t_us);
    for (const Model::Location &past : model.trail()) {
      float age = (newest_us - static_cast<float>(past.t_us)) / 1e6f;
      picture.paint(picture.column_of(past.x_mm), picture.pixel_row_of(past.y_mm), ACCENT,
                    0.8f * (1 - age));
    }
  }
  int column = picture.column_of(contact.x_mm);
  int row = picture.pixel_row_of(contact.y_mm);
  for (int arm = -3; arm <= 3; arm++) {
    picture.paint(column + arm, row, WHITE, 1);
    picture.paint(column, row + arm, WHITE, 1);
  }
}

/* Which cells the cross covers: numbers leave them free. */
bool is_under_cross(const PadPicture &picture, const Model &model, int column, int row) {
  if (!model.contact() || !(model.contact()->flags & CONTACT_FLAG_FIT_VALID)) {
    return false;
  }
  int cross_column = picture.column_of(model.contact()->x_mm);
  int cross_row = picture.pixel_row_of(model.contact()->y_mm);
  return (column == cross_column && std::abs(2 * row - cross_row) <= 3) ||
         (row == cross_row / 2 && std::abs(column - cross_column) <= 3);
}

void draw_readings(Canvas &canvas, PadPicture &picture, const Model &model, int left, int top) {
  const wire_info &info = *model.info();
  for (int k = 0; k < info.sensor_count; k++) {
    std::string text = "·";
    int width = 1;
    Colour colour = FAINT;
    int column = picture.column_of(info.x_mm[k]);
    int row = picture.pixel_row_of(info.y_mm[k]) / 2;
    if (model.raw() && k < model.raw()->sensor_count) {
      const wire_raw &raw = *model.raw();
      float pressure_Pa =
          static_cast<float>(raw.pressure_Pa_q10[k] - raw.baseline_Pa_q10[k]) / 1024.0f;
      Colour *behind = picture.pixel(column, 2 * row);
      bool bright = behind && behind->r * 3 + behind->g * 6 + behind->b > 1300;
      colour = bright ? BLACK : pressure_Pa > 500 ? WHITE : FAINT;
      text = number(pressure_Pa / 1000, pressure_Pa < 9950 ? 1 : 0);
      if (!(raw.valid >> k & 1u)) {
        text = "×";
        colour = BAD;
      } else if (raw.saturated >> k & 1u) {
        text = "max";
        colour = WARNING;
      }
      width = text == "×" ? 1 : static_cast<int>(text.size());
      if (text == "-0.0") {
        text = "0.0";
        width = 3;
      }
    }
    int at = column - width / 2;
    if (width == 1) {
      if (!is_under_cross(picture, model, at, row)) {
        canvas.text(left + at, top + row, text, text_style(colour, true));
      }
      continue;
    }
    for (int i = 0; i < width; i++) {
      if (!is_under_cross(picture, model, at + i, row)) {
        canvas.text(left + at + i, top + row, text.substr(static_cast<std::size_t>(i), 1),
                    text_style(colour, true));
      }
    }
  }
}

/* A text cell over the picture takes the mean of its two pixels as background. */
void draw_picture(Canvas &canvas, PadPicture &picture, int left, int top) {
  for (int row = 0; row < picture.rows(); row++) {
    for (int column = 0; column < picture.columns(); column++) {
      canvas.halves(left + column, top + row, *picture.pixel(column, 2 * row),
                    *picture.pixel(column, 2 * row + 1));
    }
  }
}

void draw_frame(Canvas &canvas, int left, int top, int width, int height, Colour colour) {
  Style style = text_style(colour);
  for (int i = 1; i <= width; i++) {
    canvas.text(left + i, top, "─", style);
    canvas.text(left + i, top + height + 1, "─", style);
  }
  for (int i = 1; i <= height; i++) {
    canvas.text(left, top + i, "│", style);
    canvas.text(left + width + 1, top + i, "│", style);
  }
  canvas.text(left, top, "╭", style);
  canvas.text(left + width + 1, top, "╮", style);
  canvas.text(left, top + height + 1, "╰", style);
  canvas.text(left + width + 1, top + height + 1, "╯", style);
}

void draw_title(Canvas &canvas, const Model &model, const std::string &note) {
  constexpr Colour bar = {32, 34, 50};
  Style plain = {FAINT, bar, false};
  canvas.text(0, 0, std::string(static_cast<std::size_t>(canvas.columns()), ' '), plain);
  int column = canvas.text(1, 0, "FINGERTIP ", {WHITE, bar, true});
  if (model.info()) {
    auto field = [](const char *text) { return std::string(text, strnlen(text, WIRE_TEXT_BYTES)); };
    column = canvas.text(column, 0, field(model.info()->serial) + " ", {INK, bar, false});
    column = canvas.text(column, 0, field(model.info()->board) + " ", plain);
  }
  if (!note.empty()) {
    canvas.text(column, 0, note, plain);
  }
  std::string state;
  Colour colour = BAD;
  auto silence_s = model.seconds_since_frame();
  switch (model.state()) {
  case Model::State::connecting:
    state = "waiting for an answer";
    colour = WARNING;
    break;
  case Model::State::gone:
    state = GONE_ADVICE;
    break;
  case Model::State::replay:
    state = "replay";
    colour = ACCENT;
    break;
  case Model::State::live:
    if (model.is_without_sensors()) {
      state = "no sensor answers";
    } else if (silence_s && *silence_s <= STALLED_s) {
      state = "live";
      colour = GOOD;
    } else {
      state = silence_s ? "STALLED for " + fixed(*silence_s, 1) + " s" : "no frames yet";
    }
    break;
  }
  int width = static_cast<int>(state.size()) + 4;
  canvas.text(canvas.columns() - width, 0, " ● " + state + " ", {colour, bar, true});
}

/* The right-hand side: one row after another, as far as there is room. */
class Panel {
public:
  Panel(Canvas &canvas, int left, int top, int bottom)
      : canvas_(canvas), left_(left), row_(top), bottom_(bottom) {}

  int left() const { return left_; }
  int row() const { return row_; }
  int width() const { return canvas_.columns() - left_ - 1; }
  int rows_left() const { return bottom_ - row_; }
  Canvas &canvas() { return canvas_; }

  /* Pairs of label and value. */
  void line(std::initializer_list<std::pair<std::string, std::string>> pairs, Colour colour = INK,
            bool bold = false) {
    int column = left_;
    for (const auto &[label, value] : pairs) {
      column = put(column, label + " ", text_style(FAINT));
      column = put(column, value, text_style(colour, bold)) + 2;
    }
    next();
  }
  int put(int column, const std::string &text, const Style &style) {
    return row_ < bottom_ ? canvas_.text(column, row_, text, style) : column;
  }
  void next() { row_++; }

private:
  Canvas &canvas_;
  int left_, row_, bottom_;
};

/* A horizontal bar in eighths of a cell. */
void draw_bar(Panel &panel, int column, int width, float part, Colour colour) {
  constexpr const char *eighths[] = {" ", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
  int filled =
      static_cast<int>(std::lround(std::clamp(part, 0.0f, 1.0f) * static_cast<float>(width) * 8));
  for (int i = 0; i < width; i++) {
    int here = std::clamp(filled - 8 * i, 0, 8);
    panel.put(column + i, here == 8 ? "█" : eighths[here], {colour, Colour{38, 40, 54}, false});
  }
}

void draw_force_history(Panel &panel, const Model &model, int rows) {
  constexpr const char *eighths[] = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  int width = panel.width();
  auto count = static_cast<int>(model.forces().size());
  for (int row = 0; row < rows; row++) {
    for (int i = 0; i < width; i++) {
      int index = count - width + i;
      if (index < 0) {
        continue;
      }
      const Model::Force &force = model.forces()[static_cast<std::size_t>(index)];
      float part = std::clamp(force.peak_N / FORCE_SCALE_N, 0.0f, 1.0f);
      int height = static_cast<int>(std::lround(part * static_cast<float>(8 * rows)));
      if (force.peak_N > 0) {
        height = std::max(height, 1);
      }
      int here = std::clamp(height - 8 * (rows - 1 - row), 0, 8);
      panel.put(panel.left() + i, eighths[here], text_style(force.slip ? BAD : ACCENT));
    }
    panel.next();
  }
}

void draw_lamp(Panel &panel, int column, bool on, const std::string &name, Colour colour) {
  panel.put(panel.put(column, on ? "● " : "○ ", text_style(on ? colour : RULE, true)), name,
            text_style(on ? colour : FAINT, on));
}

void draw_stages(Panel &panel, const wire_stages &stages) {
  struct Stage {
    const char *name;
    std::uint16_t us;
    Colour colour;
  };
  const Stage all[] = {{"convert", stages.convert_us, {72, 120, 200}},
                       {"read", stages.read_us, {60, 170, 170}},
                       {"queue", stages.queue_us, {110, 112, 130}},
                       {"cond", stages.condition_us, {120, 190, 90}},
                       {"fit", stages.fit_us, {230, 160, 60}},
                       {"contact", stages.contact_us, {210, 90, 120}}};
  panel.line({{"one frame", std::to_string(stages.total_us) + " µs"}});
  int width = panel.width();
  float total = std::max(1.0f, static_cast<float>(stages.total_us));
  float passed = 0;
  int from = 0;
  for (const Stage &stage : all) {
    passed += static_cast<float>(stage.us);
    int to =
        std::min(width, static_cast<int>(std::lround(passed / total * static_cast<float>(width))));
    for (int i = from; i < to; i++) {
      panel.put(panel.left() + i, "▆", text_style(stage.colour));
    }
    from = std::max(from, to);
  }
  panel.next();
  constexpr int place = 14; /* "convert 65535 " */
  int at = panel.left();
  for (const Stage &stage : all) {
    if (at + place - 1 > panel.left() + width) {
      panel.next();
      at = panel.left();
    }
    int column = panel.put(at, std::string(stage.name) + " ", text_style(stage.colour));
    panel.put(column, std::to_string(stage.us), text_style(INK));
    at += place;
  }
  panel.next();
}

/* Every flag has a place of its own, empty while it is off, so that nothing moves. */
void draw_flags(Panel &panel, std::uint32_t flags) {
  int column = panel.left();
  for (const FlagName &flag : flag_names()) {
    auto length = static_cast<int>(std::strlen(flag.name));
    if (column > panel.left() && column + length > panel.left() + panel.width()) {
      panel.next();
      column = panel.left();
    }
    if (flags & flag.bit) {
      panel.put(column, flag.name, text_style(flag.warning ? WARNING : FAINT, flag.warning));
    }
    column += length + 1;
  }
  panel.next();
}

void draw_panel(Panel &panel, const Model &model) {
  wire_contact contact{};
  if (model.contact()) {
    contact = *model.contact();
  }
  bool fitted = contact.flags & CONTACT_FLAG_FIT_VALID;
  bool sd = contact.flags & CONTACT_FLAG_UNCERTAINTY_VALID;
  auto value = [&](bool valid, const std::string &text, std::size_t width) {
    return right_aligned(valid ? text : "-", width);
  };

  int column = panel.put(panel.left(), "force ", text_style(FAINT));
  column = panel.put(column, value(fitted, number(contact.force_N, 2), 6), text_style(WHITE, true));
  panel.put(column, " N" + (sd ? "  sd " + number(contact.force_sd_N, 3) : ""), text_style(FAINT));
  panel.next();
  draw_bar(panel, panel.left(), panel.width(), contact.force_N / FORCE_SCALE_N,
           heat(0.35f + 0.65f * contact.force_N / FORCE_SCALE_N));
  panel.next();
  draw_force_history(panel, model, panel.rows_left() > 26 ? 4 : panel.rows_left() > 19 ? 2 : 1);

  panel.line({{"x", value(fitted, signed_number(contact.x_mm, 2), 6)},
              {"y", value(fitted, signed_number(contact.y_mm, 2), 6)},
              {"mm  sd", value(sd, number(contact.location_sd_mm, 3), 5)}},
             INK, true);
  panel.line({{"σ", value(fitted, number(contact.sigma_mm, 2), 5) + " mm"},
              {"peak", value(fitted, number(contact.p0_Pa / 1000, 1), 5) + " kPa"},
              {"residual", value(fitted, number(contact.residual_rms_Pa, 0), 4) + " Pa"}});
  draw_lamp(panel, panel.left(), contact.flags & CONTACT_FLAG_CONTACT, "CONTACT", GOOD);
  draw_lamp(panel, panel.left() + 11, model.slipped_lately(), "SLIP", BAD);
  bool slip_valid = contact.flags & CONTACT_FLAG_SLIP_VALID;
  column = panel.put(panel.left() + 19, value(slip_valid, number(contact.slip_mm, 2), 5),
                     text_style(INK));
  if (model.info()) {
    panel.put(column, " of " + number(model.info()->slip_threshold_mm, 2) + " mm",
              text_style(FAINT));
  }
  panel.next();
  draw_flags(panel, contact.flags);

  const LineStatistics &line = model.statistics();
  auto silence_s = model.seconds_since_frame();
  bool stalled = model.state() == Model::State::live && (!silence_s || *silence_s > STALLED_s);
  panel.line({{"frames/s", right_aligned(stalled ? "0.0" : fixed(model.frames_per_s(), 1), 6)},
              {"frames", std::to_string(model.frames())},
              {"time", fixed(model.seconds(), 1) + " s"}},
             stalled ? BAD : INK, true);
  bool damaged = line.dropped_packets + line.crc_errors + line.format_errors > 0;
  panel.line({{"dropped", std::to_string(line.dropped_packets)},
              {"CRC errors", std::to_string(line.crc_errors)},
              {"format errors", std::to_string(line.format_errors)}},
             damaged ? WARNING : INK);
  if (model.contact()) {
    draw_stages(panel, contact.stages);
  }
  if (model.health()) {
    const wire_health &health = *model.health();
    panel.line({{"CPU", fixed(health.cpu_busy_permille / 10.0, 1) + " %"},
                {"stack free", std::to_string(health.stack_free_bytes) + " B"},
                {"device drops", std::to_string(health.packets_dropped)}});
    bool trouble =
        health.bus_nacks + health.bus_timeouts + health.bus_recoveries + health.fit_failures > 0;
    panel.line({{"NACKs", std::to_string(health.bus_nacks)},
                {"timeouts", std::to_string(health.bus_timeouts)},
                {"recoveries", std::to_string(health.bus_recoveries)},
                {"no fit", std::to_string(health.fit_failures)}},
               trouble ? WARNING : INK);
  }
}

/* What the colours mean, with ticks at these pressures. */
void draw_scale(Canvas &canvas, int left, int row, int width) {
  for (int i = 0; i < width; i++) {
    canvas.text(left + i, row, "▀",
                text_style(heat(static_cast<float>(i) / static_cast<float>(width - 1))));
  }
  canvas.text(left, row + 1, "kPa", text_style(FAINT));
  int free_from = left + 4;
  for (int tick_kPa : {5, 20, 50, 100}) {
    std::string text = std::to_string(tick_kPa);
    float part = heat_part(static_cast<float>(tick_kPa) * 1000);
    int at = left + static_cast<int>(std::lround(part * static_cast<float>(width - 1))) -
             static_cast<int>(text.size()) / 2;
    at = std::min(at, left + width - static_cast<int>(text.size()));
    if (at >= free_from) {
      free_from = canvas.text(at, row + 1, text, text_style(FAINT)) + 1;
    }
  }
}

} // namespace

Canvas draw_monitor(const Model &model, const std::string &note, int columns, int rows) {
  Canvas canvas(columns, rows);
  draw_title(canvas, model, note);
  constexpr int panel_columns = 42;
  int panel_left = 1;
  if (model.info() && model.info()->sensor_count > 0) {
    PadPicture picture(*model.info(), columns - panel_columns - 4, rows - 6);
    paint_contact(picture, model);
    draw_frame(canvas, 0, 1, picture.columns(), picture.rows(),
               model.slipped_lately() ? BAD : RULE);
    draw_picture(canvas, picture, 1, 2);
    draw_readings(canvas, picture, model, 1, 2);
    draw_scale(canvas, 1, picture.rows() + 3, picture.columns());
    panel_left = picture.columns() + 4;
  }
  Panel panel(canvas, panel_left, 2, rows - 1);
  draw_panel(panel, model);
  if (model.state() != Model::State::replay) {
    canvas.text(panel_left, rows - 1, "q quit   t tare", text_style(FAINT));
  } else {
    canvas.text(panel_left, rows - 1, "q quit", text_style(FAINT));
  }
  return canvas;
}

} // namespace fingertip
