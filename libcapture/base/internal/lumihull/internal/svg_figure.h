#pragma once

// Pictures as SVG text inside HTML: lines, dots, axes. Colours by class, so that they suit light and dark surroundings.

#include <lumihull/base/api.h>

#include <string>
#include <string_view>

namespace lumihull::internal {

/// printf's format for one number; a dash where it is not finite.
LUMIHULL_API std::string number(const char* format, double value);

/// 1, 2 or 5 times a power of ten, for about `count` steps over a range.
LUMIHULL_API double tick_step(double range, int count);

/// A magnification of one digit, by which vectors of `size` become about `length` long; at least 1.
LUMIHULL_API double magnification(double size, double length);

/// From dark blue over green to yellow for 0 … 1; even steps look even. "#rrggbb".
LUMIHULL_API std::string map_color(double t);

/// Data within [x0, x1] x [y0, y1] in a frame with ticks and labels. y downwards where y1 < y0.
class LUMIHULL_API SvgFigure {
 public:
  SvgFigure(std::string title, double width, double height);

  /// Draws frame, ticks and labels, and sets the scale of what follows. least_step: between ticks along x.
  void axes(double x0, double x1, double y0, double y1, const std::string& x_label, const std::string& y_label,
            double least_step = 0);
  /// `style`: a class, or a colour where it begins with '#', here and below.
  void line(double x0, double y0, double x1, double y1, std::string_view style);
  void dot(double x, double y, double radius_px, std::string_view style);
  /// Corners in data.
  void box(double x0, double y0, double x1, double y1, std::string_view style);
  void text(double x, double y, const std::string& words, std::string_view style = "small",
            const char* anchor = "middle");
  /// Below the title.
  void note(const std::string& words);

  std::string str() const;
  /// With its style sheet and on white: a file of its own.
  std::string standalone() const;
  /// What all figures' classes look like: for the page's <style>.
  static std::string style_sheet();

 private:
  double x_of(double x) const;
  double y_of(double y) const;
  std::string drawn(const std::string& first) const;

  double width_, height_, x0_ = 0, x1_ = 1, y0_ = 0, y1_ = 1;
  std::string title_, body_, note_;
};

}  // namespace lumihull::internal
