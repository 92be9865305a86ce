#include <lumihull/capture/sag.h>
#include <lumihull/capture/sensitivity.h>

#include <Eigen/Dense>

#include "mechanism_support.h"
#include "support.h"

namespace lumihull::capture {
namespace {

/// The cable's end by integration from the platform on: dp/ds = (1 + T / EA) F / T, dF/ds = (0, w).
Eigen::Vector2d integrate(const CableKind& kind, const HangingCable& cable) {
  const double give = kind.stiffness_N > 0 ? 1 / kind.stiffness_N : 0;
  const auto slope = [&](double s) {
    const Eigen::Vector2d force(cable.pull_N, cable.lift_N + kind.weight_N_m * s);
    return Eigen::Vector2d((1 / force.norm() + give) * force);
  };
  const int steps = 4000;
  const double h = cable.length_m / steps;
  Eigen::Vector2d at(0, 0);
  for (int i = 0; i < steps; ++i)  // Simpson's rule: Runge and Kutta's, for a slope that depends on s alone
    at += h / 6 * (slope(i * h) + 4 * slope((i + 0.5) * h) + slope((i + 1) * h));
  return at;
}

struct Example {
  CableKind kind;
  HangingCable cable;
};

Example example(test::Random& random) {
  Example e;
  e.kind.weight_N_m = std::pow(10, random.uniform(-4, 1));
  e.kind.stiffness_N = random.integer(0, 2) ? std::pow(10, random.uniform(3, 6)) : 0;
  e.cable.length_m = random.uniform(0.5, 12);
  const double weight = e.kind.weight_N_m * e.cable.length_m;
  e.cable.pull_N = std::pow(10, random.uniform(-0.5, 2.5));
  e.cable.lift_N = random.uniform(-1, 1.5) * std::max(weight, e.cable.pull_N);
  return e;
}

TEST(Sag, EndIsTheIntegrals) {
  test::Random random(1);
  for (int i = 0; i < 500; ++i) {
    const Example e = example(random);
    const Eigen::Vector2d expected = integrate(e.kind, e.cable);
    EXPECT_LT((cable_end(e.kind, e.cable) - expected).norm(), 1e-9 * expected.norm()) << i;
  }
  // A light cable's formulas keep their digits, down to none at all.
  for (const double w : {1e-6, 1e-9, 1e-12, 1e-15, 0.0}) {
    const Eigen::Vector2d end = cable_end({w, 0}, {6, 30, 40});
    EXPECT_NEAR(end.x(), 3.6, w + 1e-13);
    EXPECT_NEAR(end.y(), 4.8, w + 1e-13);
  }
}

TEST(Sag, JacobianIsThatOfFiniteDifferences) {
  test::Random random(2);
  for (int i = 0; i < 500; ++i) {
    const Example e = example(random);
    Eigen::Matrix<double, 2, 3> jacobian;
    cable_end(e.kind, e.cable, &jacobian);
    for (int k = 0; k < 3; ++k) {
      const double size = k < 2 ? e.cable.tension_N() : e.cable.length_m, h = 1e-5 * size;
      const auto at = [&](double step) {
        HangingCable c = e.cable;
        (k == 0 ? c.pull_N : k == 1 ? c.lift_N : c.length_m) += step;
        return cable_end(e.kind, c);
      };
      const Eigen::Vector2d slope = (at(h) - at(-h)) / (2 * h);
      EXPECT_LT((slope - jacobian.col(k)).norm() * size,
                1e-6 * e.cable.length_m * (1 + e.cable.tension_N() / e.cable.pull_N))
          << i << ' ' << k;
    }
  }
}

TEST(Sag, BothInversesFindTheCable) {
  test::Random random(3);
  int taut = 0, slack = 0;
  for (int i = 0; i < 5000; ++i) {
    const Example e = example(random);
    const Eigen::Vector2d end = cable_end(e.kind, e.cable);
    if (end.x() < 0.05) continue;
    const HangingCable by_length = cable_of_length(e.kind, end.x(), end.y(), e.cable.length_m);
    // Its force may be ill-determined (a stiff, taut cable); its end is not.
    EXPECT_LT((cable_end(e.kind, by_length) - end).norm(), 1e-9 * end.norm()) << i;
    if (by_length.length_m > end.norm() * 1.001) {
      EXPECT_NEAR(by_length.pull_N, e.cable.pull_N, 1e-6 * e.cable.tension_N()) << i;
      EXPECT_NEAR(by_length.lift_N, e.cable.lift_N, 1e-6 * e.cable.tension_N()) << i;
      ++slack;
    }
    // Of the two cables of one tension, the tauter: det d(end) / d(angle, length) < 0 as for a straight one.
    Eigen::Matrix<double, 2, 3> j;
    cable_end(e.kind, e.cable, &j);
    const Eigen::Vector2d turn = j.col(1) * e.cable.pull_N - j.col(0) * e.cable.lift_N;
    const double side = (turn.x() * j(1, 2) - turn.y() * j(0, 2)) / e.cable.length_m;
    if (!(side < -0.05)) continue;  // not near the least tension
    ++taut;
    try {
      const HangingCable by_tension = cable_of_tension(e.kind, end.x(), end.y(), e.cable.tension_N());
      EXPECT_NEAR(by_tension.length_m, e.cable.length_m, 1e-8 * e.cable.length_m) << i << ' ' << side;
      EXPECT_NEAR(by_tension.tension_N(), e.cable.tension_N(), 1e-9 * e.cable.tension_N());
    } catch (const Error& error) {
      ADD_FAILURE() << i << ' ' << error.what() << " side " << side << " w L / T "
                    << e.kind.weight_N_m * e.cable.length_m / e.cable.tension_N();
    }
  }
  EXPECT_GT(taut, 1000);
  EXPECT_GT(slack, 500);
}

TEST(Sag, LengthErrorOfASixMetreCable) {
  // What straight cables leave out, at 5 g/m over 6 m: by the parabola, w² x³ / (24 H²).
  const CableKind kind{0.005 * 9.80665, 0};
  EXPECT_NEAR(cable_of_tension(kind, 6, 0, 1).length_m - 6, 0.0216, 0.001);
  EXPECT_NEAR(cable_of_tension(kind, 6, 0, 10).length_m - 6, 0.000216, 0.000002);
}

TEST(Sag, FaultsAreNamed) {
  const CableKind kind{0.05, 0};
  EXPECT_EQ(test::expect_error([&] { cable_of_tension(kind, 6, 0, 0.1); }).code(), ErrorCode::degenerate);
  EXPECT_EQ(test::expect_error([&] { cable_of_length(kind, 6, 0, 5.9); }).code(), ErrorCode::degenerate);
  EXPECT_EQ(test::expect_error([&] { cable_of_length({0, 1e4}, 6, 0, 6.1); }).code(), ErrorCode::degenerate);
  for (const double bad : {0.0, -1.0, std::nan(""), double(INFINITY)}) {
    EXPECT_EQ(test::expect_error([&] { cable_of_tension(kind, 6, 0, bad); }).code(), ErrorCode::invalid_argument);
    EXPECT_EQ(test::expect_error([&] { cable_of_tension(kind, bad, 0, 1); }).code(), ErrorCode::invalid_argument);
    EXPECT_EQ(test::expect_error([&] { cable_of_length(kind, 6, 0, bad); }).code(), ErrorCode::invalid_argument);
  }
  EXPECT_EQ(test::expect_error([&] { cable_of_length({-1, 0}, 6, 0, 7); }).code(), ErrorCode::invalid_argument);
}

TEST(Sag, PlatformHangsOnSaggingCables) {
  Mechanism m = paper_mechanism();
  for (Cable& cable : m.cables) cable.density_kg_m = 0.005, cable.stiffness_N = 8e4;
  test::Random random(4);
  double most = 0;
  for (int i = 0; i < 300; ++i) {
    const Pose pose = test::pose_on_hemisphere(random.uniform(0, 6.28), random.uniform(0, 1.57));
    const auto cables = sagging_cables(m, pose);
    const CableVector straight = cable_lengths(m, pose);
    Eigen::Vector3d force(0, 0, -m.mass_kg * m.gravity_m_s2), torque = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 6; ++k) {
      const Eigen::Vector3d at = pose * m.cables[k].attachment, d = m.cables[k].departure - at;
      const Eigen::Vector2d end = integrate({0.005 * m.gravity_m_s2, 8e4}, cables[k]);
      EXPECT_NEAR(end.x(), d.head<2>().norm(), 1e-8);
      EXPECT_NEAR(end.y(), d.z(), 1e-8);
      const Eigen::Vector2d along = d.head<2>().normalized();
      const Eigen::Vector3d pull(cables[k].pull_N * along.x(), cables[k].pull_N * along.y(), cables[k].lift_N);
      force += pull;
      torque += (at - pose.translation).cross(pull);
      most = std::max(most, std::abs(cables[k].length_m - straight[Eigen::Index(k)]));
    }
    EXPECT_LT(force.norm(), 1e-7);
    EXPECT_LT(torque.norm(), 1e-7);
  }
  EXPECT_GT(most, 1e-3);
  EXPECT_LT(most, 1e-2);
}

TEST(Sensitivity, IsTheWorstOfManyErrors) {
  test::Random random(5);
  for (int k = 0; k < 60; ++k) {
    const int n = k % 2 ? 6 : random.integer(7, 9);
    const Mechanism m = test::random_mechanism(random, n);
    const Pose pose{random.rotation(0.5), random.vector(1)};
    const Eigen::MatrixXd j = -wrench_matrix(m, pose).transpose();
    const Sensitivity found = sensitivity(m, pose);
    double move_each = 0, turn_each = 0, move_joint = 0, turn_joint = 0;
    for (int i = 0; i < 20000; ++i) {
      // Any twist, as large as the lengths allow: nothing may exceed the index, and the best of many comes near to it.
      Eigen::VectorXd twist;
      if (i % 2) {
        Eigen::VectorXd change(n);
        for (double& x : change) x = random.integer(0, 1) ? 1 : -1;
        twist = j.fullPivHouseholderQr().solve(change);
      } else {
        twist = Eigen::VectorXd(6);
        twist << random.vector(1), random.vector(4);
      }
      const double each = (j * twist).lpNorm<Eigen::Infinity>(), joint = (j * twist).norm();
      move_each = std::max(move_each, twist.head<3>().norm() / each);
      turn_each = std::max(turn_each, twist.tail<3>().norm() / each);
      move_joint = std::max(move_joint, twist.head<3>().norm() / joint);
      turn_joint = std::max(turn_joint, twist.tail<3>().norm() / joint);
      if (i > 400 && n == 6) break;  // all 64 corners have come up
    }
    const auto near = [](double seen, double index, double share) {
      EXPECT_LE(seen, index * (1 + 1e-9));
      EXPECT_GE(seen, share * index);
    };
    near(move_each, found.translation_each, n == 6 ? 1 - 1e-9 : 0.5);
    near(turn_each, found.rotation_each, n == 6 ? 1 - 1e-9 : 0.5);
    near(move_joint, found.translation_joint, 0.5);
    near(turn_joint, found.rotation_joint, 0.5);
  }
  Mechanism m = paper_mechanism();
  for (Cable& cable : m.cables) cable.attachment = {0.1, 0, 0};
  EXPECT_EQ(sensitivity(m, {}).rotation_each, INFINITY);
  const Sensitivity paper = sensitivity(paper_mechanism(), test::pose_on_hemisphere(1, 1));
  EXPECT_LT(paper.translation_each, 10);
}

}  // namespace
}  // namespace lumihull::capture
