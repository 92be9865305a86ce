#pragma once

// Sheets as an independent program (poppler's pdftoppm) sees them.

#include <filesystem>
#include <string>
#include <vector>

namespace lumihull::test {

/// A page in grey, 0 … 255. Lengths in mm from the page's top left corner.
struct Page {
  int width = 0, height = 0;
  double dpi = 0;
  std::string pixels;

  double px(double mm) const { return mm / 25.4 * dpi; }
  /// The pixel that holds a place.
  int at(double x_mm, double y_mm) const;
  /// Share of ink of pixel (column, row): 0 = bare paper, 1 = ink.
  double ink(int column, int row, int paper_grey, int ink_grey) const;
};

bool has_pdftoppm();
/// All pages of a PDF.
std::vector<Page> rasterised(const std::filesystem::path& pdf, int dpi);

}  // namespace lumihull::test
