#include <lumihull/capture/statics.h>

#include <Eigen/Dense>
#include <limits>

#include "mechanism_support.h"
#include "support.h"

namespace lumihull::capture {
namespace {

/// W t + r by hand: every cable pulls along itself at its attachment.
Eigen::Matrix<double, 6, 1> wrench_at(const Mechanism& m, const Pose& pose, const CableVector& t) {
  Eigen::Vector3d force(0, 0, -m.mass_kg * m.gravity_m_s2);
  Eigen::Vector3d torque = (pose * m.center_of_mass - pose.translation).cross(force);
  for (std::size_t i = 0; i < m.cables.size(); ++i) {
    const Eigen::Vector3d at = pose * m.cables[i].attachment;
    const Eigen::Vector3d pull = t[Eigen::Index(i)] * (m.cables[i].departure - at).normalized();
    force += pull;
    torque += (at - pose.translation).cross(pull);
  }
  Eigen::Matrix<double, 6, 1> wrench;
  wrench << force, torque;
  return wrench;
}

TEST(Lengths, ChangeByTheWrenchMatrix) {
  test::Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Mechanism m = test::random_mechanism(random, random.integer(3, 12));
    const Pose pose{random.rotation(1), random.vector(1)};
    const WrenchMatrix w = wrench_matrix(m, pose);
    for (int k = 0; k < 6; ++k) {
      const double h = 1e-6;
      Eigen::Matrix<double, 6, 1> twist = Eigen::Matrix<double, 6, 1>::Zero();
      twist[k] = h;
      const auto moved = [&](double sign) {
        Eigen::Quaterniond turn(1, 0, 0, 0);
        turn.vec() = 0.5 * sign * twist.tail<3>();
        return Pose{(turn.normalized() * pose.rotation).normalized(), pose.translation + sign * twist.head<3>()};
      };
      const CableVector slope = (cable_lengths(m, moved(1)) - cable_lengths(m, moved(-1))) / (2 * h);
      EXPECT_LT((slope + w.row(k).transpose()).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

TEST(Tensions, PaperMechanismHoldsTheWholeHemisphere) {
  const Mechanism m = paper_mechanism();
  for (int theta = 0; theta < 360; theta += 3)
    for (int phi = 0; phi <= 90; phi += 3) {
      const Pose pose = test::pose_on_hemisphere(theta * std::numbers::pi / 180, phi * std::numbers::pi / 180);
      const Tensions found = tensions(m, pose);
      EXPECT_EQ(found.balance, Balance::controlled) << theta << ' ' << phi;
      EXPECT_GT(found.tension_N.minCoeff(), 1.5);
      EXPECT_LT(found.tension_N.maxCoeff(), 35);
      EXPECT_GT(found.smallest_singular, 0.4);
      EXPECT_LT(wrench_at(m, pose, found.tension_N).norm(), 1e-12 * 56 * 10);
      EXPECT_EQ(static_test(m, pose), Balance::controlled);
    }
}

TEST(Tensions, StatesOfSimpleMechanisms) {
  Mechanism m = paper_mechanism();
  // All in one point: nothing resists a rotation, but it hangs.
  for (Cable& cable : m.cables) cable.attachment.setZero();
  Tensions found = tensions(m, {});
  EXPECT_EQ(found.balance, Balance::singular);
  EXPECT_LT(found.residual_N, 1e-9);
  EXPECT_LT(wrench_at(m, {}, found.tension_N).norm(), 1e-9);
  EXPECT_EQ(static_test(m, {}), Balance::singular);
  // Away from the room, every cable pulls it back.
  const Pose far{Eigen::Quaterniond::Identity(), {20, 0, 0}};
  EXPECT_EQ(tensions(m, far).balance, Balance::unbalanced);
  EXPECT_EQ(static_test(paper_mechanism(), far), Balance::unbalanced);
  EXPECT_GT(tensions(m, far).residual_N, 1);
  // Three cables carry a point and leave rotations free.
  m.cables.resize(3);
  const auto on_wall = [&](int i, double x, double y) { m.cables[std::size_t(i)].departure = {x, y, 4}; };
  on_wall(0, 5, 0), on_wall(1, -5, 5), on_wall(2, -5, -5);
  found = tensions(m, {});
  EXPECT_EQ(found.balance, Balance::singular);
  EXPECT_EQ(found.smallest_singular, 0);
  EXPECT_EQ(found.tension_N.size(), 3);
  // Unloaded: a platform that is as light as a feather is balanced, but below the least tension.
  m = paper_mechanism();
  m.mass_kg = 0.1;
  EXPECT_EQ(tensions(m, test::pose_on_hemisphere(0, 1)).balance, Balance::loose);
  m.mass_kg = 500;
  EXPECT_EQ(static_test(m, test::pose_on_hemisphere(0, 1)), Balance::loose);
}

TEST(Tensions, LeastSingularValueIsTheSvds) {
  test::Random random(5);
  for (int i = 0; i < 500; ++i) {
    const Mechanism m = test::random_mechanism(random, random.integer(6, 12));
    const Pose pose{random.rotation(1), random.vector(1)};
    WrenchMatrix w = wrench_matrix(m, pose);
    w.bottomRows<3>() /= characteristic_length(m);
    const double expected = Eigen::JacobiSVD<Eigen::MatrixXd>(w).singularValues()[5];
    EXPECT_NEAR(tensions(m, pose).smallest_singular, expected, 1e-7 * expected + 1e-14);
  }
}

TEST(Tensions, FaultsAreNamed) {
  Mechanism m = paper_mechanism();
  Pose pose;
  pose.translation = m.cables[2].departure - m.cables[2].attachment;
  for (const auto& call : {std::function<void()>([&] { tensions(m, pose); }), {[&] { static_test(m, pose); }}, {[&] {
                             wrench_matrix(m, pose);
                           }}}) {
    const Error error = test::expect_error(call);
    EXPECT_EQ(error.code(), ErrorCode::degenerate);
    EXPECT_EQ(error.subject(), "cable 3");
  }
  EXPECT_NEAR(cable_lengths(m, pose)[2], 0, 1e-12);
  pose.translation.x() = std::nan("");
  EXPECT_EQ(test::expect_error([&] { cable_lengths(m, pose); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { static_test(m, pose); }).code(), ErrorCode::invalid_argument);
  m.cables.resize(13, m.cables[0]);
  EXPECT_EQ(test::expect_error([&] { tensions(m, {}); }).code(), ErrorCode::invalid_argument);
  m.cables.clear();
  EXPECT_EQ(test::expect_error([&] { tensions(m, {}); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::capture
