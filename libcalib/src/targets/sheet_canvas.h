#pragma once

// Exact vector drawing on pages, in millimetres from the page's top left corner, y down.

#include <lumihull/calib/color_key.h>

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace lumihull::calib {

/// Pages of one size. Shapes are gathered in one path and filled together: shapes inside of others are holes (even-odd
/// rule).
class SheetCanvas {
 public:
  /// Takes the file's bytes piece by piece; may throw, which ends the drawing.
  using Sink = std::function<void(std::string_view)>;
  enum class Anchor { left, middle };

  SheetCanvas() = default;
  SheetCanvas(const SheetCanvas&) = delete;
  SheetCanvas& operator=(const SheetCanvas&) = delete;
  virtual ~SheetCanvas() = default;

  virtual void add_circle(double x, double y, double radius) = 0;
  virtual void add_polygon(std::span<const Eigen::Vector2d> corners) = 0;
  void add_rectangle(double x, double y, double width, double height) {
    const Eigen::Vector2d corners[] = {{x, y}, {x + width, y}, {x + width, y + height}, {x, y + height}};
    add_polygon(corners);
  }
  /// Fills what was added since the last call.
  virtual void fill(const Rgb& color) = 0;
  /// A line of plain ASCII, its baseline at y; height: of an em.
  virtual void text(double x, double y, double height, std::string_view line, const Rgb& color, Anchor anchor) = 0;
  virtual void end_page() = 0;
  /// The rest of the file. Throws what the sink threw.
  virtual void finish() = 0;
};

/// Any number of pages. Coordinates are rounded to 1/256 pt, 0.0014 mm. Errors: out_of_memory, internal.
std::unique_ptr<SheetCanvas> make_pdf_canvas(double width_mm, double height_mm, const std::string& title,
                                             SheetCanvas::Sink sink);
/// Exactly one page. Coordinates are rounded to 0.0001 mm.
std::unique_ptr<SheetCanvas> make_svg_canvas(double width_mm, double height_mm, const std::string& title,
                                             SheetCanvas::Sink sink);

}  // namespace lumihull::calib
