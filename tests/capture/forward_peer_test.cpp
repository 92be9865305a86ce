// Forward kinematics against NLopt's optimisers on formulas of their own.
#include <lumihull/capture/forward.h>

#include <Eigen/Dense>
#include <algorithm>
#include <nlopt.hpp>

#include "mechanism_support.h"
#include "support.h"

namespace lumihull::capture {
namespace {

std::span<const double> span(const CableVector& v) { return {v.data(), std::size_t(v.size())}; }

/// Position and rotation vector (times 0.25 m) relative to a start.
Pose pose_of(const std::vector<double>& x, const Pose& start) {
  const Eigen::Vector3d turn(4 * x[3], 4 * x[4], 4 * x[5]);
  const double angle = turn.norm();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  if (angle > 0) q = Eigen::AngleAxisd(angle, turn / angle);
  return {(q * start.rotation).normalized(), start.translation + Eigen::Vector3d(x[0], x[1], x[2])};
}

double height(const Mechanism& m, const Pose& pose) { return (pose * m.center_of_mass).z(); }

double length(const Mechanism& m, std::size_t i, const Pose& pose) {
  return (pose * m.cables[i].attachment - m.cables[i].departure).norm();
}

/// Central differences of a function of the six unknowns.
template <class F>
double with_gradient(const std::vector<double>& x, std::vector<double>& gradient, const F& f) {
  if (!gradient.empty())
    for (std::size_t k = 0; k < 6; ++k) {
      std::vector<double> a = x, b = x;
      a[k] += 1e-6, b[k] -= 1e-6;
      gradient[k] = (f(a) - f(b)) / 2e-6;
    }
  return f(x);
}

struct Energy {
  const Mechanism* m;
  const CableVector* unstrained;
  Pose start;
  double operator()(const std::vector<double>& x) const {
    const Pose pose = pose_of(x, start);
    double sum = m->mass_kg * m->gravity_m_s2 * height(*m, pose);
    for (std::size_t i = 0; i < m->cables.size(); ++i) {
      const double l0 = (*unstrained)[Eigen::Index(i)], stretch = std::max(0.0, length(*m, i, pose) - l0);
      sum += m->cables[i].stiffness_N / (2 * l0) * stretch * stretch;
    }
    return sum;
  }
  static double call(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
    return with_gradient(x, gradient, *static_cast<const Energy*>(data));
  }
};

struct Excess {
  const Mechanism* m;
  std::size_t cable;
  double allowed;
  Pose start;
  static double call(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
    const auto& self = *static_cast<const Excess*>(data);
    return with_gradient(x, gradient, [&](const std::vector<double>& y) {
      return length(*self.m, self.cable, pose_of(y, self.start)) - self.allowed;
    });
  }
};

struct Height {
  const Mechanism* m;
  Pose start;
  static double call(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
    const auto& self = *static_cast<const Height*>(data);
    return with_gradient(x, gradient,
                         [&](const std::vector<double>& y) { return height(*self.m, pose_of(y, self.start)); });
  }
};

Pose view_pose(test::Random& random) {
  return test::pose_on_hemisphere(random.uniform(0, 2 * std::numbers::pi), random.uniform(0, std::numbers::pi / 2));
}

Pose start_near(test::Random& random, const Pose& pose) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.1, random.direction()));
  return {turn * pose.rotation, pose.translation + 0.1 * random.direction()};
}

double distance(const Pose& a, const Pose& b) {
  return std::max((a.translation - b.translation).norm(), 0.25 * a.rotation.angularDistance(b.rotation));
}

/// Forces and torques of cables and gravity about the platform's origin.
double imbalance(const Mechanism& m, const Hanging& h) {
  const Pose& pose = h.world_from_platform;
  Eigen::Vector3d force(0, 0, -m.mass_kg * m.gravity_m_s2), torque = (pose.rotation * m.center_of_mass).cross(force);
  for (std::size_t i = 0; i < m.cables.size(); ++i) {
    const Eigen::Vector3d at = pose * m.cables[i].attachment;
    const Eigen::Vector3d pull = h.tension_N[Eigen::Index(i)] * (m.cables[i].departure - at).normalized();
    force += pull, torque += (at - pose.translation).cross(pull);
  }
  return force.norm() + torque.norm();
}

TEST(HangElastic, EnergyIsNotAboveNloptsFromTheSameStart) {
  test::Random random(21);
  int same = 0, total = 0;
  for (int i = 0; i < 300; ++i) {
    Mechanism m = i % 3 ? paper_mechanism() : test::random_mechanism(random, random.integer(6, 9));
    for (Cable& cable : m.cables) cable.stiffness_N = 3e4;
    const Pose pose = view_pose(random);
    if (tensions(m, pose).balance != Balance::controlled) continue;
    const CableVector unstrained = unstrained_lengths(m, pose);
    const Pose start = start_near(random, pose);
    const Hanging found = hang_elastic(m, span(unstrained), start);
    ++total;
    Energy energy{&m, &unstrained, start};
    nlopt::opt opt(nlopt::LD_SLSQP, 6);
    opt.set_min_objective(&Energy::call, &energy);
    opt.set_xtol_abs(1e-10);
    opt.set_maxeval(3000);
    std::vector<double> x(6, 0.0);
    double least = 0;
    try {
      opt.optimize(x, least);
    } catch (const std::exception&) {  // its roundoff limit is near enough
    }
    Energy here{&m, &unstrained, found.world_from_platform};
    EXPECT_LT(here(std::vector<double>(6, 0.0)), energy(x) + 1e-6) << i;
    EXPECT_LT(imbalance(m, found), 1e-5) << i;
    same += distance(found.world_from_platform, pose) < 1e-8;
  }
  std::printf("%d of %d elastic equilibria are the commanded ones\n", same, total);
  EXPECT_GT(total, 180);
  EXPECT_GE(same, total - (total + 999) / 1000);
}

TEST(HangRigid, SlackCablesHangWhereNloptFindsTheLeastHeight) {
  test::Random random(22);
  int total = 0, slack = 0, failed = 0, lower_by_nlopt = 0;
  for (int i = 0; i < 300; ++i) {
    const int cables = i % 3 == 0 ? 6 : random.integer(4, 9);
    Mechanism m = i % 3 ? test::random_mechanism(random, cables) : paper_mechanism();
    const Pose pose = view_pose(random);
    CableVector lengths = cable_lengths(m, pose);
    for (double& l : lengths)
      if (random.integer(0, 2) == 0) l += random.uniform(0, 0.1);
    const Pose start = start_near(random, pose);
    Hanging found;
    ++total;
    try {
      found = hang_rigid(m, span(lengths), start);
    } catch (const Error& error) {
      std::printf("%d: %d cables: %s\n", i, cables, error.what());
      ++failed;
      continue;
    }
    // The conditions of the least height: balanced, no cable longer than it is, tension only where it is taut.
    const CableVector now = cable_lengths(m, found.world_from_platform);
    EXPECT_LT(imbalance(m, found), 1e-7) << i;
    EXPECT_LT((now - lengths).maxCoeff(), 1e-9) << i;
    EXPECT_GE(found.tension_N.minCoeff(), 0) << i;
    EXPECT_LT((lengths - now).cwiseProduct(found.tension_N).maxCoeff(), 1e-6) << i;
    slack += !found.taut;
    // From there NLopt finds nothing lower nearby.
    const Pose from = found.world_from_platform;
    Height objective{&m, from};
    std::vector<Excess> excess;
    for (std::size_t k = 0; k < m.cables.size(); ++k) excess.push_back({&m, k, lengths[Eigen::Index(k)], from});
    nlopt::opt opt(nlopt::LD_SLSQP, 6);
    opt.set_min_objective(&Height::call, &objective);
    for (Excess& e : excess) opt.add_inequality_constraint(&Excess::call, &e, 1e-9);
    opt.set_xtol_abs(1e-9);
    opt.set_maxeval(500);
    std::vector<double> x(6);
    for (double& v : x) v = random.uniform(-0.003, 0.003);
    double least = 0;
    try {
      opt.optimize(x, least);
    } catch (const std::exception&) {
      continue;
    }
    bool feasible = true;
    for (std::size_t k = 0; k < m.cables.size(); ++k)
      feasible = feasible && length(m, k, pose_of(x, from)) < lengths[Eigen::Index(k)] + 1e-8;
    if (feasible && height(m, pose_of(x, from)) < height(m, from) - 1e-6) ++lower_by_nlopt;
  }
  std::printf("%d of %d hang with a slack cable, %d failed, NLopt found lower ones beside %d\n", slack, total, failed,
              lower_by_nlopt);
  EXPECT_GT(slack, 100);
  EXPECT_EQ(failed, 0);
  EXPECT_EQ(lower_by_nlopt, 0);
}

TEST(HangRigid, FaultsAreNamed) {
  const Mechanism m = paper_mechanism();
  CableVector lengths = cable_lengths(m, {});
  const auto fault = [&](const CableVector& l, const Pose& start) {
    return test::expect_error([&] { hang_rigid(m, span(l), start); }).code();
  };
  EXPECT_EQ(fault(lengths.head(5), {}), ErrorCode::invalid_argument);
  CableVector bad = lengths;
  bad[2] = std::nan("");
  EXPECT_EQ(fault(bad, {}), ErrorCode::invalid_argument);
  bad[2] = 0;
  EXPECT_EQ(fault(bad, {}), ErrorCode::invalid_argument);
  bad = 0.3 * lengths;  // no pose can be that near to opposite walls
  EXPECT_EQ(fault(bad, {}), ErrorCode::degenerate);
  EXPECT_EQ(fault(lengths, {Eigen::Quaterniond::Identity(), {INFINITY, 0, 0}}), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { hang_elastic(m, span(lengths), {}); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] {
              unstrained_lengths(m, {Eigen::Quaterniond::Identity(), {30, 0, 0}});
            }).code(),
            ErrorCode::degenerate);
}

}  // namespace
}  // namespace lumihull::capture
