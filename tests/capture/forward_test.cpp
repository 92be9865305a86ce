#include <energy.h>
#include <lumihull/capture/forward.h>

#include <Eigen/Dense>
#include <cstdio>

#include "mechanism_support.h"
#include "support.h"

namespace lumihull::capture {
namespace {

using internal::Matrix6;
using internal::Springs;
using internal::Vector6;

std::span<const double> span(const CableVector& v) { return {v.data(), std::size_t(v.size())}; }

Pose view_pose(test::Random& random) {
  return test::pose_on_hemisphere(random.uniform(0, 2 * std::numbers::pi), random.uniform(0, std::numbers::pi / 2),
                                  random.uniform(1.2, 1.6));
}

/// 0.1 m and 0.1 rad away, in any direction.
Pose start_near(test::Random& random, const Pose& pose) {
  Vector6 twist;
  twist << 0.1 * random.direction(), 0.1 * random.direction();
  return internal::moved(pose, twist);
}

double distance(const Pose& a, const Pose& b) {
  return std::max((a.translation - b.translation).norm(), 0.25 * a.rotation.angularDistance(b.rotation));
}

Mechanism stretching(double stiffness) {
  Mechanism m = paper_mechanism();
  for (Cable& cable : m.cables) cable.stiffness_N = stiffness;
  return m;
}

TEST(Energy, DerivativesAreThoseOfFiniteDifferences) {
  test::Random random(1);
  for (int i = 0; i < 300; ++i) {
    const Mechanism m = test::random_mechanism(random, random.integer(3, 12));
    const Pose pose{random.rotation(2), random.vector(1)};
    Springs springs{cable_lengths(m, pose), CableVector::Constant(Eigen::Index(m.cables.size()), 2e4)};
    for (double& l : springs.natural_m)  // some pull, some are slack, none is at the kink
      l += (random.integer(0, 1) ? 1 : -1) * random.uniform(0.001, 0.02);
    Vector6 gradient;
    Matrix6 hessian;
    internal::spring_energy(m, springs, pose, &gradient, &hessian);
    const double h = 1e-5;
    for (int a = 0; a < 6; ++a) {
      const auto at = [&](double x, int b, double y) {
        Vector6 twist = Vector6::Zero();
        twist[a] += x, twist[b] += y;
        return internal::spring_energy(m, springs, internal::moved(pose, twist), nullptr, nullptr);
      };
      EXPECT_NEAR((at(h, a, 0) - at(-h, a, 0)) / (2 * h), gradient[a], 1e-4 + 1e-6 * std::abs(gradient[a]));
      for (int b = 0; b < 6; ++b) {
        // Along exp at the twist zero, which is not the gradient's change from pose to pose.
        const double mixed = (at(h, b, h) - at(h, b, -h) - at(-h, b, h) + at(-h, b, -h)) / (4 * h * h);
        EXPECT_NEAR(mixed, hessian(a, b), 0.02 + 1e-4 * hessian.cwiseAbs().maxCoeff()) << a << ' ' << b;
      }
    }
  }
}

TEST(HangRigid, TenThousandStarts) {
  const Mechanism m = paper_mechanism();
  test::Random random(2);
  double worst = 0;
  int failed = 0, iterations = 0;
  for (int i = 0; i < 10000; ++i) {
    const Pose pose = view_pose(random);
    if (static_test(m, pose) != Balance::controlled) {
      ++failed;
      continue;
    }
    const Hanging found = hang_rigid(m, span(cable_lengths(m, pose)), start_near(random, pose));
    const double error = distance(found.world_from_platform, pose);
    worst = std::max(worst, error);
    failed += !(error < 1e-9) || !found.taut;
    iterations += found.iterations;
    ASSERT_LT((found.tension_N - tensions(m, pose).tension_N).cwiseAbs().maxCoeff(), 1e-6);
  }
  EXPECT_EQ(failed, 0);
  EXPECT_LT(worst, 1e-9);
  RecordProperty("worst_m", std::to_string(worst));
  RecordProperty("iterations", std::to_string(iterations / 1e4));
}

TEST(HangElastic, RightEquilibriumFromAWarmStart) {
  for (const double stiffness : {1e4, 8e4, 1e6}) {
    const Mechanism m = stretching(stiffness);
    test::Random random(3);
    int wrong = 0;
    for (int i = 0; i < 3000; ++i) {
      const Pose pose = view_pose(random);
      const Hanging found = hang_elastic(m, span(unstrained_lengths(m, pose)), start_near(random, pose));
      const bool right = distance(found.world_from_platform, pose) < 1e-8;
      wrong += !right;
      if (right) {
        EXPECT_LT((found.tension_N - tensions(m, pose).tension_N).cwiseAbs().maxCoeff(), 1e-4);
      }
    }
    EXPECT_LE(wrong, 3) << stiffness;
    std::printf("EA %g: %d of 3000 wrong\n", stiffness, wrong);
  }
}

}  // namespace
}  // namespace lumihull::capture
