#include "svg_plot.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <initializer_list>
#include <iterator>
#include <limits>

namespace lumihull::bench {
namespace {

constexpr double kWidth = 900, kHeight = 560;
constexpr double kLeft = 66, kRight = 670, kTop = 48, kBottom = 500;  // of the area with the curves
constexpr double kLabels = 702, kLine = 18;  // the labels' left, and the least distance between
// On white and on near-black each has a contrast of at least 3.
constexpr const char* kColors[] = {"#3b78d8", "#d9622b", "#2c9c5a", "#b15dc9", "#a98514", "#7f7f7f"};
constexpr std::size_t kColorCount = std::size(kColors);

constexpr const char* kStyle =
    "<style>.back{fill:#fff}.ink{fill:#222}.faint{fill:#666}.grid{stroke:#ddd}.level{stroke:#666}text{font-size:13px;"
    "font-family:system-ui,sans-serif}.small{font-size:11px}.title{font-size:15px;font-weight:600}@media "
    "(prefers-color-scheme:dark){.back{fill:#15171c}.ink{fill:#e8e8e8}.faint{fill:#a0a0a0}.grid{stroke:#353941}"
    ".level{stroke:#a0a0a0}}</style>\n";

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string px(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  return out;
}

std::string text_at(double x, double y, const std::string& text, const char* style, const char* anchor = "start") {
  return "<text class=\"" + std::string(style) + "\" x=\"" + px(x) + "\" y=\"" + px(y) + "\" text-anchor=\"" + anchor +
         "\">" + escaped(text) + "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, const std::string& attributes) {
  return "<line x1=\"" + px(x1) + "\" y1=\"" + px(y1) + "\" x2=\"" + px(x2) + "\" y2=\"" + px(y2) + "\" " + attributes +
         "/>\n";
}

/// Curves differ by shape as well as by colour.
std::string marker(std::size_t curve, double x, double y) {
  const std::string fill = "\" fill=\"" + std::string(kColors[curve % kColorCount]) + "\"/>\n";
  const auto polygon = [&](std::initializer_list<double> at) {
    std::string points;
    for (const double* p = at.begin(); p != at.end(); p += 2) points += px(x + p[0]) + "," + px(y + p[1]) + " ";
    return "<polygon points=\"" + points + fill;
  };
  switch (curve % 5) {
    case 0:
      return "<circle cx=\"" + px(x) + "\" cy=\"" + px(y) + "\" r=\"4" + fill;
    case 1:
      return polygon({-4, -4, 4, -4, 4, 4, -4, 4});
    case 2:
      return polygon({0, -5, 5, 4, -5, 4});
    case 3:
      return polygon({0, -5.5, 5.5, 0, 0, 5.5, -5.5, 0});
    default:
      return polygon({0, 5, 5, -4, -5, -4});
  }
}

/// 1, 2 or 5 times a power of ten, for about `count` steps over a range.
double step_of(double range, int count) {
  const double raw = std::max(range, 1e-9) / count, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double m : {1.0, 2.0, 5.0})
    if (m * power >= raw * 0.999) return m * power;
  return 10 * power;
}

struct Label {
  double y;  // where it should be, then where it is
  double from_x, from_y;
  std::string text;
  int curve;  // -1: a level
};

/// Moves labels apart, downwards in the order of their places, then all of them up where they end too low.
void spread(std::vector<Label>& labels) {
  std::stable_sort(labels.begin(), labels.end(), [](const Label& a, const Label& b) { return a.y < b.y; });
  for (std::size_t i = 1; i < labels.size(); ++i) labels[i].y = std::max(labels[i].y, labels[i - 1].y + kLine);
  double limit = kBottom;
  for (std::size_t i = labels.size(); i-- > 0; limit = labels[i].y - kLine) labels[i].y = std::min(labels[i].y, limit);
}

/// Finds room for words beside points.
class NotePlacer {
 public:
  explicit NotePlacer(std::vector<PlotPoint> markers) {
    for (const PlotPoint& m : markers) taken_.push_back({m.x - 5, m.y - 5, m.x + 5, m.y + 5});
  }

  /// Above, below, right, or left of a point; nothing where all of these places are taken.
  std::string place(double x, double y, const std::string& note) {
    const double wide = 6.2 * double(note.size()), high = 10;
    const Box above{x - wide / 2, y - 18, x + wide / 2, y - 18 + high},
        below{x - wide / 2, y + 7, x + wide / 2, y + 7 + high}, right{x + 9, y - 5, x + 9 + wide, y - 5 + high},
        left{x - 9 - wide, y - 5, x - 9, y - 5 + high};
    for (const Box& box : {above, below, right, left}) {
      if (std::any_of(taken_.begin(), taken_.end(),
                      [&](const Box& t) { return box.x0 < t.x1 && t.x0 < box.x1 && box.y0 < t.y1 && t.y0 < box.y1; }))
        continue;
      taken_.push_back(box);
      return text_at((box.x0 + box.x1) / 2, box.y1 - 1, note, "faint small", "middle");
    }
    return "";
  }

 private:
  struct Box {
    double x0, y0, x1, y1;
  };
  std::vector<Box> taken_;
};

}  // namespace

std::string svg(const Plot& plot) {
  double right = 0, low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Curve& curve : plot.curves)
    for (const PlotPoint& p : curve.points)
      right = std::max(right, p.x), low = std::min(low, p.y), high = std::max(high, p.y);
  for (const Level& level : plot.levels) low = std::min(low, level.y), high = std::max(high, level.y);
  const double step_x = step_of(right * 1.03, 8), step_y = step_of(high - low, 7);
  right = std::max(right * 1.03, step_x);
  low = step_y * std::floor(low / step_y - 0.15), high = step_y * std::ceil(high / step_y + 0.15);
  const auto x_of = [&](double x) { return kLeft + (kRight - kLeft) * x / right; };
  const auto y_of = [&](double y) { return kBottom - (kBottom - kTop) * (y - low) / (high - low); };

  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + number(kWidth) + " " +
                    number(kHeight) + "\" width=\"" + number(kWidth) + "\" height=\"" + number(kHeight) +
                    "\" role=\"img\"><title>" + escaped(plot.title) + "</title>\n" + kStyle +
                    "<rect class=\"back\" width=\"100%\" height=\"100%\"/>\n";
  out += text_at(kLeft, 26, plot.title, "ink title");
  for (int i = 0; i * step_x <= right; ++i) {
    out += line(x_of(i * step_x), kTop, x_of(i * step_x), kBottom, "class=\"grid\"");
    out += text_at(x_of(i * step_x), kBottom + 18, number(i * step_x), "ink", "middle");
  }
  for (int i = 0; low + i * step_y <= high + 1e-9 * step_y; ++i) {
    const double y = y_of(low + i * step_y);
    out += line(kLeft, y, kRight, y, "class=\"grid\"");
    out += text_at(kLeft - 8, y + 4.5, number(low + i * step_y), "ink", "end");
  }
  out += text_at((kLeft + kRight) / 2, kBottom + 42, plot.x_label, "ink", "middle");
  out += "<g transform=\"translate(20 " + px((kTop + kBottom) / 2) + ") rotate(-90)\">" +
         text_at(0, 0, plot.y_label, "ink", "middle") + "</g>\n";

  std::vector<PlotPoint> markers;
  for (const Curve& curve : plot.curves)
    for (const PlotPoint& p : curve.points) markers.push_back({x_of(p.x), y_of(p.y), p.note});
  std::vector<Label> labels;
  for (const Level& level : plot.levels) {
    const double y = y_of(level.y);
    out += line(kLeft, y, kRight, y, "class=\"level\" stroke-width=\"1.5\" stroke-dasharray=\"7 4\"");
    labels.push_back({y, kRight, y, level.label, -1});
  }
  for (std::size_t c = 0; c < plot.curves.size(); ++c) {
    const Curve& curve = plot.curves[c];
    if (curve.points.empty()) continue;
    std::string points, marks;
    for (const PlotPoint& p : curve.points) {
      const double x = x_of(p.x), y = y_of(p.y);
      points += px(x) + "," + px(y) + " ";
      marks += marker(c, x, y);
    }
    out += "<polyline points=\"" + points + "\" fill=\"none\" stroke=\"" + kColors[c % kColorCount] +
           "\" stroke-width=\"2\"/>\n" + marks;
    const PlotPoint& end = *std::max_element(curve.points.begin(), curve.points.end(),
                                             [](const PlotPoint& a, const PlotPoint& b) { return a.x < b.x; });
    labels.push_back({y_of(end.y), x_of(end.x), y_of(end.y), curve.label, int(c)});
  }
  spread(labels);
  for (const Label& label : labels) {
    const std::string stroke = label.curve < 0
                                   ? "class=\"level\""
                                   : "stroke=\"" + std::string(kColors[std::size_t(label.curve) % kColorCount]) + "\"";
    out += line(label.from_x + 6, label.from_y, kLabels - 14, label.y, stroke + " stroke-opacity=\"0.45\"");
    if (label.curve >= 0) out += marker(std::size_t(label.curve), kLabels - 7, label.y);
    out += text_at(kLabels + 3, label.y + 4.5, label.text, "ink");
  }
  NotePlacer placer(markers);
  for (const PlotPoint& m : markers)
    if (!m.note.empty()) out += placer.place(m.x, m.y, m.note);
  return out + "</svg>\n";
}

}  // namespace lumihull::bench
