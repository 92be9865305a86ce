// Two lenses: how far apart they put the pixel of one ray, apart from what a rotation of the camera does as well.
#include <lumihull/base/error.h>

#include <Eigen/Dense>
#include <map>

#include "parts.h"

namespace lumihull::slf::truth {
namespace {

constexpr int kColumns = 48, kRows = 32, kSteps = 20;

struct Difference {
  double rms = kUnknown, max = kUnknown;
};

/// Rays of places evenly over the picture by the true lens; Gauss-Newton for the rotation.
Difference projection_difference(const Camera& found, const Camera& truth) {
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector3d>> rays;
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kColumns; ++x) {
      const Eigen::Vector2d px(truth.width * (x + 0.5) / kColumns, truth.height * (y + 0.5) / kRows);
      if (const auto ray = truth.ray(px)) rays.emplace_back(px, *ray);
    }
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Difference d;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double squares = 0, most = 0;
    std::size_t n = 0;
    for (const auto& [px, ray] : rays) {
      const Eigen::Vector3d turned = turn * ray;
      Matrix23d by_point;
      const auto seen = found.project(turned, &by_point);
      if (!seen) continue;
      const Eigen::Vector2d error = *seen - px;
      Eigen::Matrix3d cross;
      cross << 0, turned.z(), -turned.y(), -turned.z(), 0, turned.x(), turned.y(), -turned.x(), 0;
      const Matrix23d j = by_point * cross;  // d pixel / d rotation: point + w x point
      normal += j.transpose() * j;
      right -= j.transpose() * error;
      squares += error.squaredNorm();
      most = std::max(most, error.norm());
      ++n;
    }
    if (n < rays.size() || n < 3) return {};  // the one lens does not cover what the other does
    d = {std::sqrt(squares / double(n)), most};
    const Eigen::Vector3d w = normal.ldlt().solve(right);
    if (!(w.norm() > 1e-12)) break;
    turn = (Eigen::AngleAxisd(w.norm(), w.normalized()) * turn).normalized();
  }
  return d;
}

}  // namespace

std::vector<LensTruth> compare_lenses(const Capture& capture, std::span<const Pair> pairs) {
  std::map<int, const Pair*> first;
  for (const Pair& p : pairs) {
    const int camera = capture.shots[p.shot].camera;
    const Camera &a = capture.cameras[std::size_t(camera)], &b = p.truth.camera;
    if (a.width != b.width || a.height != b.height)
      throw Error(ErrorCode::bad_input,
                  "the truth's picture has " + std::to_string(b.width) + " x " + std::to_string(b.height) +
                      " pixels, the capture's " + std::to_string(a.width) + " x " + std::to_string(a.height),
                  capture.shots[p.shot].name);
    first.emplace(camera, &p);
  }
  std::vector<LensTruth> out;
  for (const auto& [camera, pair] : first) {
    const Camera &found = capture.cameras[std::size_t(camera)], &truth = pair->truth.camera;
    const Difference d = projection_difference(found, truth);
    out.push_back({camera, 100 * (found.f / truth.f - 1), {found.u0 - truth.u0, found.v0 - truth.v0}, d.rms, d.max});
  }
  return out;
}

}  // namespace lumihull::slf::truth
