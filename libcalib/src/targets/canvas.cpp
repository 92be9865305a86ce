#include "canvas.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lumihull::calib {
namespace {

/// A glyph's strokes: places of a grid, 5 wide and 7 high, two digits each; | lifts the pen.
std::string_view glyph(char c) {
  static constexpr std::array<std::string_view, 10> kDigits{
      "103041453616050110",       "112026|1636",  "01103041420646", "01103041423313|3344453616 05", "36300444",
      "40000312324345361605",     "413010010516364544331304",       "004016",
      "103041423313020110|1304051636454433", "051636454130100102133342"};
  static constexpr std::array<std::string_view, 26> kLetters{
      "0602204246|0444", "003041423303|334445360600", "4130100105163645", "00304145360600", "40000646|0333",
      "400006|0333",     "41301001051636454323",      "0006|4046|0343",   "1030|2026|1636", "4045361605",
      "0006|400346",     "000646",                    "0600234046",       "06004640",       "103041453616050110",
      "06003041423303",  "103041453616050110|3446",   "06003041423303|2346", "413010010213334445361605", "0040|2026",
      "000516364540",    "002640",                    "0016233640",       "0046|4006",      "002340|2326",
      "00400646"};
  if (c >= '0' && c <= '9') return kDigits[std::size_t(c - '0')];
  if (c >= 'a' && c <= 'z') return kLetters[std::size_t(c - 'a')];
  if (c >= 'A' && c <= 'Z') return kLetters[std::size_t(c - 'A')];
  if (c == '.') return "2626";
  if (c == '-') return "1333";
  if (c == ':') return "2222|2525";
  if (c == '/') return "4006";
  return "";
}

constexpr double kAdvance = 6;  // from one glyph to the next, in steps of the glyphs' grid

}  // namespace

void Canvas::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width, const Rgb& color) {
  constexpr double kLimit = 1e6;
  if (!from.allFinite() || !to.allFinite() || from.cwiseAbs().maxCoeff() > kLimit || to.cwiseAbs().maxCoeff() > kLimit)
    return;
  const Eigen::Vector2d d = to - from;
  const double length2 = d.squaredNorm(), half = 0.5 * width, reach = half + 1;
  const int y0 = int(std::max(0.0, std::floor(std::min(from.y(), to.y()) - reach))),
            y1 = int(std::min(double(rgb_.height()), std::ceil(std::max(from.y(), to.y()) + reach)));
  for (int y = y0; y < y1; ++y) {
    // The part of the row that the stroke can touch.
    double low = std::min(from.x(), to.x()), high = std::max(from.x(), to.x());
    if (std::abs(d.y()) > 1e-9) {
      const double a = from.x() + d.x() * (y + 0.5 - reach - from.y()) / d.y(),
                   b = from.x() + d.x() * (y + 0.5 + reach - from.y()) / d.y();
      low = std::max(low, std::min(a, b)), high = std::min(high, std::max(a, b));
    }
    const int x0 = int(std::max(0.0, std::floor(low - reach))),
              x1 = int(std::min(double(rgb_.width()), std::ceil(high + reach)));
    std::uint8_t* row = rgb_.row<std::uint8_t>(y);
    for (int x = x0; x < x1; ++x) {
      const Eigen::Vector2d p(x + 0.5, y + 0.5);
      const double t = length2 > 0 ? std::clamp((p - from).dot(d) / length2, 0.0, 1.0) : 0;
      const double alpha = std::clamp(half + 0.5 - (p - from - t * d).norm(), 0.0, 1.0);
      if (alpha <= 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        std::uint8_t& v = row[3 * x + int(c)];
        v = std::uint8_t(std::lround(v + alpha * (color[c] - v)));
      }
    }
  }
}

void Canvas::polyline(std::span<const Eigen::Vector2d> points, bool closed, double width, const Rgb& color) {
  for (std::size_t i = 0; i + 1 < points.size(); ++i) line(points[i], points[i + 1], width, color);
  if (closed && points.size() > 2) line(points.back(), points.front(), width, color);
}

void Canvas::shade(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double through) {
  for (int y = std::max(0, int(low.y())); y < std::min(double(rgb_.height()), high.y()); ++y) {
    std::uint8_t* row = rgb_.row<std::uint8_t>(y);
    for (int x = std::max(0, int(low.x())); x < std::min(double(rgb_.width()), high.x()); ++x)
      for (int c = 0; c < 3; ++c) row[3 * x + c] = std::uint8_t(row[3 * x + c] * through);
  }
}

void Canvas::legend(std::span<const std::pair<std::string, Rgb>> rows, double height) {
  const double line = 1.7 * height;
  double width = 0;
  for (const auto& row : rows) width = std::max(width, text_width(row.first, height));
  shade({0, 0}, {width + 2 * height, line * double(rows.size()) + height}, 0.35);
  for (std::size_t i = 0; i < rows.size(); ++i)
    text({height, height + line * double(i)}, rows[i].first, height, rows[i].second);
}

double Canvas::text_width(std::string_view words, double height) {
  return words.empty() ? 0 : (kAdvance * double(words.size()) - 2) * height / 6;
}

void Canvas::text(const Eigen::Vector2d& at, std::string_view words, double height, const Rgb& color) {
  const double width = std::max(1.0, height / 8);
  strokes(at, words, height, width + std::max(2.0, 0.9 * width), {0, 0, 0});
  strokes(at, words, height, width, color);
}

void Canvas::strokes(const Eigen::Vector2d& at, std::string_view words, double height, double width, const Rgb& color) {
  const double step = height / 6;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const Eigen::Vector2d corner = at + Eigen::Vector2d(kAdvance * double(i) * step, 0);
    Eigen::Vector2d last(0, 0);
    bool down = false;
    int first = -1;
    for (const char c : glyph(words[i])) {
      if (c == '|') down = false;
      if (c < '0' || c > '9') continue;
      if (first < 0) {
        first = c - '0';
        continue;
      }
      const Eigen::Vector2d next = corner + step * Eigen::Vector2d(first, c - '0');
      if (down) line(last, next, width, color);
      last = next, down = true, first = -1;
    }
  }
}

}  // namespace lumihull::calib
