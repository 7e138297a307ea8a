#include "tool/cli/monitor.hpp"

#include "libfingertip/packet_fields.hpp"
#include "tool/cli/chart.hpp"
#include "tool/cli/pad_picture.hpp"
#include "tool/cli/panel.hpp"

#include <algorithm>

namespace fingertip {

namespace {

/* The least that a fingertip among several is given. */
constexpr int LEAST_COLUMNS = 40, LEAST_ROWS = 22;
/* From this width on a line has several numbers, below it one. */
constexpr int WIDE = 60;
/* For firmware that could estimate tangential force. */
constexpr const char *NO_PAD = "no pad profile:", *PAD_COMMAND = "fingertip pad";

/* "+3.20": always with a sign, so that columns do not move. */
std::string signed_number(float value, int digits) {
  std::string text = number(value, digits);
  return text[0] == '-' ? text : "+" + text;
}

/* Name at the left, state at the right. */
void draw_header(Canvas &canvas, const Area &area, const Model &model, bool alone) {
  draw_bar(canvas, area);
  int column = area.left + 1;
  if (alone) {
    column = canvas.text(column, area.top, "FINGERTIP ", {WHITE, BAR, true});
  }
  if (model.info()) {
    column = canvas.text(column, area.top, text_field(model.info()->serial) + " ", {INK, BAR, !alone});
    canvas.text(column, area.top, text_field(model.info()->board) + " ", {FAINT, BAR, false});
  } else {
    canvas.text(column, area.top, printable(model.source()), {FAINT, BAR, false});
  }
  const auto [state, colour, fine] = state_of(model);
  std::string text = first_columns(" ● " + state, area.width - 1) + " ";
  canvas.text(area.left + area.width - columns_of(text), area.top, text, {colour, BAR, true});
}

/* The values of the last frame, as far as it has them. */
struct Numbers {
  std::optional<std::string> force, force_sd, x, y, location_sd, sigma, peak, residual, slip;
  std::optional<std::string> qx, qy, q_sd, ratio, ratio_sd;
  std::optional<std::string> stronger, weaker, edge;
  bool doubtful = false;
  std::uint32_t flags = 0;
};

std::string contact_in_words(float x_mm, float y_mm, float sd_mm, float force_N) {
  return signed_number(x_mm, 1) + ", " + signed_number(y_mm, 1) + " mm, sd " + number(sd_mm, 2) + "; " + number(force_N, 2) + " N";
}

Numbers numbers_of(const Model &model) {
  Numbers numbers;
  if (!model.is_current() || !model.contact()) {
    return numbers;
  }
  const wire_contact &contact = *model.contact();
  numbers.flags = contact.flags;
  numbers.doubtful = is_doubtful(contact);
  if (contact.flags & CONTACT_FLAG_FIT_VALID) {
    bool least = contact.flags & CONTACT_FLAG_FORCE_LOWER_BOUND;
    numbers.force = (least ? "≥" : "") + number(contact.force_N, 2);
    numbers.x = signed_number(contact.x_mm, 2);
    numbers.y = signed_number(contact.y_mm, 2);
    numbers.sigma = number(contact.sigma_mm, 2);
    numbers.peak = number(contact.p0_Pa / 1000, 1);
    numbers.residual = number(contact.residual_rms_Pa, 0);
  }
  if (contact.flags & CONTACT_FLAG_UNCERTAINTY_VALID) {
    numbers.force_sd = number(contact.force_sd_N, 3);
    numbers.location_sd = number(contact.location_sd_mm, 3);
  }
  if (contact.flags & CONTACT_FLAG_SLIP_VALID) {
    numbers.slip = number(contact.slip_mm, 2);
  }
  if (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) {
    numbers.qx = signed_number(contact.qx_N, 2);
    numbers.qy = signed_number(contact.qy_N, 2);
    numbers.q_sd = number(contact.q_sd_N, 3);
    numbers.ratio = number(contact.tangential_ratio, 3);
    if (contact.force_N > 0) {
      numbers.ratio_sd = number(contact.q_sd_N / contact.force_N, 3);
    }
  }
  if (contact.flags & CONTACT_FLAG_TWO_CONTACTS) {
    numbers.stronger = contact_in_words(contact.x1_mm, contact.y1_mm, contact.location1_sd_mm, contact.force1_N);
    numbers.weaker = contact_in_words(contact.x2_mm, contact.y2_mm, contact.location2_sd_mm, contact.force2_N);
  }
  if (contact.flags & CONTACT_FLAG_EDGE) {
    numbers.edge = signed_number(contact.edge_angle_deg, 1) + "°, sd " + number(contact.edge_angle_sd_deg, 1) + "; " +
                   number(contact.edge_length_mm, 1) + " mm";
  }
  return numbers;
}

std::string in_words(std::uint32_t flag, float limit_mm) {
  static constexpr std::pair<std::uint32_t, const char *> words[] = {
      {CONTACT_FLAG_LOW_SIGNAL, "hardly above the noise"},      {CONTACT_FLAG_FLAT, "no peak, no location"},
      {CONTACT_FLAG_UNCERTAIN, "may be off by more than "},     {CONTACT_FLAG_MODEL, "not one round contact"},
      {CONTACT_FLAG_SATURATED, "a sensor is beyond its range"}, {CONTACT_FLAG_FORCE_LOWER_BOUND, "the force is at least this"},
      {CONTACT_FLAG_SENSOR_MASKED, "a sensor is left out"},     {CONTACT_FLAG_AT_BOUND, "the fit stopped at its limit"},
      {CONTACT_FLAG_ELONGATED, "the contact is not round"},     {CONTACT_FLAG_ZERO_DOUBTFUL, "the zero may have moved"},
      {CONTACT_FLAG_SENSOR_DOUBTFUL, "a sensor is in doubt"}};
  const std::string limit = limit_mm > 0 ? number(limit_mm, 2) + " mm" : "the limit";
  for (auto [bit, text] : words) {
    if (bit == flag) {
      return text + (flag == CONTACT_FLAG_UNCERTAIN ? limit : "");
    }
  }
  return "the numbers deserve less trust";
}

/* In words where there is room for them, else their names, else as many as fit. */
void draw_warnings(Canvas &canvas, const Area &area, const Model &model, std::uint32_t flags) {
  if (area.height < 1 || area.width < 1) {
    return;
  }
  if ((flags & CONTACT_FLAG_CONTACT) && !(flags & CONTACT_FLAG_FIT_VALID)) {
    canvas.text(area.left, area.top, first_columns("contact, no location", area.width), text_style(WARNING, true));
    draw_warnings(canvas, {area.left, area.top + 1, area.width, area.height - 1}, model, flags & warning_flags());
    return;
  }
  std::vector<std::string> words, names;
  for (const FlagName &flag : flag_names()) {
    if (flag.warning && (flags & flag.bit)) {
      names.emplace_back(flag.name);
      words.push_back(names.back() + ", " + in_words(flag.bit, model.info() ? model.info()->location_limit_mm : 0));
    }
  }
  auto lines = flowed(words, "; ", area.width);
  auto fits = [&] {
    return static_cast<int>(lines.size()) <= area.height &&
           std::all_of(lines.begin(), lines.end(), [&](const std::string &line) { return columns_of(line) <= area.width; });
  };
  if (!fits()) {
    lines = flowed(names, " ", area.width);
  }
  bool cut = static_cast<int>(lines.size()) > area.height;
  for (int i = 0; i < std::min(area.height, static_cast<int>(lines.size())); i++) {
    std::string text = lines[static_cast<std::size_t>(i)];
    bool last = cut && i + 1 == area.height;
    canvas.text(area.left, area.top + i, last ? first_columns(text, area.width - 4) + " ..." : first_columns(text, area.width),
                text_style(WARNING, true));
  }
}

std::string slip_unit(const Model &model) {
  return model.info() && model.info()->slip_threshold_mm > 0 ? "of " + number(model.info()->slip_threshold_mm, 2) + " mm" : "mm";
}

/* The row after the last that it drew. */
int draw_numbers(Canvas &canvas, const Area &area, const Model &model, const Numbers &numbers) {
  int left = area.left, row = area.top;
  bool doubtful = numbers.doubtful;
  bool contact = numbers.flags & CONTACT_FLAG_CONTACT;
  bool slipped = model.is_current() && model.slipped_lately();
  bool slid = model.is_current() && model.slid_lately();
  bool moved = model.is_current() && model.moved_lately();
  bool from_touch = numbers.flags & CONTACT_FLAG_TANGENTIAL_FROM_TOUCH;
  std::string of = slip_unit(model);
  auto lamps_of_motion = [&](int column) {
    column = draw_lamp(canvas, column, row, moved, "MOVING", WARNING);
    return draw_lamp(canvas, column + 2, row, slid, "SLIDING", BAD);
  };
  struct Place {
    int column;
    const char *label;
    std::optional<std::string> value;
    int width;
    const char *unit;
    bool may_doubt = true;
  };
  auto quantities = [&](const std::vector<Place> &places) {
    for (const auto &[column, label, value, width, unit, may_doubt] : places) {
      draw_quantity(canvas, left + column, row, {label, value, width, unit, may_doubt && doubtful});
    }
    row++;
  };
  auto line = [&](const char *label, const std::optional<std::string> &text) {
    int column = canvas.text(left, row, label, text_style(FAINT));
    canvas.text(column, row, first_columns(*text, area.left + area.width - column), text_style(INK));
    row++;
  };
  if (area.width < WIDE - 20) {
    quantities({{0, "force", numbers.force, 8, "N"}});
    quantities({{0, "   sd", numbers.force_sd, 8, "N", false}});
    quantities({{0, "x    ", numbers.x, 8, "mm"}});
    quantities({{0, "y    ", numbers.y, 8, "mm"}});
    quantities({{0, "   sd", numbers.location_sd, 8, "mm", false}});
    quantities({{0, "σ    ", numbers.sigma, 8, "mm"}});
    quantities({{0, "slip ", numbers.slip, 8, "mm"}});
    draw_lamp(canvas, draw_lamp(canvas, left, row, contact, "CONTACT", GOOD) + 2, row, slipped, "SLIP", BAD);
    row++;
    if (!model.estimates_tangential()) {
      return row;
    }
    lamps_of_motion(left);
    row++;
    if (!model.has_pad()) {
      canvas.text(left, row, NO_PAD, text_style(WARNING));
      canvas.text(left, row + 1, PAD_COMMAND, text_style(WARNING));
      return row + 2;
    }
    if (numbers.stronger) {
      line("1 ", numbers.stronger);
      line("2 ", numbers.weaker);
      return row;
    }
    quantities({{10, "", numbers.qy, 6, "N"}, {0, "q", numbers.qx, 6, ""}});
    quantities({{0, from_touch ? "ΔQ/F" : "Q/F ", numbers.ratio, 5, ""}, {11, "sd", numbers.ratio_sd, 5, "", false}});
    return row;
  }
  constexpr int second = 22;
  quantities({{0, "force", numbers.force, 9, "N"}, {second, "sd", numbers.force_sd, 6, "N", false}});
  quantities({{0, "x", numbers.x, 7, ""}, {11, "y", numbers.y, 7, ""}, {second, "sd", numbers.location_sd, 6, "mm", false}});
  quantities({{0, "σ", numbers.sigma, 7, ""}, {11, "peak", numbers.peak, 6, "kPa"}, {28, "residual", numbers.residual, 5, "Pa", false}});
  if (numbers.stronger) {
    line("1 ", numbers.stronger);
    line("2 ", numbers.weaker);
  } else if (model.has_pad()) {
    canvas.text(left + second + 13, row, from_touch ? "since touch" : "", text_style(WARNING));
    quantities({{0, "qx", numbers.qx, 6, ""}, {11, "qy", numbers.qy, 6, ""}, {second, "sd", numbers.q_sd, 6, "N", false}});
    lamps_of_motion(left + second + 4);
    quantities({{0, "Q/F", numbers.ratio, 5, ""}, {11, "sd", numbers.ratio_sd, 6, "", false}});
    if (numbers.edge) {
      line("edge ", numbers.edge);
    }
  } else if (model.estimates_tangential()) {
    canvas.text(left, row, std::string(NO_PAD) + " " + PAD_COMMAND, text_style(WARNING));
    row++;
    lamps_of_motion(left);
    row++;
  }
  int column = draw_lamp(canvas, left, row, contact, "CONTACT", GOOD);
  column = draw_lamp(canvas, column + 2, row, slipped, "SLIP", BAD);
  column = draw_quantity(canvas, column + 1, row, {"", numbers.slip, 5, of.c_str(), doubtful});
  std::string zero = model.is_tared() ? "tared" : "no zero yet";
  canvas.text(column + 2, row, model.is_current() ? zero : "", text_style(model.is_tared() ? FAINT : WARNING));
  return row + 1;
}

struct Item {
  std::string label, value;
  int width; /* of the value */
  Colour colour = INK;
};

/* Statistics of the line, the firmware and the bus, the most important first. */
std::vector<Item> items_of(const Model &model) {
  const LineStatistics &line = model.statistics();
  auto count = [](const char *label, std::uint64_t value, bool trouble, int width) {
    return Item{label, std::to_string(value), width, trouble && value > 0 ? WARNING : INK};
  };
  auto silence_s = model.seconds_since_frame();
  bool stalled = model.state() == Model::State::live && silence_s && !model.is_current();
  bool rate_known = model.is_current() || stalled;
  std::vector<Item> items = {{"frames/s",
                              !rate_known ? "-"
                              : stalled   ? "0.0"
                                          : fixed(model.frames_per_s(), 1),
                              6, stalled ? BAD : INK},
                             count("dropped", line.dropped_packets, true, 4),
                             count("CRC errors", line.crc_errors, true, 3),
                             {"time", fixed(model.seconds(), 1) + " s", 8},
                             count("frames", model.frames(), false, 7),
                             count("format errors", line.format_errors, true, 3)};
  if (model.contact()) {
    const wire_stages &stages = model.contact()->stages;
    items.push_back({"one frame", std::to_string(stages.total_us) + " µs", 8});
    const std::pair<const char *, std::uint16_t> all[] = {{"convert", stages.convert_us}, {"read", stages.read_us},
                                                          {"queue", stages.queue_us},     {"condition", stages.condition_us},
                                                          {"fit", stages.fit_us},         {"contact", stages.contact_us}};
    for (const auto &[name, us] : all) {
      items.push_back(count(name, us, false, 4));
    }
  }
  if (model.health()) {
    const wire_health &health = *model.health();
    items.push_back({"CPU", fixed(health.cpu_busy_permille / 10.0, 1) + " %", 6});
    items.push_back(count("NACKs", health.bus_nacks, true, 3));
    items.push_back(count("timeouts", health.bus_timeouts, true, 3));
    items.push_back(count("recoveries", health.bus_recoveries, true, 3));
    items.push_back(count("no fit", health.fit_failures, true, 3));
    items.push_back(count("device drops", health.packets_dropped, true, 3));
    items.push_back(count("stack free", health.stack_free_bytes, false, 4));
  }
  return items;
}

/* Draws as many as fit. Returns the rows that all would take. */
int draw_items(Canvas *canvas, const Area &area, const std::vector<Item> &items) {
  int column = area.left, row = 0;
  for (const Item &item : items) {
    int length = columns_of(item.label) + 1 + std::max(item.width, columns_of(item.value));
    if (column > area.left && column + length > area.left + area.width) {
      row++;
      column = area.left;
    }
    if (canvas && row < area.height) {
      int at = canvas->text(column, area.top + row, item.label + " ", text_style(FAINT));
      canvas->text(at, area.top + row, right_aligned(item.value, item.width), text_style(item.colour, item.colour == BAD));
    }
    column += length + 2;
  }
  return row + 1;
}

/* Rows, from the first: header; pad and, right of it, numbers, warnings and traces; items. Where it
 * is narrow the traces lie below the pad, and where there is room below the pad the items do. */
void draw_fingertip(Canvas &canvas, const Area &area, const Model &model, bool alone) {
  draw_header(canvas, area, model, alone);
  Numbers numbers = numbers_of(model);
  auto items = items_of(model);
  Area body = {area.left, area.top + 1, area.width, area.height - 1};
  int bottom = body.top + body.height;
  bool wide = area.width >= WIDE;
  int item_rows = std::min(draw_items(nullptr, {0, 0, area.width - 2, 0}, items),
                           wide ? std::max(2, (body.height + 3) / 6) : std::max(2, body.height / 10));
  Area pad = {body.left, body.top, 0, 0};
  if (model.info() && model.info()->sensor_count > 0) {
    int columns = wide ? std::min(area.width - 50, area.width * 2 / 5) : area.width * 2 / 5;
    pad = draw_pad(canvas, {body.left, body.top, columns, body.height - item_rows}, model);
  }
  int left = pad.left + pad.width + 1;
  Area right = {left, body.top, area.left + area.width - left, body.height};
  int below = pad.top + pad.height;
  Area below_pad = {pad.left + 1, below + 1, pad.width - 2, bottom - below - 1};
  bool items_below_pad = wide && draw_items(nullptr, below_pad, items) <= below_pad.height;
  int traces_end = bottom;
  if (items_below_pad) {
    draw_items(&canvas, below_pad, items);
  } else {
    traces_end = bottom - item_rows;
    draw_items(&canvas, {area.left + 1, traces_end, area.width - 2, item_rows}, items);
  }
  int row = draw_numbers(canvas, right, model, numbers);
  if (wide) {
    constexpr int warning_rows = 3; /* all names there are, where it is narrowest */
    draw_warnings(canvas, {left, row, right.width - 1, warning_rows}, model, numbers.flags);
    row += warning_rows;
    draw_traces(canvas, {left, row, right.width - 1, traces_end - row}, model);
  } else {
    draw_warnings(canvas, {left, row, right.width - 1, below - row}, model, numbers.flags);
    draw_traces(canvas, {area.left, std::max(below, row), area.width - 1, traces_end - std::max(below, row)}, model);
  }
}

void draw_small(Canvas &canvas, const std::vector<Model> &models, const Caption &caption) {
  int row = 1;
  for (const Model &model : models) {
    Numbers numbers = numbers_of(model);
    const auto [state, colour, fine] = state_of(model);
    canvas.text(0, row++, (model.info() ? text_field(model.info()->serial) + " " : "") + state, text_style(colour));
    int column = 0;
    for (const Quantity &quantity :
         {Quantity{"force", numbers.force, 6, "N ", numbers.doubtful}, Quantity{"x", numbers.x, 6, "", numbers.doubtful},
          Quantity{"y", numbers.y, 6, "", numbers.doubtful}}) {
      column = draw_quantity(canvas, column, row, quantity);
    }
    row++;
  }
  draw_caption(canvas, caption);
}

} // namespace

Canvas draw_monitor(const std::vector<Model> &models, const Caption &caption, int columns, int rows) {
  Canvas canvas(columns, rows);
  if (is_too_small(canvas)) {
    draw_small(canvas, models, caption);
    return canvas;
  }
  if (models.size() == 1) {
    draw_fingertip(canvas, {0, 0, columns, rows - 1}, models[0], true);
    draw_caption(canvas, caption);
    return canvas;
  }
  auto count = static_cast<int>(models.size());
  int across = std::min(count, columns / LEAST_COLUMNS);
  int down = std::min((count + across - 1) / across, (rows - 2) / LEAST_ROWS);
  int shown = std::min(count, across * down);
  draw_bar(canvas, {0, 0, columns, 1});
  int column = canvas.text(1, 0, "FINGERTIP ", {WHITE, BAR, true});
  canvas.text(column, 0,
              shown < count ? std::to_string(shown) + " of " + std::to_string(count) + " fingertips, a larger window shows more"
                            : std::to_string(count) + " fingertips",
              {shown < count ? WARNING : FAINT, BAR, false});
  int width = columns / across, height = (rows - 2) / down;
  for (int i = 0; i < shown; i++) {
    draw_fingertip(canvas, {i % across * width, 1 + i / across * height, width - (across > 1 ? 1 : 0), height},
                   models[static_cast<std::size_t>(i)], false);
  }
  draw_caption(canvas, caption);
  return canvas;
}

} // namespace fingertip
