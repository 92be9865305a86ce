// Errors are as large as the covariances say: χ² over many seeds, in the datum that the header names.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>

#include "adjust/bundle_problem.h"
#include "kinds.h"
#include "lens/point_term.h"

namespace lumihull {
namespace {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// The small motion m with moved(from, m) = to.
Vector6d motion_between(const Pose& from, const Pose& to) {
  const Eigen::AngleAxisd turn(to.rotation * from.rotation.conjugate());
  double angle = turn.angle();
  if (angle > 3.14159265358979) angle -= 2 * 3.14159265358979323846;
  Vector6d m;
  m.head<3>() = angle * turn.axis();
  m.tail<3>() = to.translation - turn.toRotationMatrix() * from.translation;
  return m;
}

/// Mahalanobis² over the covariance's range.
struct Squares {
  double sum = 0;
  double freedom = 0;
  void add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
    const Eigen::VectorXd unit = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit.asDiagonal() * covariance * unit.asDiagonal());
    const Eigen::VectorXd along = eigen.eigenvectors().transpose() * (unit.asDiagonal() * error);
    for (Eigen::Index i = 0; i < along.size(); ++i) {
      if (!(eigen.eigenvalues()[i] > 1e-9)) continue;
      sum += along[i] * along[i] / eigen.eigenvalues()[i];
      freedom += 1;
    }
  }
  double ratio() const { return sum / freedom; }
};

TEST(AdjustCovariance, ErrorsAreAsLargeAsTheCovariancesSay) {
  for (test::Kind kind : test::kinds()) {
    SCOPED_TRACE(kind.name);
    kind.maker.shots = std::min(kind.maker.shots, 10);
    kind.maker.bodies = std::min(kind.maker.bodies, 9);
    kind.maker.side = 3;
    kind.maker.pitch = 0.05;
    kind.maker.off = 0.2;
    Squares shots, lenses, rigs, points, print;
    double sigma0 = 0;
    constexpr int kSeeds = 60;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const test::Scene scene = test::make_scene(kind.maker, std::uint64_t(100 + seed));
      // Starting at the truth, the answer is brought back to the truth's datum; bends are drawn from what is expected
      // of them.
      calib::Adjustment start = scene.truth;
      Job job({}, 2);
      const calib::AdjustResult result = calib::adjust(start, {.bend_sigma = std::max(0.1, kind.maker.bend)}, job);
      ASSERT_TRUE(result.converged);
      sigma0 += result.sigma0 / kSeeds;
      const calib::Adjustment& answer = result.adjusted;
      for (std::size_t s = 0; s < start.shots.size(); ++s)
        shots.add(motion_between(scene.truth.shots[s].rig_from_world, answer.shots[s].rig_from_world),
                  result.shot_covariances[s]);
      for (std::size_t c = 0; c < start.cameras.size(); ++c) {
        lenses.add(calib::lens::parameters_of(answer.cameras[c].camera) -
                       calib::lens::parameters_of(scene.truth.cameras[c].camera),
                   result.camera_covariances[c]);
        if (start.cameras[c].on_rig)
          rigs.add(motion_between(scene.truth.cameras[c].cam_from_rig, answer.cameras[c].cam_from_rig),
                   result.rig_covariances[c]);
      }
      for (std::size_t b = 0; b < start.bodies.size(); ++b)
        for (std::size_t i = 0; i < start.bodies[b].points.size(); ++i)
          points.add(
              answer.bodies[b].point(i, answer.print_scale) - scene.truth.bodies[b].point(i, scene.truth.print_scale),
              result.point_covariances[b][i]);
      if (start.free_print_scale) print.add(answer.print_scale - scene.truth.print_scale, result.print_covariance);
    }
    std::printf("%-30s sigma0 %.4f, chi2 / freedom: shots %.3f, lens %.3f, points %.3f, rig %.3f, print %.3f\n",
                kind.name, sigma0, shots.ratio(), lenses.ratio(), points.ratio(), rigs.ratio(), print.ratio());
    EXPECT_NEAR(sigma0, 1, 0.02);
    // Lenses: 60 · 7 squares, σ of their mean 0.07; the others hang together within a scene.
    EXPECT_NEAR(shots.ratio(), 1, 0.15);
    EXPECT_NEAR(lenses.ratio(), 1, 0.25);
    EXPECT_NEAR(points.ratio(), 1, 0.15);
    if (rigs.freedom > 0) {
      EXPECT_NEAR(rigs.ratio(), 1, 0.3);
    }
    if (print.freedom > 0) {
      EXPECT_NEAR(print.ratio(), 1, 0.5);
    }
  }
}

}  // namespace
}  // namespace lumihull
