#include <lumihull/capture/workspace.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "design/sight.h"
#include "support.h"

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;
using test::expect_error;

/// Three points at 120 degrees, a pair of cables from each, to six evenly spaced points under the ceiling.
Mechanism symmetric_crane(double attachment_radius, double departure_radius, double height) {
  Mechanism m;
  m.name = "symmetric";
  m.room = {Vector3d(-9, -9, -1), Vector3d(9, 9, 9)};
  for (int i = 0; i < 6; ++i) {
    Cable cable;
    cable.name = std::to_string(i + 1);
    const double point = 2 * pi * (i / 2) / 3, wall = point + (i % 2 ? 1 : -1) * pi / 6;
    cable.attachment = attachment_radius * Vector3d(std::cos(point), std::sin(point), 0);
    cable.departure = {departure_radius * std::cos(wall), departure_radius * std::sin(wall), height};
    m.cables.push_back(cable);
  }
  return m;
}

/// Around a point, level, hardly moving.
Workspace still(double radius_m) {
  Workspace w;
  w.radius_m = radius_m;
  w.azimuths = 2, w.polar_steps = 2;
  w.tilt_factor = w.tilt_offset_rad = 0;
  return w;
}

Mechanism turned(Mechanism m, double angle) {
  const Eigen::AngleAxisd turn(angle, Vector3d::UnitZ());
  for (Cable& c : m.cables) c.departure = turn * c.departure, c.attachment = turn * c.attachment;
  m.room = {Vector3d(-20, -20, m.room.min().z()), Vector3d(20, 20, m.room.max().z())};
  return m;
}

TEST(Workspace, PoseIsTheProductOfThreeRotations) {
  for (double theta : {0.0, 0.7, 3.0, -2.0})
    for (double phi : {0.0, 0.4, 1.5}) {
      const Pose pose = platform_pose({1, 2, 3}, 2, theta, phi, 2.0 / 3, -pi / 6);
      const double tilt = 2.0 / 3 * phi - pi / 6;
      const Eigen::Quaterniond expected = Eigen::AngleAxisd(theta, Vector3d::UnitZ()) *
                                          Eigen::AngleAxisd(tilt, Vector3d::UnitY()) *
                                          Eigen::AngleAxisd(-theta, Vector3d::UnitZ());
      EXPECT_LT(pose.rotation.angularDistance(expected), 1e-15 + 1e-7);
      EXPECT_NEAR(std::abs(pose.rotation.dot(expected)), 1, 1e-15);
      const Vector3d out(std::sin(phi) * std::cos(theta), std::sin(phi) * std::sin(theta), std::cos(phi));
      EXPECT_LT((pose.translation - Vector3d(1, 2, 3) - 2 * out).norm(), 1e-14);
      EXPECT_LT((platform_pose({0, 0, 0}, 2, theta, phi, 1, 0).rotation * Vector3d::UnitZ() - out).norm(), 1e-14);
    }
}

TEST(Workspace, TiltGoesFromFirstToLast) {
  Workspace w;
  EXPECT_NEAR(w.tilt_factor * w.phi(0) + w.tilt_offset_rad, -pi / 6, 1e-15);  // the paper's
  EXPECT_NEAR(w.tilt_factor * w.phi(w.polar_steps - 1) + w.tilt_offset_rad, pi / 6, 1e-15);
  set_tilt(w, 0.1, 1.3);
  EXPECT_NEAR(w.tilt_factor * pi / 2 + w.tilt_offset_rad, 1.3, 1e-15);
  EXPECT_NEAR(w.tilt_offset_rad, 0.1, 1e-15);
}

TEST(PaperObjective, HandComputedCases) {
  Job job;
  // Level in the middle of a symmetric crane: all tensions are m g l / (6 h).
  const Mechanism crane = symmetric_crane(0.25, 5, 4);
  const Workspace w = still(1e-9);
  EXPECT_EQ(paper_objective(crane, w), -4);
  const WorkspaceReport report = examine(crane, w, nullptr, job);
  const double length = (crane.cables[0].departure - crane.cables[0].attachment).norm();
  for (const PoseReport& p : report.poses)
    for (int i = 0; i < 6; ++i)
      EXPECT_NEAR(p.tensions.tension_N[i], crane.mass_kg * crane.gravity_m_s2 * length / (6 * 4), 1e-6);
  EXPECT_EQ(report.paper_objective(), -4);
  EXPECT_DOUBLE_EQ(report.coverage(1, 0), 1);
  EXPECT_DOUBLE_EQ(report.coverage(1e3, 0), 0);

  // Cables that all pull downwards hold nothing, and in this fan none crosses another.
  EXPECT_EQ(paper_objective(symmetric_crane(0.25, 5, -0.9), w), 0);

  // Six vertical cables carry the weight, but nothing keeps the platform from swinging: that does not count.
  Mechanism vertical = crane;
  for (Cable& c : vertical.cables) c.departure = c.attachment + Vector3d(0, 0, 5);
  EXPECT_EQ(tensions(vertical, w.pose(0, 0)).balance, Balance::singular);
  EXPECT_EQ(paper_objective(vertical, w), 0);

  // From side to side under two departure points: one of two steps of the way swaps the order of two cables.
  Mechanism crossing = crane;
  crossing.cables[0].departure = {0.5, 4, 4}, crossing.cables[0].attachment = {-0.2, 0, 0};
  crossing.cables[2].departure = {-0.5, 4, 4}, crossing.cables[2].attachment = {0.2, 0, 0};
  int crossings = 0;
  const WorkspaceReport crossed = examine(crossing, still(1.5), nullptr, job);
  for (const PoseReport& p : crossed.poses) crossings += p.crossing.has_value();
  int balanced = 0;
  for (const PoseReport& p : crossed.poses) balanced += p.balanced();
  EXPECT_EQ(crossed.paper_objective(), crossings - balanced);
}

TEST(PaperObjective, CountsTheStepsOfTheProcedure) {
  Job job;
  // Every step is looked at: down an azimuth, and over to the next one's end; none leads from the last pose.
  const Mechanism m = paper_mechanism();
  Workspace w;
  w.azimuths = 3, w.polar_steps = 4, w.radius_m = 2.5;
  const WorkspaceReport report = examine(m, w, nullptr, job);
  for (int a = 0; a < w.azimuths; ++a)
    for (int s = 0; s < w.polar_steps; ++s) {
      const bool last = a == 2 && s == 3;
      const Pose next = s < 3 ? w.pose(a, s + 1) : w.pose(a + 1, 3);
      EXPECT_EQ(report.at(a, s).crossing.has_value(), !last && first_crossing(m, w.pose(a, s), next).has_value());
    }
  EXPECT_FALSE(report.poses.back().crossing);
  EXPECT_EQ(paper_objective(m, w), report.paper_objective());
}

TEST(PaperObjective, SymmetriesChangeNothing) {
  Job job;
  const Mechanism m = paper_mechanism();
  Workspace w;
  w.azimuths = 12, w.polar_steps = 6, w.radius_m = 2.4;  // so large that not all is reached
  const int value = paper_objective(m, w);
  EXPECT_GT(value, -72);
  EXPECT_LT(value, 0);

  Mechanism other = m;
  std::rotate(other.cables.begin(), other.cables.begin() + 2, other.cables.end());
  EXPECT_EQ(paper_objective(other, w), value);
  other = m, other.mass_kg *= 3;
  EXPECT_EQ(paper_objective(other, w), value);

  // Turned by three azimuths: the same tensions, three azimuths on.
  const WorkspaceReport here = examine(m, w, nullptr, job), there = examine(turned(m, pi / 2), w, nullptr, job);
  for (int a = 0; a < w.azimuths; ++a)
    for (int s = 0; s < w.polar_steps; ++s) {
      const PoseReport &p = here.at(a, s), &q = there.at((a + 3) % 12, s);
      ASSERT_EQ(p.balanced(), q.balanced());
      if (p.balanced()) {
        EXPECT_LT((p.tensions.tension_N - q.tensions.tension_N).norm(), 1e-6 * p.tensions.tension_N.norm());
      }
      EXPECT_NEAR(p.sight_rad, q.sight_rad, 1e-9);
    }
  // Larger in all but the platform's attachments is another mechanism; larger in all is the same.
  other = m;
  for (Cable& c : other.cables) c.departure *= 2, c.attachment *= 2;
  other.room = {2 * m.room.min(), 2 * m.room.max()};
  Workspace twice = w;
  twice.radius_m *= 2;
  EXPECT_EQ(paper_objective(other, twice), value);
}

TEST(Workspace, SightIsTheSmallestAngleOverAllPointsOfCables) {
  std::mt19937_64 engine(5);
  const auto within = [&](double reach) { return reach * (2 * double(engine() >> 11) * 0x1p-53 - 1); };
  const Mechanism m = paper_mechanism();
  for (int k = 0; k < 200; ++k) {
    const double theta = within(pi);
    const Pose pose = platform_pose({0, 0, 0}, 1.5, theta, 0.7 + within(0.7), 2.0 / 3, within(0.5));
    const Vector3d center(within(0.5), within(0.5), within(0.5));
    double least = pi;
    const Vector3d eye = pose * cam_from_platform(m, theta).center(), sight = (center - eye).normalized();
    for (const Cable& c : m.cables)
      for (int i = 0; i <= 4000; ++i) {
        const Vector3d x = pose * c.attachment + i / 4000.0 * (c.departure - pose * c.attachment) - eye;
        least = std::min(least, std::acos(std::clamp(sight.dot(x.normalized()), -1.0, 1.0)));
      }
    const double found = design::sight_rad(m, pose, theta, center, 0.2) + std::asin(0.2 / (center - eye).norm());
    EXPECT_LE(found, least + 1e-9);
    EXPECT_NEAR(found, least, 0.01);
  }
}

TEST(Workspace, TiltRangeEndsWhereBalanceDoes) {
  const Mechanism m = paper_mechanism();
  Workspace w;
  for (int a = 0; a < w.azimuths; a += 5)
    for (int s = 0; s < w.polar_steps; s += 3) {
      const TiltRange r = tilt_range(m, w, a, s);
      if (!std::isfinite(r.low_rad)) continue;
      const auto balance = [&](double tilt) {
        return static_test(m, platform_pose(w.center, w.radius_m, w.theta(a), w.phi(s), 0, tilt));
      };
      EXPECT_NE(balance(r.low_rad), Balance::unbalanced);
      EXPECT_NE(balance(r.high_rad), Balance::unbalanced);
      if (r.high_rad < 1.5) {
        EXPECT_EQ(balance(r.high_rad + pi / 180), Balance::unbalanced);
      }
      if (r.low_rad > -1.5) {
        EXPECT_EQ(balance(r.low_rad - pi / 180), Balance::unbalanced);
      }
      const TiltRange tighter = tilt_range(m, w, a, s, 3);
      if (std::isfinite(tighter.low_rad)) {
        EXPECT_LE(tighter.high_rad, r.high_rad);
        EXPECT_GE(tighter.low_rad, r.low_rad);
      }
    }
}

TEST(Workspace, Faults) {
  Job job;
  const Mechanism m = paper_mechanism();
  const auto failing = [&](auto change) {
    Workspace w;
    change(w);
    const Error e = expect_error([&] { examine(m, w, nullptr, job); });
    EXPECT_EQ(e.code(), ErrorCode::invalid_argument);
    return e.message();
  };
  EXPECT_NE(failing([](Workspace& w) { w.radius_m = 0; }).find("radius"), std::string::npos);
  EXPECT_NE(failing([](Workspace& w) { w.azimuths = 0; }).find("azimuths"), std::string::npos);
  EXPECT_NE(failing([](Workspace& w) { w.polar_steps = 1; }).find("polar"), std::string::npos);
  EXPECT_NE(failing([](Workspace& w) { w.center.x() = std::nan(""); }).find("centre"), std::string::npos);
  EXPECT_NE(failing([](Workspace& w) { w.tilt_factor = std::nan(""); }).find("tilt"), std::string::npos);
  EXPECT_NE(failing([](Workspace& w) { w.last_phi_rad = w.first_phi_rad; }).find("phi"), std::string::npos);
}

}  // namespace
}  // namespace lumihull::capture
