#pragma once

#include <lumihull/base/image.h>
#include <lumihull/calib/color_key.h>

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace lumihull::calib {

/// Draws with anti-aliased strokes on an 8-bit RGB picture. Places are px, the first pixel's centre (0.5, 0.5); what lies
/// outside of the picture, or is not finite, is not drawn.
class Canvas {
 public:
  explicit Canvas(Image& rgb) : rgb_(rgb) {}

  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width, const Rgb& color);
  void polyline(std::span<const Eigen::Vector2d> points, bool closed, double width, const Rgb& color);
  void dot(const Eigen::Vector2d& at, double radius, const Rgb& color) { line(at, at, 2 * radius, color); }
  /// A panel of black that lets `through` (0 … 1) of the picture be seen.
  void shade(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double through);

  /// Text of strokes with a dark rim: digits, letters (as capitals), space and . - : / ; `height` of a digit, px. Its
  /// upper left corner is `at`.
  void text(const Eigen::Vector2d& at, std::string_view words, double height, const Rgb& color);
  static double text_width(std::string_view words, double height);
  /// Lines of text on a panel in the upper left corner.
  void legend(std::span<const std::pair<std::string, Rgb>> rows, double height);

 private:
  void strokes(const Eigen::Vector2d& at, std::string_view words, double height, double width, const Rgb& color);
  Image& rgb_;
};

}  // namespace lumihull::calib
