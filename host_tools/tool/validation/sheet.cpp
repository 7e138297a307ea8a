#include "tool/validation/sheet.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::validating {
namespace {

constexpr double PACKAGE_mm = 3.3; /* of an MS5840, each way (De Clercq et al., RA-L 2022, III.A) */
constexpr double CROSS_mm = 1.5, RING_mm = 4.0, MARGIN_mm = 14.0;
constexpr double PAGE_WIDTH_mm = 210.0, PAGE_HEIGHT_mm = 297.0, POINTS_PER_mm = 72.0 / 25.4;
constexpr double SMALL_mm = 2.4, LINE_mm = 0.15, CIRCLE = 0.5523; /* of a quarter by a cubic */

/* What both kinds of file can draw; mm, y up. */
class Pen {
public:
  virtual ~Pen() = default;
  virtual void line(double x, double y, double to_x, double to_y) = 0;
  virtual void circle(double x, double y, double radius) = 0;
  virtual void text(double x, double y, const std::string &words) = 0;

  void box(double x, double y, double half) {
    line(x - half, y - half, x + half, y - half);
    line(x + half, y - half, x + half, y + half);
    line(x + half, y + half, x - half, y + half);
    line(x - half, y + half, x - half, y - half);
  }
};

struct Reach {
  double x = 0.5 * RULER_mm, y = 0.0;
};

Reach reach_of(const calibrating::Array &array) {
  Reach reach;
  for (std::size_t k = 0; k < array.sensors(); k++) {
    reach.x = std::max(reach.x, std::abs(array.x_mm[k]));
    reach.y = std::max(reach.y, std::abs(array.y_mm[k]));
  }
  return {reach.x + MARGIN_mm, reach.y + MARGIN_mm};
}

void draw(const calibrating::Array &array, Pen &pen) {
  for (std::size_t k = 0; k < array.sensors(); k++) {
    pen.box(array.x_mm[k], array.y_mm[k], 0.5 * PACKAGE_mm);
    pen.text(array.x_mm[k] + 2.0, array.y_mm[k] - 2.0, "s" + std::to_string(k));
  }
  const std::vector<Mark> marks = marks_of(array);
  for (std::size_t m = 0; m < marks.size(); m++) {
    const auto [x, y] = marks[m];
    pen.line(x - CROSS_mm, y, x + CROSS_mm, y);
    pen.line(x, y - CROSS_mm, x, y + CROSS_mm);
    pen.circle(x, y, 0.5 * RING_mm);
    pen.text(x + 2.2, y + 0.3, std::to_string(m + 1)); /* above the name of the sensor */
  }
  const Reach reach = reach_of(array);
  const double y = -reach.y + 6.0, left = -0.5 * RULER_mm;
  pen.line(left, y, -left, y);
  for (int mm = 0; mm <= static_cast<int>(RULER_mm); mm++) {
    pen.line(left + mm, y, left + mm, y + (mm % 10 == 0 ? 2.0 : 1.0));
  }
  pen.text(left, y - 3.0, fixed(RULER_mm, 0) + " mm: measure this line before you use the print");
  /* Which way round it lies. */
  const double top = reach.y - 3.0;
  pen.line(0.0, top - 8.0, 0.0, top);
  pen.line(-1.0, top - 2.0, 0.0, top);
  pen.line(1.0, top - 2.0, 0.0, top);
  pen.text(1.5, top - 2.0, "+y");
  const double right = reach.x - 3.0;
  pen.line(right - 8.0, 0.0, right, 0.0);
  pen.line(right - 2.0, -1.0, right, 0.0);
  pen.line(right - 2.0, 1.0, right, 0.0);
  pen.text(right - 3.0, 1.5, "+x");
}

class SvgPen : public Pen {
public:
  void line(double x, double y, double to_x, double to_y) override {
    body +=
        "  <path d=\"M" + fixed(x, 2) + " " + fixed(-y, 2) + "L" + fixed(to_x, 2) + " " + fixed(-to_y, 2) + "\"/>\n";
  }
  void circle(double x, double y, double radius) override {
    body += "  <circle cx=\"" + fixed(x, 2) + "\" cy=\"" + fixed(-y, 2) + "\" r=\"" + fixed(radius, 2) + "\"/>\n";
  }
  void text(double x, double y, const std::string &words) override {
    body += "  <text x=\"" + fixed(x, 2) + "\" y=\"" + fixed(-y, 2) + "\">" + words + "</text>\n";
  }
  std::string body;
};

class PdfPen : public Pen {
public:
  void line(double x, double y, double to_x, double to_y) override {
    body += at(x, y) + " m " + at(to_x, to_y) + " l S\n";
  }
  void circle(double x, double y, double r) override {
    const double c = CIRCLE * r;
    body += at(x + r, y) + " m " + at(x + r, y + c) + " " + at(x + c, y + r) + " " + at(x, y + r) + " c " +
            at(x - c, y + r) + " " + at(x - r, y + c) + " " + at(x - r, y) + " c " + at(x - r, y - c) + " " +
            at(x - c, y - r) + " " + at(x, y - r) + " c " + at(x + c, y - r) + " " + at(x + r, y - c) + " " +
            at(x + r, y) + " c S\n";
  }
  void text(double x, double y, const std::string &words) override {
    body += "BT /F " + fixed(SMALL_mm * POINTS_PER_mm, 2) + " Tf " + at(x, y) + " Td (" + words + ") Tj ET\n";
  }
  std::string body = fixed(LINE_mm * POINTS_PER_mm, 3) + " w\n";

private:
  static std::string at(double x, double y) {
    return fixed((0.5 * PAGE_WIDTH_mm + x) * POINTS_PER_mm, 3) + " " +
           fixed((0.5 * PAGE_HEIGHT_mm + y) * POINTS_PER_mm, 3);
  }
};

} // namespace

std::string sheet_svg(const calibrating::Array &array) {
  const Reach reach = reach_of(array);
  SvgPen pen;
  draw(array, pen);
  const std::string width = fixed(2.0 * reach.x, 2), height = fixed(2.0 * reach.y, 2);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "mm\" height=\"" + height + "mm\" viewBox=\"" +
         fixed(-reach.x, 2) + " " + fixed(-reach.y, 2) + " " + width + " " + height +
         "\">\n  <title>Template of a validation, 1:1</title>\n  <style>text { font: " + fixed(SMALL_mm, 1) +
         "px sans-serif } path, circle { stroke: #000; stroke-width: " + fixed(LINE_mm, 2) +
         "; fill: none }</style>\n  <rect x=\"" + fixed(-reach.x, 2) + "\" y=\"" + fixed(-reach.y, 2) + "\" width=\"" +
         width + "\" height=\"" + height + "\" fill=\"#fff\"/>\n" + pen.body + "</svg>\n";
}

std::string sheet_pdf(const calibrating::Array &array) {
  PdfPen pen;
  draw(array, pen);
  const std::string objects[] = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 " + fixed(PAGE_WIDTH_mm * POINTS_PER_mm, 3) + " " +
          fixed(PAGE_HEIGHT_mm * POINTS_PER_mm, 3) + "] /Resources << /Font << /F 4 0 R >> >> /Contents 5 0 R >>",
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
      "<< /Length " + std::to_string(pen.body.size()) + " >>\nstream\n" + pen.body + "endstream",
  };
  std::string text = "%PDF-1.4\n";
  std::string places = "0000000000 65535 f \n";
  std::size_t number = 0;
  for (const std::string &object : objects) {
    std::string place = std::to_string(text.size());
    place.insert(0, 10 - place.size(), '0');
    places += place + " 00000 n \n";
    text += std::to_string(++number) + " 0 obj\n" + object + "\nendobj\n";
  }
  const std::string count = std::to_string(number + 1);
  return text + "xref\n0 " + count + "\n" + places + "trailer\n<< /Size " + count + " /Root 1 0 R >>\nstartxref\n" +
         std::to_string(text.size()) + "\n%%EOF\n";
}

} // namespace fingertip::validating
