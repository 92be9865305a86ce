// One kind of target, and fields of points: sizes, places of features, what sizes make sense.
#include <lumihull/base/error.h>

#include <cmath>

#include "target_set_impl.h"

namespace lumihull::calib {
namespace {

constexpr double kSmallest = 1e-4, kLargest = 100;  // m

[[noreturn]] void refuse(const std::string& pointer, const std::string& expected) {
  throw Error(ErrorCode::invalid_argument, "expected " + expected, pointer);
}

bool within(double x, double low, double high) { return x >= low && x <= high; }  // false for NaN

/// Weights of luma (Rec. 709) suffice to say which of two colours is the darker one.
double luma(const Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

}  // namespace

Eigen::Vector2d TargetDesign::feature(int index) const {
  if (index < 0 || index >= features()) refuse("feature", "an index from 0 to " + std::to_string(features() - 1));
  Eigen::Vector2d place;
  if (family.kind() == TargetKind::circles) {
    const int grid = family.grid();
    const double middle = 0.5 * (grid - 1);
    place = {(index % grid - middle) * size_m, (index / grid - middle) * size_m};
  } else {
    const double half = 0.5 * size_m;
    place = {index == 1 || index == 2 ? half : -half, index >= 2 ? half : -half};
  }
  return {place.x() * scale_x, place.y() * scale_y};
}

void TargetDesign::validate() const { internal::check_design(*this, "", refuse); }

namespace internal {

void check_design(const TargetDesign& d, const std::string& pointer, const Complain& complain) {
  if (!within(d.size_m, kSmallest, kLargest)) complain(pointer + "/size_m", "a size from 0.0001 to 100 m");
  if (!within(d.scale_x, 0.5, 2)) complain(pointer + "/scale_x", "a scale from 0.5 to 2");
  if (!within(d.scale_y, 0.5, 2)) complain(pointer + "/scale_y", "a scale from 0.5 to 2");
  if (!(luma(d.ink) < luma(d.paper))) complain(pointer + "/ink", "a colour darker than the paper's");
  if (d.family.kind() == TargetKind::square) {
    if (d.circle_diameter_m != 0) complain(pointer + "/circle_diameter_m", "none, for the targets are squares");
    if (d.ring_diameter_m != 0) complain(pointer + "/ring_diameter_m", "none, for the targets are squares");
    if (d.solid_light) complain(pointer + "/solid_light", "false, for the targets are squares");
    return;
  }
  // 0 stands for the default; a ring of less than a fiftieth of its circle is not to be seen.
  if (d.circle_diameter_m != 0 && !within(d.circle_diameter_m, 0.05 * d.size_m, 0.95 * d.size_m))
    complain(pointer + "/circle_diameter_m", "0 or a diameter from 0.05 to 0.95 of the pitch");
  const double outer = 2 * d.circle_radius_m();
  if (d.ring_diameter_m != 0 && !within(d.ring_diameter_m, 0.1 * outer, 0.98 * outer))
    complain(pointer + "/ring_diameter_m", "0 or a diameter from 0.1 to 0.98 of the circle's");
  if (d.solid_light && d.ring_diameter_m != 0)
    complain(pointer + "/ring_diameter_m", "none, for light circles have no ring");
}

void check_grid(const PointGrid& g, const std::string& pointer, const Complain& complain) {
  if (g.columns < 2 || g.columns > 100) complain(pointer + "/columns", "an integer from 2 to 100");
  if (g.rows < 2 || g.rows > 100) complain(pointer + "/rows", "an integer from 2 to 100");
  if (!within(g.spacing_m, kSmallest, kLargest)) complain(pointer + "/spacing_m", "a spacing from 0.0001 to 100 m");
  if (g.kind == PointGrid::Kind::chessboard) {
    if (g.circle_diameter_m != 0) complain(pointer + "/circle_diameter_m", "none, for the grid is a chessboard");
  } else if (g.circle_diameter_m != 0 && !within(g.circle_diameter_m, 0.05 * g.spacing_m, 0.95 * g.spacing_m)) {
    complain(pointer + "/circle_diameter_m", "0 or a diameter from 0.05 to 0.95 of the spacing");
  }
}

}  // namespace internal
}  // namespace lumihull::calib
