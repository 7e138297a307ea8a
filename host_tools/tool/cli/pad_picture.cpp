#include "tool/cli/pad_picture.hpp"

#include <vector>

namespace fingertip {

namespace {

/* Pressure of the brightest colour. The scale is the square root, so that a light touch shows. */
constexpr float FULL_SCALE_Pa = 100000.0f;
/* Steps of colour: fewer show bands, more send bytes for differences that no eye sees. */
constexpr float HEAT_STEPS = 20;
/* A pressure that a reader should notice. */
constexpr float NOTED_Pa = 500;
/* Brightness of a doubtful fit, over that of a trusted one. */
constexpr float DOUBTFUL_PART = 0.45f;
/* Length of the arrow whose tangential force is as large as the normal force: rubber slides at a
 * half to one of it, and the array is 36 mm long. */
constexpr float ARROW_mm = 30.0f;
/* A tangential force below this number of its standard deviations has no direction. */
constexpr float ARROW_SDS = 2.0f;
/* Brightness of the uncertain part of the arrow, over that of the certain one. */
constexpr float UNSURE_PART = 0.4f;

/* Perceptually ordered, dark to bright, for 0 to 1. */
Colour heat(float part) {
  constexpr Colour stops[] = {PAD,           {44, 18, 92},   {104, 24, 112}, {164, 46, 98},
                              {216, 76, 62}, {246, 130, 26}, {250, 196, 44}, {253, 252, 180}};
  constexpr int last = static_cast<int>(sizeof stops / sizeof *stops) - 1;
  float at = std::round(std::clamp(part, 0.0f, 1.0f) * HEAT_STEPS) / HEAT_STEPS * static_cast<float>(last);
  int below = std::min(static_cast<int>(at), last - 1);
  return mix(stops[below], stops[below + 1], at - static_cast<float>(below));
}

float heat_part(float pressure_Pa) { return std::sqrt(std::max(pressure_Pa, 0.0f) / FULL_SCALE_Pa); }

bool is_bright(const std::optional<Colour> &colour) { return colour && colour->r * 3 + colour->g * 6 + colour->b > 1300; }

class Picture : public PadScale {
public:
  Picture(const wire_info &info, int columns_available, int rows_available)
      : PadScale(info.x_mm, info.y_mm, info.sensor_count, columns_available, rows_available),
        pixels_(static_cast<std::size_t>(columns()) * static_cast<std::size_t>(rows()) * 2, PAD) {}

  int cells_of(float mm) const { return static_cast<int>(mm / pixel_mm()); }
  Colour &pixel(int column, int pixel_row) {
    return pixels_[static_cast<std::size_t>(pixel_row) * static_cast<std::size_t>(columns()) + static_cast<std::size_t>(column)];
  }
  void paint(int column, int pixel_row, Colour colour, float part) {
    if (column >= 0 && column < columns() && pixel_row >= 0 && pixel_row < 2 * rows()) {
      pixel(column, pixel_row) = mix(pixel(column, pixel_row), colour, part);
    }
  }
  /* Every pixel and its location. */
  template <typename Paint> void each(Paint &&paint) {
    for (int row = 0; row < 2 * rows(); row++) {
      for (int column = 0; column < columns(); column++) {
        Colour &at = pixel(column, row);
        at = paint(at, x_mm(column), y_mm(row));
      }
    }
  }

private:
  std::vector<Colour> pixels_;
};

/* The fit that may be drawn. */
const wire_contact *fit_of(const Model &model) {
  return model.is_current() && model.contact() && (model.contact()->flags & CONTACT_FLAG_FIT_VALID) ? &*model.contact() : nullptr;
}

float fitted_Pa(const wire_contact &contact, float x_mm, float y_mm) {
  float dx = x_mm - contact.x_mm, dy = y_mm - contact.y_mm;
  return contact.p0_Pa * std::exp(-0.5f * (dx * dx + dy * dy) / (contact.sigma_mm * contact.sigma_mm));
}

void paint_fit(Picture &picture, const Model &model, const wire_contact &contact) {
  picture.each([&](Colour, float x_mm, float y_mm) {
    Colour colour = heat(heat_part(fitted_Pa(contact, x_mm, y_mm)));
    return is_doubtful(contact) ? mix(PAD, colour, DOUBTFUL_PART) : colour;
  });
  if (!model.trail().empty()) {
    float newest_us = static_cast<float>(model.trail().back().t_us);
    for (const Model::Location &past : model.trail()) {
      float age = (newest_us - static_cast<float>(past.t_us)) / 1e6f;
      picture.paint(picture.column_of(past.x_mm), picture.pixel_row_of(past.y_mm), ACCENT, 0.2f * std::round(4 * (1 - age)));
    }
  }
}

/* Tangential force over normal force as an arrow from the contact: solid as far as it is for sure, around it where it
 * ends but for one standard deviation. A load that may be none is a round spot of that size. */
struct Arrow {
  float along_x, along_y, length_mm, sd_mm;
  Colour colour;
  float part; /* of the colour */

  explicit Arrow(const wire_contact &contact) {
    float size_N = std::hypot(contact.qx_N, contact.qy_N);
    bool has_direction = size_N > ARROW_SDS * contact.q_sd_N;
    along_x = has_direction ? contact.qx_N / size_N : 0;
    along_y = has_direction ? contact.qy_N / size_N : 0;
    length_mm = has_direction ? ARROW_mm * contact.tangential_ratio : 0;
    sd_mm = ARROW_mm * contact.q_sd_N / contact.force_N;
    bool doubtful = is_doubtful(contact);
    colour = doubtful ? WARNING : contact.flags & CONTACT_FLAG_SLIDING ? BAD : GOOD;
    part = doubtful ? DOUBTFUL_PART : 1;
  }
  bool has_direction() const { return length_mm > 0; }
  /* How much of a pixel so far from the contact is the arrow's. */
  float covers(float dx_mm, float dy_mm, float pixel_mm) const {
    float ahead_mm = dx_mm * along_x + dy_mm * along_y;
    float aside_mm = std::abs(dx_mm * along_y - dy_mm * along_x);
    if (has_direction() && ahead_mm >= 0 && ahead_mm <= length_mm - sd_mm && aside_mm <= 0.5f * pixel_mm) {
      return part;
    }
    bool in_cone = has_direction() && ahead_mm >= 0 && ahead_mm <= length_mm && aside_mm <= sd_mm * ahead_mm / length_mm;
    float from_end_mm = std::hypot(dx_mm - length_mm * along_x, dy_mm - length_mm * along_y);
    return in_cone || from_end_mm <= std::max(sd_mm, 0.5f * pixel_mm) ? UNSURE_PART * part : 0;
  }
  const char *head() const {
    constexpr const char *heads[] = {"→", "↗", "↑", "↖", "←", "↙", "↓", "↘"};
    constexpr float eighth_rad = 0.7853982f;
    return heads[std::lround(std::atan2(along_y, along_x) / eighth_rad + 8) % 8];
  }
};

void paint_arrow(Picture &picture, const wire_contact &contact, const Arrow &arrow) {
  picture.each([&](Colour before, float x_mm, float y_mm) {
    return mix(before, arrow.colour, arrow.covers(x_mm - contact.x_mm, y_mm - contact.y_mm, picture.pixel_mm()));
  });
}

/* A long contact, as long as it presses. */
void paint_edge(Picture &picture, const wire_contact &contact) {
  float angle_rad = contact.edge_angle_deg * 0.017453293f;
  float along_x = std::cos(angle_rad), along_y = std::sin(angle_rad);
  picture.each([&](Colour before, float x_mm, float y_mm) {
    float dx = x_mm - contact.x_mm, dy = y_mm - contact.y_mm;
    bool inside = std::abs(dx * along_x + dy * along_y) <= 0.5f * contact.edge_length_mm &&
                  std::abs(dx * along_y - dy * along_x) <= 0.5f * picture.pixel_mm();
    return inside ? mix(before, WHITE, UNSURE_PART) : before;
  });
}

/* The cells of a location's mark: a cross; of a doubtful one a ring that is open on all sides. Two contacts are two crosses. */
struct Mark {
  struct Cell {
    int column, row;
    const char *shape;
  };
  std::vector<Cell> cells;
  Colour colour;

  Mark(const Picture &picture, const wire_contact &contact) {
    int column = picture.column_of(contact.x_mm), row = picture.pixel_row_of(contact.y_mm) / 2;
    if (contact.flags & CONTACT_FLAG_TWO_CONTACTS) {
      colour = WARNING;
      const float places_mm[2][2] = {{contact.x1_mm, contact.y1_mm}, {contact.x2_mm, contact.y2_mm}};
      for (const auto &[x_mm, y_mm] : places_mm) {
        column = picture.column_of(x_mm), row = picture.pixel_row_of(y_mm) / 2;
        cells.insert(cells.end(), {{column - 1, row, "─"}, {column, row, "┼"}, {column + 1, row, "─"}});
      }
    } else if (is_doubtful(contact)) {
      colour = WARNING;
      cells = {{column - 2, row, "("}, {column + 2, row, ")"}, {column, row - 1, "╌"}, {column, row + 1, "╌"}};
    } else {
      colour = WHITE;
      cells = {{column - 2, row, "─"}, {column - 1, row, "─"}, {column, row, "┼"},    {column + 1, row, "─"},
               {column + 2, row, "─"}, {column, row - 1, "│"}, {column, row + 1, "│"}};
    }
  }
};

void draw_picture(Canvas &canvas, Picture &picture, int left, int top) {
  for (int row = 0; row < picture.rows(); row++) {
    for (int column = 0; column < picture.columns(); column++) {
      canvas.halves(left + column, top + row, picture.pixel(column, 2 * row), picture.pixel(column, 2 * row + 1));
    }
  }
}

std::string kPa(float pressure_Pa) {
  std::string text = number(pressure_Pa / 1000, pressure_Pa < 9950 ? 1 : 0);
  return text == "-0.0" ? "0.0" : text;
}

/* What the fit got of it: above its zero, over its gain. Nothing before there is a zero. */
std::optional<float> measured_Pa(const Model &model, int k) {
  const wire_raw &raw = *model.raw();
  if (!(raw.valid >> k & 1u) || !model.is_tared()) {
    return std::nullopt;
  }
  bool calibrated = model.info()->stored & WIRE_STORED_CALIBRATION;
  float gain = calibrated ? model.info()->calibration.sensors[k].gain : 1.0f;
  return static_cast<float>(raw.pressure_Pa_q10[k] - raw.baseline_Pa_q10[k]) / 1024.0f / gain;
}

struct Reading {
  std::string text = "-";
  Colour colour = FAINT;
  std::optional<float> pressure_Pa; /* measured */
};

Reading reading_of(const Model &model, int k) {
  if (!model.is_current() || !model.raw() || k >= model.raw()->sensor_count) {
    return {};
  }
  const wire_raw &raw = *model.raw();
  if (!(raw.valid >> k & 1u)) {
    return {"×", BAD, std::nullopt};
  }
  if (raw.saturated >> k & 1u) {
    return {"max", WARNING, FULL_SCALE_Pa};
  }
  auto pressure_Pa = measured_Pa(model, k);
  if (!pressure_Pa) {
    return {};
  }
  return {kPa(*pressure_Pa), *pressure_Pa > NOTED_Pa ? WHITE : INK, pressure_Pa};
}

void draw_sensor(Canvas &canvas, const Picture &picture, const Model &model, int k, int left, int top) {
  const wire_info &info = *model.info();
  float pitch_mm = info.pitch_mm > 0 ? info.pitch_mm : 10;
  int width = std::clamp(picture.cells_of(pitch_mm) - 1, 3, 5);
  bool has_room_for_fit = picture.cells_of(pitch_mm) >= 6; /* three rows */
  int column = left + picture.column_of(info.x_mm[k]) - width / 2;
  int row = top + picture.pixel_row_of(info.y_mm[k]) / 2 - 1;
  Reading reading = reading_of(model, k);
  bool doubtful = model.is_current() && model.raw() && (model.raw()->doubtful >> k & 1u);
  std::string name = std::to_string(k) + (doubtful ? "?" : "");
  auto put = [&](int line, const std::string &text, Colour colour, bool bold, std::optional<Colour> back) {
    int pad = std::max(0, (width - columns_of(text) + 1) / 2);
    for (int i = 0; back && i < width; i++) {
      canvas.text(column + i, row + line, " ", {std::nullopt, back, false});
    }
    canvas.text(column + pad, row + line, text, {colour, back, bold});
  };
  const Colour tile = reading.pressure_Pa ? heat(heat_part(*reading.pressure_Pa)) : PAD;
  bool bright = is_bright(tile);
  put(0, name, doubtful ? WARNING : bright ? BLACK : FAINT, doubtful, tile);
  put(1, reading.text, bright ? BLACK : reading.colour, true, tile);
  const wire_contact *fit = fit_of(model);
  if (has_room_for_fit && fit) {
    const Canvas::Cell &behind =
        canvas.cell(std::clamp(column + width / 2, 0, canvas.columns() - 1), std::clamp(row + 2, 0, canvas.rows() - 1));
    put(2, kPa(fitted_Pa(*fit, info.x_mm[k], info.y_mm[k])), is_bright(behind.style.back) ? BLACK : ACCENT, false, std::nullopt);
  }
}

/* The frame; its upper side has the legend of the numbers, its lower that of the colours. */
void draw_frame(Canvas &canvas, const Area &area, const Model &model) {
  bool slides = model.slid_lately() && model.is_current();
  bool moves = model.moved_lately() && model.is_current();
  bool alarm = slides || (model.slipped_lately() && model.is_current());
  Style style = text_style(alarm ? BAD : moves ? WARNING : RULE);
  int right = area.left + area.width - 1, bottom = area.top + area.height - 1;
  for (int i = 1; i + 1 < area.width; i++) {
    canvas.text(area.left + i, area.top, "─", style);
  }
  for (int i = 1; i + 1 < area.height; i++) {
    canvas.text(area.left, area.top + i, "│", style);
    canvas.text(right, area.top + i, "│", style);
  }
  canvas.text(area.left, area.top, "╭", style);
  canvas.text(right, area.top, "╮", style);
  canvas.text(area.left, bottom, "╰", style);
  canvas.text(right, bottom, "╯", style);
  if (slides || moves) {
    std::string warning = slides ? " SLIDING " : " MOVING ";
    canvas.text(area.left + std::max(1, (area.width - columns_of(warning)) / 2), area.top, warning,
                {slides ? WHITE : BLACK, slides ? BAD : WARNING, true});
  }
  for (const char *legend : {"no., measured, fitted", "no., kPa, fit", "no., kPa"}) {
    if (!slides && !moves && columns_of(legend) <= area.width - 2) {
      canvas.text(area.left + 1, area.top, legend, text_style(FAINT));
      break;
    }
  }
  int width = area.width - 6; /* "kPa " before it */
  int left = canvas.text(area.left + 1, bottom, "kPa ", text_style(FAINT));
  for (int i = 0; i < width; i++) {
    Colour colour = heat(static_cast<float>(i) / static_cast<float>(std::max(width - 1, 1)));
    canvas.halves(left + i, bottom, colour, colour);
  }
  int free_from = left;
  for (int tick_kPa : {5, 20, 50, 100}) {
    std::string text = std::to_string(tick_kPa);
    float part = heat_part(static_cast<float>(tick_kPa) * 1000);
    auto length = static_cast<int>(text.size());
    int at = std::min(left + static_cast<int>(std::lround(part * static_cast<float>(width - 1))) - length / 2, left + width - length);
    if (at >= free_from) {
      Colour behind = heat(part);
      free_from = canvas.text(at, bottom, text, text_style(is_bright(behind) ? BLACK : WHITE)) + 1;
    }
  }
}

/* A mark covers no number. */
bool is_free(const Canvas::Cell &cell) { return cell.halves || cell.character == " "; }

} // namespace

Area draw_pad(Canvas &canvas, const Area &available, const Model &model) {
  Picture picture(*model.info(), available.width - 2, available.height - 2);
  Area area = {available.left, available.top, picture.columns() + 2, picture.rows() + 2};
  const wire_contact *fit = fit_of(model);
  std::optional<Arrow> arrow;
  if (fit) {
    paint_fit(picture, model, *fit);
    if (fit->flags & CONTACT_FLAG_EDGE) {
      paint_edge(picture, *fit);
    }
    if ((fit->flags & CONTACT_FLAG_TANGENTIAL_VALID) && fit->force_N > 0) {
      arrow.emplace(*fit);
      paint_arrow(picture, *fit, *arrow);
    }
  }
  draw_frame(canvas, area, model);
  draw_picture(canvas, picture, area.left + 1, area.top + 1);
  for (int k = 0; k < model.info()->sensor_count; k++) {
    draw_sensor(canvas, picture, model, k, area.left + 1, area.top + 1);
  }
  auto place = [&](int column, int row, const char *shape, Colour colour) {
    bool inside = column >= 0 && column < picture.columns() && row >= 0 && row < picture.rows();
    bool free = inside && is_free(canvas.cell(area.left + 1 + column, area.top + 1 + row));
    if (free) {
      canvas.text(area.left + 1 + column, area.top + 1 + row, shape, text_style(colour, true));
    }
    return free;
  };
  if (arrow) {
    /* At the end, or as near to it as there is room, outside of the location's own cell. */
    bool placed = false;
    for (float mm = arrow->length_mm; !placed && mm > 2 * picture.pixel_mm(); mm -= picture.pixel_mm()) {
      placed = place(picture.column_of(fit->x_mm + mm * arrow->along_x), picture.pixel_row_of(fit->y_mm + mm * arrow->along_y) / 2,
                     arrow->head(), arrow->colour);
    }
  }
  if (fit) {
    Mark mark(picture, *fit);
    for (const auto &[column, row, shape] : mark.cells) {
      place(column, row, shape, mark.colour);
    }
  }
  return area;
}

} // namespace fingertip
