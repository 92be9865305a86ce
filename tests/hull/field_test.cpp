// The octree against brute force: HullFunction at every sample of the same stored fields.

#include <lumihull/hull/carve.h>
#include <lumihull/hull/field.h>
#include <support.h>

#include <cmath>
#include <limits>
#include <random>

#include "synthetic.h"

namespace lumihull {
namespace {

using namespace hull;

struct Agreement {
  std::size_t inside = 0, signs_differing = 0, crossings = 0;
  double worst_value = 0;  // voxels, at both ends of crossed edges along x
};

Agreement compare(const HullFunction& f, const Field& field) {
  Agreement a;
  const Grid& grid = field.grid();
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j) {
      double before = 0;
      for (int i = 0; i < grid.size[0]; ++i) {
        const double phi = f(grid.sample(i, j, k));
        a.inside += phi < 0;
        a.signs_differing += (phi < 0) != field.inside(i, j, k);
        if (i > 0 && (phi < 0) != (before < 0) && std::isfinite(phi) && std::isfinite(before)) {
          ++a.crossings;
          a.worst_value = std::max({a.worst_value, std::abs(phi - field.at(i, j, k)) / grid.voxel,
                                    std::abs(before - field.at(i - 1, j, k)) / grid.voxel});
        }
        before = phi;
      }
    }
  EXPECT_EQ(a.inside, field.samples_inside());
  return a;
}

const test::Shape kObject = test::either({test::sphere({0, 0, 0}, 0.8), test::box({0.7, 0.1, 0}, {0.5, 0.2, 0.15}),
                                          test::capsule({0, 0, 0.4}, {0.2, 0.6, 1}, 0.12)});
const Box kRegion{{-1.1, -1, -1}, {1.3, 1, 1.2}};

TEST(Field, HasTheSignsOfBruteForce) {
  const auto views = test::views_around(test::pinhole(180, 150, 200), 25, 4);
  const auto silhouettes = test::silhouettes_of(kObject, views, {1, 10});
  Job job;
  for (const int tolerance : {1, 2, 4}) {
    SCOPED_TRACE(tolerance);
    CarveRule rule;
    rule.tolerance = tolerance;
    const HullFunction f(views, silhouettes, rule);
    const Agreement a = compare(f, sample_field(f, make_grid(kRegion, 46), job));
    EXPECT_GT(a.inside, 5000u);
    EXPECT_EQ(a.signs_differing, 0u);
    EXPECT_GT(a.crossings, 1000u);
    EXPECT_LT(a.worst_value, 1e-4);
  }
}

TEST(Field, HasTheSignsOfBruteForceForRandomCamerasWithLenses) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int round = 0; round < 3; ++round) {
    SCOPED_TRACE(round);
    std::vector<View> views;
    for (int i = 0; i < 14; ++i) {
      // Some pictures cut the object off, some cameras stand within the region, one looks away.
      Camera camera = test::pinhole(120 + 10 * i, 110, 90 + 60 * std::abs(unit(random)));
      camera.u0 += 40 * unit(random);
      camera.v0 += 30 * unit(random);
      camera.skew = 5 * unit(random);
      camera.s = 1 + 0.2 * unit(random);
      camera.k1 = 0.1 * unit(random);
      camera.p1 = 0.005 * unit(random);
      const Eigen::Vector3d direction = Eigen::Vector3d(unit(random), unit(random), unit(random)).normalized();
      const Eigen::Vector3d target = 0.4 * Eigen::Vector3d(unit(random), unit(random), unit(random));
      const double distance = i == 0 ? 1.25 : 2.5 + 1.5 * std::abs(unit(random));
      const Eigen::Vector3d eye = distance * direction;
      views.push_back({camera, look_at(eye, i == 1 ? Eigen::Vector3d(2 * eye) : target, Eigen::Vector3d(0.1, 0.2, 1))});
    }
    const auto silhouettes = test::silhouettes_of(kObject, views, {double(1 + round), 12});
    CarveRule rule;
    rule.min_views = 1 + round;
    rule.cut_planes = {{{0, 0, -2}, 1.4}};
    rule.cut_boxes = {{{0.9, -1, -1}, {1.2, 1, 1}}};
    Job job;
    const HullFunction f(views, silhouettes, rule);
    const Agreement a = compare(f, sample_field(f, make_grid(kRegion, 41), job));
    EXPECT_GT(a.inside, 2000u);
    EXPECT_EQ(a.signs_differing, 0u);
  }
}

TEST(Field, CutsAreExactHalfSpacesAndBoxes) {
  const auto views = test::views_around(test::pinhole(100, 100, 120), 8, 4);
  const auto silhouettes = test::silhouettes_of(test::sphere({0, 0, 0}, 1), views);
  CarveRule rule;
  rule.cut_planes = {{{0, 0, 3}, 0.9}};                  // z > 0.3
  rule.cut_boxes = {{{-0.2, -0.2, -2}, {0.2, 0.2, 2}}};  // a hole
  const HullFunction cut(views, silhouettes, rule), whole(views, silhouettes);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1.2, 1.2);
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d x(unit(random), unit(random), unit(random));
    const bool removed = x.z() > 0.3 || (std::abs(x.x()) < 0.2 && std::abs(x.y()) < 0.2);
    EXPECT_EQ(cut(x) < 0, whole(x) < 0 && !removed);
  }
}

TEST(Field, AVoxelThatNoViewSeesIsNotObject) {
  // One camera looks along x; half of the region is behind it.
  View view{test::pinhole(50, 50, 50), look_at({0, 0, 0}, {1, 0, 0}, {0, 0, 1})};
  Image full(50, 50, 1);
  std::fill_n(full.row<std::uint8_t>(0), 2500, std::uint8_t(255));
  const std::vector<View> views{view};
  const std::vector<Silhouette> silhouettes{Silhouette::from_mask(full, view.camera)};
  const HullFunction f(views, silhouettes);
  EXPECT_LT(f({2, 0, 0}), 0);
  EXPECT_EQ(f({-2, 0, 0}), std::numeric_limits<double>::infinity());
  EXPECT_EQ(f({2, 3, 0}), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(f.of_view(0, {-2, 0, 0}));
  Job job;
  const Field field = sample_field(f, make_grid({{-2, -2, -2}, {2.2, 2, 2}}, 30), job);
  const Agreement a = compare(f, field);
  EXPECT_EQ(a.signs_differing, 0u);
  EXPECT_GT(a.inside, 1000u);
}

TEST(Field, RefusesBadViewsAndGrids) {
  const auto views = test::views_around(test::pinhole(40, 40, 50), 4, 4);
  auto silhouettes = test::silhouettes_of(test::sphere({0, 0, 0}, 1), views);
  auto bad = views;
  bad[2].cam_from_world.translation.x() = std::numeric_limits<double>::quiet_NaN();
  const Error pose = test::expect_error([&] { HullFunction(bad, silhouettes); });
  EXPECT_EQ(pose.code(), ErrorCode::bad_input);
  EXPECT_EQ(pose.subject(), "view 2");
  silhouettes.pop_back();
  EXPECT_EQ(test::expect_error([&] { HullFunction(views, silhouettes); }).code(), ErrorCode::invalid_argument);
  CarveRule rule;
  rule.tolerance = 0;
  silhouettes.push_back(silhouettes[0]);
  EXPECT_EQ(test::expect_error([&] { HullFunction(views, silhouettes, rule); }).code(), ErrorCode::invalid_argument);
  const Box unit{{0, 0, 0}, {1, 1, 1}};
  for (const int resolution : {-1, 7, 2049})
    EXPECT_EQ(test::expect_error([&] { make_grid(unit, resolution); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(make_grid(unit, 8).size[1], 8);
  EXPECT_EQ(make_grid({{0, 0, 0}, {1, 0.5, 0.26}}, 100).size, (std::array<int, 3>{100, 50, 26}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Box& box : {Box{{0, 0, 0}, {1, 0, 1}}, Box{{0, 0, 0}, {1, nan, 1}}, Box{{1e9, 0, 0}, {1e9 + 1, 1, 1}}})
    EXPECT_EQ(test::expect_error([&] { make_grid(box, 64); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull
