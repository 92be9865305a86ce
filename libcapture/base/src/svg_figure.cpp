#include <lumihull/internal/html.h>
#include <lumihull/internal/svg_figure.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace lumihull::internal {
namespace {

constexpr char kStyle[] =
    "svg{max-width:100%;height:auto}svg text{fill:#222;font-family:system-ui,sans-serif}.small{font-size:11px}"
    ".heading{font-size:14px;font-weight:600}.grid{stroke:#ddd;stroke-width:1}.arrow{stroke:#3b78d8;stroke-width:1}"
    ".wrong{stroke:#d9622b;stroke-width:1.2}.mean{stroke:#2c9c5a;stroke-width:2}.point{fill:#3b78d8;fill-opacity:.45}"
    ".outlier{fill:#d9622b}.bar{fill:#3b78d8}.level{stroke:#666;stroke-width:1.5;stroke-dasharray:6 4}"
    ".onmap{font-size:11px;paint-order:stroke;stroke:#fff;stroke-width:3px;stroke-linejoin:round}"
    "svg text.onmap{fill:#111}";

constexpr double kLeft = 62, kRight = 16, kTop = 46, kBottom = 46;  // around the data, px

std::string px(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::string painted(std::string_view style) {
  return style.starts_with("#") ? " fill=\"" + std::string(style) + "\"" : " class=\"" + std::string(style) + "\"";
}

}  // namespace

std::string number(const char* format, double value) {
  if (!std::isfinite(value)) return "–";
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

double tick_step(double range, int count) {
  if (!(range > 1e-300) || !std::isfinite(range)) return 1;
  const double raw = range / count, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double m : {1.0, 2.0, 5.0})
    if (m * power >= raw * 0.999) return m * power;
  return 10 * power;
}

double magnification(double size, double length) {
  if (!(size > 0)) return 1;
  return std::max(1.0, tick_step(length / size, 1));
}

std::string map_color(double t) {
  constexpr double kStops[][3] = {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}};
  t = std::clamp(t, 0.0, 1.0) * 4;
  const int i = std::min(3, int(t));
  char text[8];
  int rgb[3];
  for (int k = 0; k < 3; ++k) rgb[k] = int(kStops[i][k] + (t - i) * (kStops[i + 1][k] - kStops[i][k]) + 0.5);
  std::snprintf(text, sizeof text, "#%02x%02x%02x", unsigned(rgb[0]) & 255u, unsigned(rgb[1]) & 255u,
                unsigned(rgb[2]) & 255u);
  return text;
}

SvgFigure::SvgFigure(std::string title, double width, double height)
    : width_(width), height_(height), title_(std::move(title)) {}

double SvgFigure::x_of(double x) const { return kLeft + (x - x0_) / (x1_ - x0_) * (width_ - kLeft - kRight); }
double SvgFigure::y_of(double y) const {
  return height_ - kBottom - (y - y0_) / (y1_ - y0_) * (height_ - kTop - kBottom);
}

void SvgFigure::axes(double x0, double x1, double y0, double y1, const std::string& x_label, const std::string& y_label,
                     double least_step) {
  x0_ = x0, x1_ = x1 != x0 ? x1 : x0 + 1, y0_ = y0, y1_ = y1 != y0 ? y1 : y0 + 1;
  const double dx = std::max(least_step, tick_step(std::abs(x1_ - x0_), 8)), dy = tick_step(std::abs(y1_ - y0_), 6);
  const double left = std::min(x0_, x1_), right = std::max(x0_, x1_), low = std::min(y0_, y1_),
               high = std::max(y0_, y1_);
  for (double i = std::ceil(left / dx - 1e-9); i * dx <= right + 1e-9 * dx; ++i) {
    line(i * dx, y0_, i * dx, y1_, "grid");
    body_ += "<text class=\"small\" x=\"" + px(x_of(i * dx)) + "\" y=\"" + px(height_ - kBottom + 15) +
             "\" text-anchor=\"middle\">" + number("%.6g", i * dx + 0.0) + "</text>\n";
  }
  for (double i = std::ceil(low / dy - 1e-9); i * dy <= high + 1e-9 * dy; ++i) {
    line(x0_, i * dy, x1_, i * dy, "grid");
    body_ += "<text class=\"small\" x=\"" + px(kLeft - 6) + "\" y=\"" + px(y_of(i * dy) + 4) +
             "\" text-anchor=\"end\">" + number("%.6g", i * dy + 0.0) + "</text>\n";
  }
  body_ += "<text class=\"small\" x=\"" + px(0.5 * (kLeft + width_ - kRight)) + "\" y=\"" + px(height_ - 10) +
           "\" text-anchor=\"middle\">" + html_escaped(x_label) +
           "</text>\n<text class=\"small\" transform=\"translate(14 " + px(0.5 * (kTop + height_ - kBottom)) +
           ") rotate(-90)\" text-anchor=\"middle\">" + html_escaped(y_label) + "</text>\n";
}

void SvgFigure::line(double x0, double y0, double x1, double y1, std::string_view style) {
  const bool color = style.starts_with("#");
  body_ += (color ? "<line stroke-width=\"1.5\" stroke=\"" : "<line class=\"") + std::string(style) + "\" x1=\"" +
           px(x_of(x0)) + "\" y1=\"" + px(y_of(y0)) + "\" x2=\"" + px(x_of(x1)) + "\" y2=\"" + px(y_of(y1)) + "\"/>\n";
}

void SvgFigure::dot(double x, double y, double radius_px, std::string_view style) {
  body_ += "<circle" + painted(style) + " cx=\"" + px(x_of(x)) + "\" cy=\"" + px(y_of(y)) + "\" r=\"" + px(radius_px) +
           "\"/>\n";
}

void SvgFigure::box(double x0, double y0, double x1, double y1, std::string_view style) {
  const double a = x_of(x0), b = x_of(x1), c = y_of(y0), d = y_of(y1);
  body_ += "<rect shape-rendering=\"crispEdges\"" + painted(style) + " x=\"" + px(std::min(a, b)) + "\" y=\"" +
           px(std::min(c, d)) + "\" width=\"" + px(std::abs(b - a)) + "\" height=\"" + px(std::abs(d - c)) + "\"/>\n";
}

void SvgFigure::text(double x, double y, const std::string& words, std::string_view style, const char* anchor) {
  body_ += "<text class=\"" + std::string(style) + "\" x=\"" + px(x_of(x)) + "\" y=\"" + px(y_of(y) + 4) +
           "\" text-anchor=\"" + anchor + "\">" + html_escaped(words) + "</text>\n";
}

void SvgFigure::note(const std::string& words) { note_ = words; }

std::string SvgFigure::str() const { return drawn({}); }

std::string SvgFigure::standalone() const {
  return drawn("<style>" + std::string(kStyle) + "</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>");
}

std::string SvgFigure::drawn(const std::string& first) const {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + px(width_) + " " + px(height_) + "\" width=\"" +
         px(width_) + "\" height=\"" + px(height_) + "\" role=\"img\"><title>" + html_escaped(title_) + "</title>\n" +
         first + "<text class=\"heading\" x=\"" + px(kLeft) + "\" y=\"18\">" + html_escaped(title_) + "</text>\n" +
         "<text class=\"small\" x=\"" + px(kLeft) + "\" y=\"36\">" + html_escaped(note_) + "</text>\n" + body_ +
         "</svg>\n";
}

std::string SvgFigure::style_sheet() {
  return std::string(kStyle) +
         "@media (prefers-color-scheme:dark){svg text{fill:#e8e8e8}.grid{stroke:#353941}.level{stroke:#a0a0a0}}";
}

}  // namespace lumihull::internal
