#include "hull_function.h"

#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace lumihull::hull {
namespace {

struct Range {
  std::size_t n;
  struct Iterator {
    std::size_t i;
    std::size_t operator*() const { return i; }
    Iterator& operator++() { return ++i, *this; }
    bool operator!=(const Iterator& o) const { return i != o.i; }
  };
  Iterator begin() const { return {0}; }
  Iterator end() const { return {n}; }
};

ProjectedView project(const View& view, const Silhouette& silhouette) {
  ProjectedView p;
  p.field = &silhouette.data();
  Eigen::Matrix3d field_from_ideal = Eigen::Matrix3d::Identity();
  field_from_ideal(0, 0) = field_from_ideal(1, 1) = 1 / p.field->cell;
  field_from_ideal(0, 2) = -p.field->origin.x() / p.field->cell;
  field_from_ideal(1, 2) = -p.field->origin.y() / p.field->cell;
  p.m = field_from_ideal * view.cam_from_world.matrix();
  return p;
}

}  // namespace

double cut_by(const Box& box, const Eigen::Vector3d& x) {
  const Eigen::Array3d outside = (x - box.center()).array().abs() - 0.5 * box.size().array();
  const double out = outside.max(0.0).matrix().norm();
  return out > 0 ? -out : -outside.maxCoeff();
}

double HullFunction::Impl::cut(const Eigen::Vector3d& x) const {
  double d = -std::numeric_limits<double>::infinity();
  for (const CutPlane& plane : rule.cut_planes) d = std::max(d, plane.normal.dot(x) - plane.offset);
  for (const Box& box : rule.cut_boxes) d = std::max(d, cut_by(box, x));
  return d;
}

HullFunction::HullFunction(std::span<const View> views, std::span<const Silhouette> silhouettes, const CarveRule& rule)
    : impl_(std::make_unique<Impl>()) {
  const auto bad = [](const std::string& message) { throw Error(ErrorCode::invalid_argument, message); };
  if (views.size() != silhouettes.size())
    bad(std::to_string(views.size()) + " views, but " + std::to_string(silhouettes.size()) + " silhouettes");
  if (views.empty() || views.size() > 1'000'000) bad("carving needs from 1 to 1000000 views");
  if (rule.tolerance < 1 || std::size_t(rule.tolerance) > views.size())
    bad("tolerance must be from 1 to the number of views, not " + std::to_string(rule.tolerance));
  if (rule.min_views < 1) bad("min_views must be at least 1");
  impl_->rule = rule;
  for (CutPlane& plane : impl_->rule.cut_planes) {
    const double length = plane.normal.norm();
    if (!(length > 0) || !std::isfinite(length) || !std::isfinite(plane.offset))
      bad("a cutting plane needs a finite normal of positive length and a finite offset");
    plane.normal /= length;
    plane.offset /= length;
  }
  for (const Box& box : rule.cut_boxes)
    if (!box.min.allFinite() || !box.max.allFinite() || !(box.size().minCoeff() > 0))
      bad("a cutting box needs finite corners with min < max");
  impl_->min_views = std::max(rule.min_views, rule.tolerance);
  impl_->silhouettes.assign(silhouettes.begin(), silhouettes.end());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Pose& pose = views[i].cam_from_world;
    if (!pose.rotation.coeffs().allFinite() || !pose.translation.allFinite() ||
        std::abs(pose.rotation.norm() - 1) > 1e-6)
      throw Error(ErrorCode::bad_input, "the camera's pose is not a finite rotation and translation",
                  "view " + std::to_string(i));
    impl_->views.push_back(project(views[i], impl_->silhouettes[i]));
  }
}

HullFunction::~HullFunction() = default;
HullFunction::HullFunction(HullFunction&&) noexcept = default;
HullFunction& HullFunction::operator=(HullFunction&&) noexcept = default;

double HullFunction::operator()(const Eigen::Vector3d& x) const {
  std::vector<double> scratch(std::size_t(impl_->rule.tolerance));
  return impl_->phi(x, Range{impl_->views.size()}, 0, 0, scratch.data());
}

std::optional<double> HullFunction::of_view(std::size_t i, const Eigen::Vector3d& x) const {
  const double d = impl_->views[i].phi(x);
  if (std::isnan(d)) return std::nullopt;
  return d;
}

std::size_t HullFunction::views() const { return impl_->views.size(); }

Grid make_grid(const Box& region, int resolution) {
  if (resolution < kMinResolution || resolution > kMaxResolution)
    throw Error(ErrorCode::invalid_argument, "the resolution must be from " + std::to_string(kMinResolution) + " to " +
                                                 std::to_string(kMaxResolution) + " voxels, not " +
                                                 std::to_string(resolution));
  const Eigen::Vector3d size = region.size();
  if (!region.min.allFinite() || !region.max.allFinite() || !size.allFinite() || !(size.minCoeff() > 0))
    throw Error(ErrorCode::invalid_argument, "the region needs finite corners with min < max");
  Grid grid;
  grid.voxel = size.maxCoeff() / resolution;
  grid.region.min = region.min;
  for (int axis = 0; axis < 3; ++axis) {
    // A hair's breadth more than a whole number of voxels is rounding, not one more voxel.
    grid.size[std::size_t(axis)] = std::max(1, int(std::ceil(size[axis] / grid.voxel - 1e-9)));
    grid.region.max[axis] = region.min[axis] + grid.voxel * grid.size[std::size_t(axis)];
  }
  // Vertices are floats: a hundredth of a voxel must still be told apart.
  const double reach = std::max(grid.region.min.cwiseAbs().maxCoeff(), grid.region.max.cwiseAbs().maxCoeff());
  if (reach > grid.voxel * 100'000)
    throw Error(ErrorCode::invalid_argument,
                "the region lies too far from the origin for its voxels; move the origin nearer to the object");
  return grid;
}

}  // namespace lumihull::hull
