#pragma once

// Curves as SVG text: nothing but the file is needed to show it, in light and in dark surroundings.

#include <string>
#include <vector>

namespace lumihull::bench {

struct PlotPoint {
  double x, y;
  std::string note;  // beside the point where there is room, may be empty
};

struct Curve {
  std::string label;
  std::vector<PlotPoint> points;  // in the order in which they are joined
};

/// Something to compare with that does not depend on x.
struct Level {
  std::string label;
  double y;
};

struct Plot {
  std::string title, x_label, y_label;  // axes' labels with their units
  std::vector<Curve> curves;
  std::vector<Level> levels;
};

/// x from 0, y from the least value to the largest; labels stand at the right, apart from each other. At least one
/// curve with a point; all values finite, x >= 0.
std::string svg(const Plot& plot);

}  // namespace lumihull::bench
