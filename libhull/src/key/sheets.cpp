#include "sheets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace lumihull::hull {
namespace {

constexpr double kPrinted = 0.98;  // of a target's half side: what is printed for certain
constexpr int kBlur = 2;           // coarse pixels

/// Sets the pixels of a convex polygon to at least `value`.
void fill(Image& image, std::span<const Eigen::Vector2d> polygon, std::uint8_t value) {
  double top = INFINITY, bottom = -INFINITY;
  for (const auto& p : polygon) top = std::min(top, p.y()), bottom = std::max(bottom, p.y());
  const int y1 = int(std::min(double(image.height()), std::ceil(bottom)));
  for (int y = int(std::max(0.0, std::floor(top))); y < y1; ++y) {
    double left = INFINITY, right = -INFINITY;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Eigen::Vector2d &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
      if ((a.y() < y + 0.5) == (b.y() < y + 0.5)) continue;
      const double x = a.x() + (y + 0.5 - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      left = std::min(left, x), right = std::max(right, x);
    }
    std::uint8_t* row = image.row<std::uint8_t>(y);
    for (int x = int(std::max(0.0, std::floor(left))); x < std::min(double(image.width()), right); ++x)
      row[x] = std::max(row[x], value);
  }
}

/// The outline of a sheet as far as `reach` in a view, coarse pixels; empty where the view can't see all of it.
std::vector<Eigen::Vector2d> outline(const CoarseView& v, const Sheet& s, const std::array<double, 4>& reach) {
  std::vector<Eigen::Vector2d> out;
  constexpr int kSteps = 4;  // along a side: lenses bend it
  const double corners[4][2] = {
      {-reach[2], -reach[3]}, {reach[0], -reach[3]}, {reach[0], reach[1]}, {-reach[2], reach[1]}};
  for (int k = 0; k < 4; ++k)
    for (int step = 0; step < kSteps; ++step) {
      const double t = double(step) / kSteps, *a = corners[k], *b = corners[(k + 1) % 4];
      const auto px =
          v.view.project(s.center + (a[0] + t * (b[0] - a[0])) * s.along + (a[1] + t * (b[1] - a[1])) * s.across);
      if (!px) return {};
      out.push_back(*px / v.step);
    }
  return out;
}

}  // namespace

std::vector<Sheet> sheets_of(std::span<const calib::CalibratedBody> bodies, const Eigen::Vector3d& eyes) {
  std::vector<Sheet> sheets;
  for (const calib::CalibratedBody& body : bodies) {
    if (!body.placed) continue;
    std::map<std::pair<int, int>, std::vector<std::size_t>> targets;
    for (std::size_t k = 0; k < std::min(body.features.size(), body.points.size()); ++k)
      targets[{body.features[k].design, body.features[k].id}].push_back(k);
    for (const auto& [name, points] : targets) {
      if (points.size() < 4) continue;
      // Sides lie as printed: along the target's own axes.
      Sheet s;
      const Eigen::Quaterniond& turn = body.body.world_from_body.rotation;
      s.center = Eigen::Vector3d::Zero();
      for (const std::size_t k : points) s.center += body.points[k] / double(points.size());
      const Eigen::Vector3d x = turn * Eigen::Vector3d::UnitX(), y = turn * Eigen::Vector3d::UnitY();
      double wide = 0, high = 0;
      for (const std::size_t k : points) {
        wide = std::max(wide, std::abs(x.dot(body.points[k] - s.center)));
        high = std::max(high, std::abs(y.dot(body.points[k] - s.center)));
      }
      s.along = wide * x, s.across = high * y;
      s.normal = x.cross(y);
      if (s.normal.dot(eyes - s.center) < 0) s.normal = -s.normal;
      sheets.push_back(s);
    }
  }
  return sheets;
}

Image sheets_in(const CoarseView& view, std::span<const Sheet> sheets) {
  Image out(view.mask.width(), view.mask.height(), 1);
  for (const Sheet& s : sheets) {
    if (s.normal.dot(view.view.center() - s.center) <= 0) continue;
    fill(out, outline(view, s, s.reach), kPaperRim);
    fill(out, outline(view, s, {kPrinted, kPrinted, kPrinted, kPrinted}), kPrint);
  }
  // Colours run into each other at paper's edge.
  Image any(out.width(), out.height(), 1);
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x) any.row<std::uint8_t>(y)[x] = out.row<std::uint8_t>(y)[x] ? 255 : 0;
  any = grown(any, kBlur);
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x)
      if (any.row<std::uint8_t>(y)[x] && !out.row<std::uint8_t>(y)[x]) out.row<std::uint8_t>(y)[x] = kPaperRim;
  return out;
}

}  // namespace lumihull::hull
