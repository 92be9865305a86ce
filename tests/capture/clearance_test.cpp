#include <lumihull/capture/clearance.h>
#include <segments.h>

#include <Eigen/Dense>

#include "mechanism_support.h"
#include "support.h"

namespace lumihull::capture {
namespace {

using internal::Segment;

Segment random_segment(test::Random& random, int kind) {
  Segment s{random.vector(1), random.vector(1)};
  if (kind == 1) s.to = s.from;
  if (kind == 2) s.from.z() = s.to.z() = 0;
  if (kind == 3)
    s = {Eigen::Vector3d(random.integer(-1, 1), random.integer(-1, 1), 0),
         Eigen::Vector3d(random.integer(-1, 1), 1, 0)};
  return s;
}

/// Least distance by alternating projection from a grid: the distance is convex, so any start would do.
double distance_by_search(const Segment& a, const Segment& b) {
  double best = INFINITY;
  for (int i = 0; i <= 4; ++i) {
    double s = i / 4.0;
    for (int k = 0; k < 3000; ++k) {
      const Eigen::Vector3d p = a.from + s * (a.to - a.from), d = b.to - b.from;
      const double t = d.squaredNorm() > 0 ? std::clamp((p - b.from).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
      const Eigen::Vector3d q = b.from + t * d, e = a.to - a.from;
      const double next = e.squaredNorm() > 0 ? std::clamp((q - a.from).dot(e) / e.squaredNorm(), 0.0, 1.0) : 0;
      best = std::min(best, (a.from + next * e - q).norm());
      if (std::abs(next - s) < 1e-15) break;
      s = next;
    }
  }
  return best;
}

TEST(Segments, DistanceIsTheSearchs) {
  test::Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const Segment a = random_segment(random, i % 4), b = random_segment(random, (i / 4) % 4);
    const double found = internal::distance(a, b), searched = distance_by_search(a, b);
    ASSERT_LE(found, searched + 1e-12) << i;
    ASSERT_NEAR(found, searched, 1e-4) << i;
    ASSERT_NEAR(found, internal::distance(b, a), 1e-12);
  }
}

/// Distance from the keep-out's solid by its definition: nearest of many of its points, with the sign by membership.
double object_distance_by_search(const KeepOut& k, const Eigen::Vector3d& p) {
  const double out = std::hypot(p.x() - k.base.x(), p.y() - k.base.y()), z = p.z() - k.base.z();
  double least = INFINITY;
  const auto add = [&](double r, double h) { least = std::min(least, std::hypot(out - r, z - h)); };
  for (int i = 0; i <= 400; ++i) {
    const double t = i / 400.0, a = t * std::numbers::pi / 2;
    add(k.radius_m * t, 0);
    add(k.radius_m, k.height_m * t);
    add(k.radius_m * std::cos(a), k.height_m + k.radius_m * std::sin(a));
  }
  const bool inside = z >= 0 && (z <= k.height_m ? out <= k.radius_m : std::hypot(out, z - k.height_m) <= k.radius_m);
  return inside ? -least : least;
}

TEST(Clearance, IsWhatSamplingTheCablesFinds) {
  test::Random random(2);
  for (int i = 0; i < 200; ++i) {
    Mechanism m = test::random_mechanism(random, random.integer(3, 12));
    m.platform_radius_m = random.uniform(0.1, 0.3);
    m.cable_radius_m = random.uniform(0, 0.01);
    if (i % 3 == 0) m.cables[1].attachment = m.cables[0].attachment;
    if (i % 3 == 1) m.cables[2].departure = m.cables[0].departure;
    const Pose pose{random.rotation(1), random.vector(2)};
    const KeepOut object{random.vector(0.5), random.uniform(0, 0.5), random.uniform(0, 1)};
    const Clearance found = clearance(m, pose, &object);
    double cable_object = INFINITY, cable_camera = INFINITY, cable_platform = INFINITY, cable_cable = INFINITY;
    const int steps = 400;
    for (std::size_t a = 0; a < m.cables.size(); ++a) {
      const Eigen::Vector3d from = pose * m.cables[a].attachment, to = m.cables[a].departure;
      for (int s = 0; s <= steps; ++s) {
        const Eigen::Vector3d p = from + (to - from) * s / steps;
        cable_object = std::min(cable_object, object_distance_by_search(object, p) - m.cable_radius_m);
        cable_camera = std::min(cable_camera, (p - pose.translation).norm() - m.cable_radius_m);
        if (m.cables[a].attachment.norm() > m.platform_radius_m)
          cable_platform =
              std::min(cable_platform, (p - pose.translation).norm() - m.platform_radius_m - m.cable_radius_m);
        for (std::size_t b = a + 1; b < m.cables.size(); ++b) {
          const Eigen::Vector3d from_b = pose * m.cables[b].attachment, to_b = m.cables[b].departure;
          if (m.cables[a].attachment == m.cables[b].attachment && (p - from).norm() < 0.05) continue;
          if (m.cables[a].departure == m.cables[b].departure && (p - to).norm() < 0.05) continue;
          const Eigen::Vector3d d = to_b - from_b;
          double low = 0, high = 1;
          if (m.cables[a].attachment == m.cables[b].attachment) low = 0.05 / d.norm();
          if (m.cables[a].departure == m.cables[b].departure) high = 1 - 0.05 / d.norm();
          const double t = std::clamp((p - from_b).dot(d) / d.squaredNorm(), low, high);
          cable_cable = std::min(cable_cable, (p - from_b - t * d).norm() - 2 * m.cable_radius_m);
        }
      }
      if (i % 10) break;  // all pairs and cables now and then
    }
    const double step = 0.04;  // 16 m / 400
    const auto near = [&](double exact, double sampled) {
      EXPECT_LE(exact, sampled + 3e-3) << i;
      if (i % 10 == 0 && std::isfinite(sampled)) {
        EXPECT_GE(exact, sampled - step) << i;
      }
    };
    near(found.cable_object, cable_object);
    near(found.cable_camera, cable_camera);
    near(found.cable_platform, cable_platform);
    near(found.cable_cable, cable_cable);
    EXPECT_NEAR(found.platform_object, object_distance_by_search(object, pose.translation) - m.platform_radius_m, 3e-3);
  }
}

TEST(Clearance, RoomAndFaults) {
  const Mechanism m = paper_mechanism();
  EXPECT_NEAR(clearance(m, {}).platform_room, 0.7, 1e-12);  // the floor is 1 m below
  EXPECT_NEAR(clearance(m, {Eigen::Quaterniond::Identity(), {7, 0, 0}}).platform_room, -2.3, 1e-12);
  EXPECT_EQ(clearance(m, {}).cable_object, INFINITY);
  EXPECT_EQ(clearance(m, {}).cable_platform, INFINITY);
  const KeepOut bad{{0, 0, 0}, -1, 1};
  EXPECT_EQ(test::expect_error([&] { clearance(m, {}, &bad); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { clearance({}, {}); }).code(), ErrorCode::invalid_argument);
}

/// The pose on the way, by Eigen's slerp.
Pose on_the_way(const Pose& from, const Pose& to, double t) {
  return {from.rotation.slerp(t, to.rotation), from.translation + t * (to.translation - from.translation)};
}

/// The first time at which two cables change the side on which they pass each other while they overlap.
std::optional<double> crossing_by_steps(const Mechanism& m, const Pose& from, const Pose& to, int steps,
                                        double* nearest) {
  const auto volume = [&](std::size_t i, std::size_t k, double t, bool* overlap) {
    const Pose pose = on_the_way(from, to, t);
    const Eigen::Vector3d di = pose * m.cables[i].attachment - m.cables[i].departure;
    const Eigen::Vector3d dk = pose * m.cables[k].attachment - m.cables[k].departure;
    const Eigen::Vector3d e = m.cables[k].departure - m.cables[i].departure;
    Eigen::Matrix<double, 3, 2> a;
    a << di, -dk;
    const Eigen::Vector2d st = a.colPivHouseholderQr().solve(e);
    *overlap = st.minCoeff() > 0 && st.maxCoeff() < 1;
    *nearest = std::min({*nearest, std::abs(st[0]), std::abs(st[1]), std::abs(1 - st[0]), std::abs(1 - st[1])});
    return Eigen::Matrix3d((Eigen::Matrix3d() << di, dk, e).finished()).determinant();
  };
  std::optional<double> first;
  for (std::size_t i = 0; i < m.cables.size(); ++i)
    for (std::size_t k = i + 1; k < m.cables.size(); ++k) {
      if (m.cables[i].attachment == m.cables[k].attachment || m.cables[i].departure == m.cables[k].departure) continue;
      double unused = INFINITY;
      double* const keep = nearest;
      bool overlap;
      nearest = &unused;
      double before = volume(i, k, 0, &overlap);
      for (int s = 1; s <= steps; ++s) {
        const double now = volume(i, k, double(s) / steps, &overlap);
        if ((before > 0) != (now > 0)) {
          double low = double(s - 1) / steps, high = double(s) / steps;
          while (high - low > 1e-13) {
            const double middle = 0.5 * (low + high);
            ((volume(i, k, middle, &overlap) > 0) == (before > 0) ? low : high) = middle;
          }
          nearest = keep;
          volume(i, k, high, &overlap);
          nearest = &unused;
          if (overlap && (!first || high < *first)) first = high;
        }
        before = now;
      }
      nearest = keep;
    }
  return first;
}

TEST(Crossing, TwentyThousandAgainstBruteForce) {
  test::Random random(7);
  int crossed = 0, mismatches = 0, verges = 0;
  for (int i = 0; i < 20000; ++i) {
    Mechanism m = i % 4 ? test::random_mechanism(random, 4) : paper_mechanism();
    if (i % 4 == 0)
      m.cables[0].departure.x() += random.uniform(-3, 3), m.cables[4].departure.y() += random.uniform(-2, 4);
    const Pose from{random.rotation(0.8), random.vector(2)};
    Pose to{i % 3 ? from.rotation * random.rotation(1.2) : from.rotation, from.translation + random.vector(1)};
    if (i % 5 == 0) to.rotation.coeffs() *= -1;  // the same rotation
    if (i % 7 == 0) to.translation = from.translation;
    double nearest = INFINITY;
    const auto expected = crossing_by_steps(m, from, to, 64, &nearest);
    const auto found = first_crossing(m, from, to);
    crossed += expected.has_value();
    bool same = found.has_value() == expected.has_value();
    if (same && found) same = std::abs(found->at - *expected) < 1e-6;
    if (!same) {
      // Two crossings within one of the search's steps, or an end within a hair of the other cable.
      double finer = INFINITY;
      const auto again = crossing_by_steps(m, from, to, 4096, &finer);
      if (finer < 1e-6) {
        ++verges;
        continue;
      }
      same = found.has_value() == again.has_value() && (!found || std::abs(found->at - *again) < 1e-6);
    }
    mismatches += !same;
    EXPECT_TRUE(same) << i;
  }
  EXPECT_EQ(mismatches, 0);
  EXPECT_LT(verges, 20);
  EXPECT_GT(crossed, 1000);
  std::printf("%d of 20000 cross, %d on the verge\n", crossed, verges);
}

TEST(Crossing, HoldsBackwardsAndInOnePlane) {
  Mechanism m = paper_mechanism();
  m.cables.resize(3);
  // Two cables in the plane y = 0; the third is out of the way. They come to lie across each other.
  m.cables[0].departure = {-4, 0, 4}, m.cables[0].attachment = {0, 0, 0};
  m.cables[1].departure = {4, 0, 4}, m.cables[1].attachment = {0.2, 0, 0};
  m.cables[2].departure = {0, 6, 4}, m.cables[2].attachment = {0, 0.2, 0};
  const Eigen::Quaterniond upside(Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitY()));
  const auto crossing = first_crossing(m, {}, {upside, {0, 0, 0}});
  ASSERT_TRUE(crossing);
  EXPECT_EQ(crossing->first, 0);
  EXPECT_EQ(crossing->second, 1);
  EXPECT_FALSE(first_crossing(m, {}, {Eigen::Quaterniond::Identity(), {0.5, 0, 0.5}}));
  EXPECT_FALSE(first_crossing(m, {}, {}));
  EXPECT_EQ(test::expect_error([&] {
              first_crossing(m, {}, {upside, {std::nan(""), 0, 0}});
            }).code(),
            ErrorCode::invalid_argument);
}

TEST(CablesInPicture, AreThoseWhosePointsProjectIntoIt) {
  test::Random random(9);
  Camera camera;
  camera.width = 3072, camera.height = 2048;
  camera.f = 2500, camera.u0 = 1536, camera.v0 = 1024;
  int seen = 0;
  for (int i = 0; i < 400; ++i) {
    camera.k1 = i % 2 ? 0.08 : 0;
    const Mechanism m = test::random_mechanism(random, 8);
    const Pose pose{random.rotation(0.5), random.vector(1)};
    const Pose cam_from_world = Pose{random.rotation(3), Eigen::Vector3d::Zero()} * pose.inverse();
    const auto found = cables_in_picture(m, pose, camera, cam_from_world);
    std::vector<bool> listed(m.cables.size());
    for (const CableInPicture& cable : found) {
      listed[std::size_t(cable.cable)] = true;
      EXPECT_GE(cable.from_m.z(), 0.0009);
      if (cable.from_px && !(i % 2)) {
        EXPECT_LT((*cable.from_px - *camera.project(cable.from_m)).norm(), 1e-9);
        EXPECT_LE((*cable.from_px - Eigen::Vector2d(1536, 1024))
                      .cwiseAbs()
                      .cwiseQuotient(Eigen::Vector2d(1536, 1024))
                      .maxCoeff(),
                  1 + 1e-9);
      }
    }
    for (std::size_t k = 0; k < m.cables.size(); ++k) {
      bool inside = false;
      const Eigen::Vector3d from = pose * m.cables[k].attachment, to = m.cables[k].departure;
      for (int s = 0; s <= 500 && !inside; ++s) {
        const Eigen::Vector3d p = cam_from_world * (from + (to - from) * s / 500);
        if (p.z() < 0.001) continue;
        const auto px = camera.project(p);
        inside = px && camera.contains(*px);
      }
      seen += inside;
      if (inside) {
        EXPECT_TRUE(listed[k]) << i << ' ' << k;
      }
    }
  }
  EXPECT_GT(seen, 100);
  // Straight ahead of a camera that looks up, and none for one that looks down.
  Mechanism m = paper_mechanism();
  const Pose up = look_at({0, 0, 0}, {0, 0, 5}, {0, 1, 0}), down = look_at({0, 0, 0}, {0, 0, -5}, {0, 1, 0});
  m.cables[0].departure = {0, 0, 5}, m.cables[0].attachment = {0, 0, 0.1};
  const auto ahead = cables_in_picture(m, {}, camera, up);
  ASSERT_EQ(ahead.size(), 1u);
  EXPECT_LT((*ahead[0].to_px - Eigen::Vector2d(1536, 1024)).norm(), 1e-6);
  EXPECT_TRUE(cables_in_picture(m, {}, camera, down).empty());
  camera.f = -1;
  EXPECT_EQ(test::expect_error([&] { cables_in_picture(m, {}, camera, up); }).code(), ErrorCode::bad_input);
}

}  // namespace
}  // namespace lumihull::capture
