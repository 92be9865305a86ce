// Two halves of the photographs, each adjusted alone.
#include "cross_validation.h"

#include <lumihull/base/error.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace lumihull::calib::network {
namespace {

constexpr int kLeastPhotos = 4;  // of a half

struct Half {
  std::vector<CalibratedBody> bodies;
  Eigen::Vector2d print_scale;
  std::vector<int> body_of;
  std::vector<std::vector<Eigen::Matrix3d>> covariances;
};

}  // namespace

void cross_validate(const Network& whole, SettleOptions options, Calibration& c, Job& job) {
  std::vector<int> shots;
  for (std::size_t i = 0; i < whole.photos.size(); ++i)
    if (whole.photo_part[i] == 0 && whole.in_model[i])
      shots.push_back(whole.photos[i].shot * options.rig + int(i) * !options.rig);
  std::sort(shots.begin(), shots.end());
  shots.erase(std::unique(shots.begin(), shots.end()), shots.end());
  if (int(shots.size()) < 2 * kLeastPhotos) return;
  options.covariances = true;
  options.as_points = true;  // from poses that are right already
  std::array<Half, 2> halves;
  for (std::size_t h = 0; h < 2; ++h) {
    Network half = whole;
    std::vector<bool> use(whole.photos.size(), false);
    for (std::size_t i = 0; i < whole.photos.size(); ++i) {
      const int shot = options.rig ? whole.photos[i].shot : int(i);
      const auto at = std::lower_bound(shots.begin(), shots.end(), shot);
      use[i] = whole.in_model[i] && at != shots.end() && *at == shot && std::size_t(at - shots.begin()) % 2 == h;
    }
    try {
      std::optional<Settled> settled = settle(half, 0, use, options, job);
      if (!settled) return;
      halves[h] = {std::move(half.bodies), half.print_scale, std::move(settled->body_of),
                   std::move(settled->result.point_covariances)};
    } catch (const Error& e) {
      if (e.code() != ErrorCode::degenerate) throw;
      return;  // a half that falls apart says nothing
    }
  }
  std::vector<Eigen::Vector3d> a, b;
  double expected = 0;
  for (std::size_t k = 0; k < halves[0].bodies.size(); ++k) {
    const int i = halves[0].body_of[k], j = halves[1].body_of[k];
    if (i < 0 || j < 0) continue;
    for (std::size_t p = 0; p < halves[0].bodies[k].body.points.size(); ++p) {
      const Eigen::Matrix3d sum = halves[0].covariances[std::size_t(i)][p] + halves[1].covariances[std::size_t(j)][p];
      if (!sum.allFinite()) continue;
      a.push_back(halves[0].bodies[k].body.point(p, halves[0].print_scale));
      b.push_back(halves[1].bodies[k].body.point(p, halves[1].print_scale));
      expected += sum.trace();
    }
  }
  if (a.size() < 4) return;
  Eigen::Vector3d mean_a(0, 0, 0), mean_b(0, 0, 0);
  for (std::size_t i = 0; i < a.size(); ++i) mean_a += a[i] / double(a.size()), mean_b += b[i] / double(a.size());
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) cross += (b[i] - mean_b) * (a[i] - mean_a).transpose();
  const Eigen::Matrix3d turn = internal::nearest_rotation(cross).rotation;
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (turn * (a[i] - mean_a) + mean_b - b[i]).squaredNorm();
  c.cross_validation_m = std::sqrt(sum / double(a.size()));
  if (expected > 0) c.cross_validation_sigma = std::sqrt(sum / (expected * std::max(1.0, c.sigma0 * c.sigma0)));
}

}  // namespace lumihull::calib::network
