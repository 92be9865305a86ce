#include <lumihull/hull/carve.h>
#include <lumihull/hull/mesh_check.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/hull/region.h>
#include <lumihull/hull/simplify.h>
#include <support.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "synthetic.h"

namespace lumihull {
namespace {

using namespace hull;

CarveOptions at(int resolution, std::optional<Box> region = std::nullopt) {
  CarveOptions options;
  options.resolution = resolution;
  options.region = region;
  return options;
}

void expect_good(const Mesh& mesh) {
  const MeshCheck check = check_mesh(mesh);
  EXPECT_TRUE(check.closed);
  EXPECT_TRUE(check.manifold);
  EXPECT_TRUE(check.oriented);
  EXPECT_EQ(check.degenerate_triangles, 0u);
  EXPECT_EQ(check.unused_vertices, 0u);
  EXPECT_GT(check.volume, 0);
  if (check.self_intersections) {
    EXPECT_EQ(*check.self_intersections, 0u);
  }
}

TEST(Carve, ASphereIsASphere) {
  // n tangent cones around a sphere leave it a little larger: caps of the tangent planes between the contours.
  const auto views = test::views_around(test::pinhole(240, 240, 300), 80, 4);
  const auto silhouettes = test::silhouettes_of(test::sphere({0.1, -0.05, 0.2}, 1), views, {1, 10});
  Job job;
  const CarveResult result = carve(views, silhouettes, at(64), job);
  expect_good(result.mesh);
  EXPECT_EQ(check_mesh(result.mesh, false).euler, 2);
  double low = 10, sum = 0;
  for (const Eigen::Vector3f& v : result.mesh.vertices) {
    const double r = (v.cast<double>() - Eigen::Vector3d(0.1, -0.05, 0.2)).norm();
    low = std::min(low, r);
    sum += r;
  }
  EXPECT_GT(low, 1 - 0.1 * result.grid.voxel - 0.002);  // never inside the object
  EXPECT_LT(sum / double(result.mesh.vertices.size()), 1 + 0.15 * result.grid.voxel + 0.005);
  // The region was found: tight, and the sphere in its middle.
  EXPECT_LT(result.grid.region.size().maxCoeff(), 2.35);
  EXPECT_LT((result.grid.region.center() - Eigen::Vector3d(0.1, -0.05, 0.2)).norm(), 0.1);
}

TEST(Carve, ATorusKeepsItsHoleAndTwoObjectsStayTwo) {
  const auto views = test::views_around(test::pinhole(140, 140, 168), 30, 4);
  Job job;
  const CarveResult ring = carve(views, test::silhouettes_of(test::torus(0.8, 0.25), views, {1, 10}), at(56), job);
  expect_good(ring.mesh);
  EXPECT_EQ(check_mesh(ring.mesh, false).euler, 0);
  const auto two = test::either({test::sphere({-0.6, 0, 0}, 0.4), test::box({0.6, 0, 0.1}, {0.2, 0.3, 0.3})});
  const auto silhouettes = test::silhouettes_of(two, views, {1, 10});
  const CarveResult both = carve(views, silhouettes, at(56), job);
  expect_good(both.mesh);
  EXPECT_EQ(check_mesh(both.mesh, false).parts, 2u);
  CarveOptions only_large = at(56);
  only_large.min_component = 0.9;
  const CarveResult one = carve(views, silhouettes, only_large, job);
  EXPECT_EQ(check_mesh(one.mesh, false).parts, 1u);
  EXPECT_EQ(one.statistics.specks_removed, 1u);
}

TEST(Carve, AgreesWithTheExactPolyhedralHullOfABox) {
  // Silhouettes of a convex polyhedron are convex polygons: the hull is an intersection of half-spaces, one for each
  // silhouette edge. Its signed distance is at least the largest of theirs.
  const Eigen::Vector3d half(0.7, 0.5, 0.6);
  const auto views = test::views_around(test::pinhole(300, 300, 420), 12, 4);
  Job job;
  const CarveResult result =
      carve(views, test::silhouettes_of(test::box({0, 0, 0}, half), views, {1, 14}), at(64), job);
  expect_good(result.mesh);
  struct Plane {
    Eigen::Vector3d n;
    double d;
  };
  std::vector<Plane> planes;
  for (const View& view : views) {
    const Eigen::Vector3d c = view.center();
    // Edges between a face that the camera sees and one that it doesn't.
    for (int axis = 0; axis < 3; ++axis)
      for (int a = -1; a <= 1; a += 2)
        for (int b = -1; b <= 1; b += 2) {
          const int u = (axis + 1) % 3, v = (axis + 2) % 3;
          const bool seen_u = a * c[u] > half[u], seen_v = b * c[v] > half[v];
          if (seen_u == seen_v) continue;
          Eigen::Vector3d p = Eigen::Vector3d::Zero(), along = Eigen::Vector3d::Zero();
          p[u] = a * half[u], p[v] = b * half[v], along[axis] = 1;
          Eigen::Vector3d n = along.cross(p - c).normalized();
          if (n.dot(-p) > 0) n = -n;  // the object's middle is inside
          planes.push_back({n, n.dot(p)});
        }
  }
  ASSERT_GE(planes.size(), 4 * views.size());
  std::vector<double> off;
  for (const Eigen::Vector3f& vertex : result.mesh.vertices) {
    double d = -10;
    for (const Plane& plane : planes) d = std::max(d, plane.n.dot(vertex.cast<double>()) - plane.d);
    off.push_back(std::abs(d) / result.grid.voxel);
  }
  std::sort(off.begin(), off.end());
  EXPECT_LT(off[off.size() / 2], 0.1);
  EXPECT_LT(off[off.size() * 95 / 100], 0.5);
}

TEST(Carve, RenderedAgainItHasTheSilhouettesThatMadeIt) {
  const auto object = test::either({test::sphere({0, 0, 0}, 0.8), test::capsule({0, 0, 0.4}, {0.3, 0.7, 1}, 0.15)});
  const auto views = test::views_around(test::pinhole(160, 160, 200), 30, 4);
  const auto silhouettes = test::silhouettes_of(object, views, {1, 8});
  Job job;
  const CarveResult result = carve(views, silhouettes, at(160), job);
  const RayScene scene(result.mesh);
  for (std::size_t i = 0; i < views.size(); i += 7) {
    const Image mask = test::mask_of(object, views[i]);
    const Eigen::Matrix3d world_from_cam = views[i].cam_from_world.rotation.conjugate().toRotationMatrix();
    double both = 0, any = 0;
    for (int y = 0; y < 160; ++y)
      for (int x = 0; x < 160; ++x) {
        int hits = 0;
        for (int s = 0; s < 16; ++s) {
          const auto ray = views[i].camera.ray({x + (s % 4 + 0.5) / 4, y + (s / 4 + 0.5) / 4});
          hits += scene.occluded({views[i].center().cast<float>(), (world_from_cam * *ray).cast<float>()});
        }
        const double a = hits / 16.0, b = mask.row<std::uint8_t>(y)[x] / 255.0;
        both += std::min(a, b);
        any += std::max(a, b);
      }
    EXPECT_GT(both / any, 0.99);
  }
}

TEST(Carve, ClosesTheSurfaceAtTheRegionsFaces) {
  const auto views = test::views_around(test::pinhole(120, 120, 150), 20, 4);
  const auto silhouettes = test::silhouettes_of(test::sphere({0, 0, 0}, 1), views, {1, 8});
  Job job;
  const CarveResult half = carve(views, silhouettes, at(33, Box{{-1.2, -1.2, 0}, {1.2, 1.2, 1.2}}), job);
  expect_good(half.mesh);
  for (const Eigen::Vector3f& v : half.mesh.vertices) EXPECT_GE(v.z(), -1e-6f);
  EXPECT_NEAR(check_mesh(half.mesh, false).volume, 2 * std::numbers::pi / 3, 0.1);
  const CarveResult inside = carve(views, silhouettes, at(20, Box{{-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}}), job);
  expect_good(inside.mesh);
  EXPECT_NEAR(check_mesh(inside.mesh, false).volume, 0.216, 0.003);
}

TEST(Carve, IsTheSameForAnyNumberOfThreadsAndOrderOfPhotographs) {
  const auto object = test::either({test::sphere({0, 0, 0}, 0.8), test::box({0.7, 0, 0}, {0.4, 0.2, 0.2})});
  auto views = test::views_around(test::pinhole(140, 140, 170), 24, 4);
  const auto load = [&](std::size_t i) { return test::mask_of(object, views[i]); };
  Job one({}, 1), two({}, 2);
  const Box region{{-1.2, -1.2, -1.2}, {1.3, 1.2, 1.2}};
  const auto a = make_silhouettes(views, load, region, 70, {}, {}, one),
             b = make_silhouettes(views, load, region, 70, {}, {}, two);
  const CarveResult first = carve(views, a, at(70), one), second = carve(views, b, at(70), two);
  ASSERT_EQ(first.mesh.triangles, second.mesh.triangles);
  EXPECT_EQ(std::memcmp(first.mesh.vertices.data(), second.mesh.vertices.data(), first.mesh.vertices.size() * 12), 0);

  std::vector<View> shuffled_views;
  std::vector<Silhouette> shuffled;
  for (std::size_t i = 0; i < views.size(); ++i) {
    shuffled_views.push_back(views[(7 * i + 3) % views.size()]);
    shuffled.push_back(a[(7 * i + 3) % views.size()]);
  }
  const CarveResult third = carve(shuffled_views, shuffled, at(70, first.grid.region), two);
  const CarveResult fourth = carve(views, a, at(70, first.grid.region), two);
  ASSERT_EQ(third.mesh.triangles, fourth.mesh.triangles);
  EXPECT_EQ(third.mesh.vertices, fourth.mesh.vertices);
}

TEST(Carve, ScaleAndRotationOfTheWorldMoveItAlong) {
  const auto object = test::either({test::sphere({0, 0, 0}, 0.8), test::box({0.7, 0, 0}, {0.4, 0.2, 0.2})});
  const auto views = test::views_around(test::pinhole(140, 140, 170), 24, 4);
  const auto silhouettes = test::silhouettes_of(object, views, {1, 8});
  const Box region{{-1, -1.1, -0.9}, {1.2, 1, 1}};
  Job job;
  const CarveResult plain = carve(views, silhouettes, at(50, region), job);
  // A quarter turn takes the grid onto itself: x' = s (y, -x, z).
  for (const double scale : {1e-3, 250.0}) {
    Eigen::Matrix3d turn;
    turn << 0, 1, 0, -1, 0, 0, 0, 0, 1;
    auto moved = views;
    for (View& v : moved) {
      v.cam_from_world.rotation = v.cam_from_world.rotation * Eigen::Quaterniond(Eigen::Matrix3d(turn.transpose()));
      v.cam_from_world.translation *= scale;
    }
    const Box turned{scale * Eigen::Vector3d(region.min.y(), -region.max.x(), region.min.z()),
                     scale * Eigen::Vector3d(region.max.y(), -region.min.x(), region.max.z())};
    // The sides must be whole voxels for the two grids to be one.
    const double voxel = plain.grid.voxel;
    Box exact = turned;
    exact.min.y() = -scale * (region.min.x() + voxel * plain.grid.size[0]);
    const CarveResult other = carve(moved, silhouettes, at(50, exact), job);
    EXPECT_EQ(other.statistics.samples_inside, plain.statistics.samples_inside);
    EXPECT_NEAR(enclosed_volume(other.mesh) / std::pow(scale, 3), enclosed_volume(plain.mesh), 1e-5);
    Mesh back = other.mesh;
    for (Eigen::Vector3f& v : back.vertices) v = Eigen::Vector3f(-v.y(), v.x(), v.z()) / float(scale);
    // The same vertices; which diagonals divide a cell's polygons depends on its orientation.
    ASSERT_EQ(back.vertices.size(), plain.mesh.vertices.size());
    float worst = 0;
    for (const Eigen::Vector3f& v : back.vertices) {
      float nearest = std::numeric_limits<float>::max();
      for (const Eigen::Vector3f& w : plain.mesh.vertices) nearest = std::min(nearest, (v - w).squaredNorm());
      worst = std::max(worst, nearest);
    }
    EXPECT_LT(std::sqrt(worst), 1e-3 * voxel);
    // And without a region, to within the voxels that another region has.
    EXPECT_NEAR(enclosed_volume(carve(moved, silhouettes, at(50), job).mesh) / std::pow(scale, 3),
                enclosed_volume(plain.mesh), 0.02);
  }
}

TEST(Carve, AToleranceSurvivesDamagedMasks) {
  const auto object = test::either({test::sphere({0, 0, 0}, 0.8), test::capsule({0, 0, 0.4}, {0.4, 0.9, 0.9}, 0.15)});
  const auto views = test::views_around(test::pinhole(140, 140, 160), 60, 4);
  auto silhouettes = test::silhouettes_of(object, views, {1, 8});
  Job job;
  const double truth = enclosed_volume(carve(views, silhouettes, at(64), job).mesh);
  for (const std::size_t damaged : {5u, 23u, 47u}) {  // 5 %: half of the silhouette is missing
    Image mask = test::mask_of(object, views[damaged]);
    for (int y = 0; y < mask.height(); ++y) std::fill_n(mask.row<std::uint8_t>(y), 70, std::uint8_t(0));
    silhouettes[damaged] = Silhouette::from_mask(mask, views[damaged].camera, {1, 8});
  }
  CarveOptions options = at(64);
  EXPECT_LT(enclosed_volume(carve(views, silhouettes, options, job).mesh), 0.8 * truth);
  options.rule.tolerance = 4;
  const double robust = enclosed_volume(carve(views, silhouettes, options, job).mesh);
  EXPECT_GT(robust, 0.99 * truth);
  EXPECT_LT(robust, 1.15 * truth);
}

TEST(Carve, AVanishingHullNamesThePhotograph) {
  const auto views = test::views_around(test::pinhole(100, 100, 120), 16, 4);
  auto silhouettes = test::silhouettes_of(test::sphere({0, 0, 0}, 0.8), views, {1, 8});
  silhouettes[11] = Silhouette::from_mask(Image(100, 100, 1), views[11].camera);
  CarveOptions options = at(40, Box{{-1, -1, -1}, {1, 1, 1}});
  for (std::size_t i = 0; i < views.size(); ++i) options.names.push_back("IMG_" + std::to_string(100 + i));
  Job job;
  Error error = test::expect_error([&] { carve(views, silhouettes, options, job); });
  EXPECT_EQ(error.code(), ErrorCode::degenerate);
  EXPECT_EQ(error.subject(), "IMG_111");
  EXPECT_THAT(error.message(), testing::HasSubstr("by at least 1 of 16 views; where it is fewest, by IMG_111:"));
  options.region.reset();
  error = test::expect_error([&] { carve(views, silhouettes, options, job); });
  EXPECT_EQ(error.code(), ErrorCode::degenerate);
  EXPECT_EQ(error.subject(), "IMG_111");
  // Which view takes most away can be asked of any hull.
  silhouettes[11] = silhouettes[3];
  const Explanation why = explain(HullFunction(views, silhouettes), *at(8, Box{{-1, -1, -1}, {1, 1, 1}}).region, job);
  EXPECT_EQ(why.fewest_carvers, 0u);
}

TEST(Carve, ACameraInsideTheObjectIsAnError) {
  auto views = test::views_around(test::pinhole(100, 100, 120), 16, 4);
  auto silhouettes = test::silhouettes_of(test::sphere({0, 0, 0}, 0.8), views, {1, 8});
  views.push_back({test::pinhole(100, 100, 120), look_at({0.1, 0, 0}, {1, 0, 0}, {0, 0, 1})});
  Image full(100, 100, 1);
  std::fill_n(full.row<std::uint8_t>(0), 10000, std::uint8_t(255));
  silhouettes.push_back(Silhouette::from_mask(full, views.back().camera));
  Job job;
  const Error error = test::expect_error([&] { carve(views, silhouettes, at(40), job); });
  EXPECT_EQ(error.code(), ErrorCode::degenerate);
  EXPECT_EQ(error.subject(), "view 16");
  EXPECT_THAT(error.message(), testing::HasSubstr("inside the object"));
}

TEST(Carve, CanBeCancelled) {
  const auto views = test::views_around(test::pinhole(60, 60, 70), 6, 4);
  const auto silhouettes = test::silhouettes_of(test::sphere({0, 0, 0}, 0.8), views);
  Job job;
  job.cancel();
  EXPECT_EQ(test::expect_error([&] { carve(views, silhouettes, at(40), job); }).code(), ErrorCode::cancelled);
}

TEST(Region, IsFoundForEveryKindOfCapture) {
  const auto object = test::either({test::sphere({0, 0, 0}, 0.5), test::box({0.5, 0.2, 0.3}, {0.4, 0.1, 0.05})});
  const Box truth{{-0.5, -0.5, -0.5}, {0.9, 0.5, 0.5}};
  const auto check = [&](const std::vector<View>& views, double slack) {
    const auto silhouettes = test::silhouettes_of(object, views);
    Job job;
    const Box box = find_region(views, silhouettes, {}, {}, job);
    EXPECT_TRUE(((box.min - truth.min).array() < 0.01).all()) << box.min.transpose();
    EXPECT_TRUE(((truth.max - box.max).array() < 0.01).all()) << box.max.transpose();
    EXPECT_TRUE(((truth.min - box.min).array() < slack).all()) << box.min.transpose();
    EXPECT_TRUE(((box.max - truth.max).array() < slack).all()) << box.max.transpose();
  };
  {
    SCOPED_TRACE("all around");
    check(test::views_around(test::pinhole(120, 120, 200), 20, 4), 0.3);
  }
  {
    SCOPED_TRACE("hemisphere, object partly outside many pictures");
    check(test::views_around(test::pinhole(100, 100, 230), 60, 4, true), 0.6);
  }
  {
    SCOPED_TRACE("turntable");
    std::vector<View> ring;
    for (int i = 0; i < 18; ++i)
      ring.push_back({test::pinhole(120, 120, 200),
                      look_at({4 * std::cos(i * 0.349), 4 * std::sin(i * 0.349), 1.2}, {0, 0, 0}, {0, 0, 1})});
    check(ring, 0.5);
  }
  {
    SCOPED_TRACE("far away");
    check(test::views_around(test::pinhole(120, 120, 50000), 20, 1000), 0.3);
  }
}

TEST(Region, IsFoundForFewPhotographs) {
  // Each photograph's cone leaves the other pictures somewhere, and nothing carves it there.
  const auto all = test::views_around(test::pinhole(60, 60, 75), 60, 4);
  const auto object = test::sphere({0, 0, 0}, 0.8);
  for (const auto& chosen : std::vector<std::vector<std::size_t>>{{7, 30}, {7, 27, 47}, {3, 20, 37, 54}}) {
    SCOPED_TRACE(chosen.size());
    std::vector<View> views;
    for (const std::size_t i : chosen) views.push_back(all[i]);
    Job job;
    const Box box = find_region(views, test::silhouettes_of(object, views), {}, {}, job);
    EXPECT_LT(box.min.maxCoeff(), -0.8);
    EXPECT_GT(box.max.minCoeff(), 0.8);
    EXPECT_LT(box.size().maxCoeff(), 6);
  }
  // Two from above whose cones go on together for ever, and one from the side that ends them in its picture only.
  std::vector<View> views;
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0.3, 0, 4), {-0.3, 0, 4}, {0, 4, 0.2}})
    views.push_back({test::pinhole(60, 60, 75), look_at(eye, {0, 0, 0}, {0.1, 1, 1})});
  Job job;
  const Box box = find_region(views, test::silhouettes_of(object, views), {}, {}, job);
  EXPECT_LT(box.size().maxCoeff(), 6);
  EXPECT_LT(box.min.maxCoeff(), -0.8);
  EXPECT_GT(box.max.minCoeff(), 0.8);
}

TEST(Region, IsFoundWhereMostMasksAreEmpty) {
  const auto views = test::views_around(test::pinhole(60, 60, 75), 60, 4);
  const auto object = test::sphere({0, 0, 0}, 0.8);
  const auto load = [&](std::size_t i) { return i % 20 == 7 ? test::mask_of(object, views[i]) : Image(60, 60, 1); };
  Job job;
  const auto silhouettes = make_silhouettes(views, load, std::nullopt, 32, {}, {}, job);
  std::size_t used = 0;
  for (const Silhouette& s : silhouettes) used += !s.is_empty();
  EXPECT_EQ(used, 3u);
  const auto nothing = [](std::size_t) { return Image(60, 60, 1); };
  EXPECT_THAT(test::expect_error([&] { make_silhouettes(views, nothing, std::nullopt, 32, {}, {}, job); }).message(),
              testing::HasSubstr("0 of 60 masks"));
}

TEST(Region, ViewsAlongOneLineHaveNone) {
  std::vector<View> views(3, {test::pinhole(60, 60, 70), look_at({0, 0, -4}, {0, 0, 0}, {0, 1, 0})});
  const auto silhouettes = test::silhouettes_of(test::sphere({0, 0, 0}, 0.5), views);
  Job job;
  EXPECT_EQ(test::expect_error([&] { find_region(views, silhouettes, {}, {}, job); }).code(), ErrorCode::degenerate);
}

TEST(Simplify, StaysClosedAndReportsHowFarItMoved) {
  const auto views = test::views_around(test::pinhole(120, 120, 142), 30, 4);
  Job job;
  const CarveResult ring = carve(views, test::silhouettes_of(test::torus(0.8, 0.25), views, {1, 10}), at(64), job);
  const SimplifyResult simple = simplify(ring.mesh, {2000, 0}, job);
  EXPECT_TRUE(simple.reached);
  EXPECT_LE(simple.mesh.triangles.size(), 2000u);
  EXPECT_GT(simple.mesh.triangles.size(), 1500u);
  const MeshCheck check = check_mesh(simple.mesh);
  EXPECT_TRUE(check.good());
  EXPECT_EQ(check.euler, 0);
  EXPECT_GT(simple.moved.max, 0);
  EXPECT_LT(simple.moved.max, ring.grid.voxel);
  EXPECT_LE(simple.moved.rms, simple.moved.max);
  const SimplifyResult bounded = simplify(ring.mesh, {0, 0.2 * ring.grid.voxel}, job);
  EXPECT_LT(bounded.mesh.triangles.size(), ring.mesh.triangles.size() / 2);
  EXPECT_LT(bounded.moved.max, ring.grid.voxel);
  EXPECT_EQ(test::expect_error([&] { simplify(ring.mesh, {}, job); }).code(), ErrorCode::invalid_argument);
}

TEST(Simplify, ReducesToAFiftiethWithoutAPinch) {
  const auto views = test::views_around(test::pinhole(240, 240, 284), 30, 4);
  Job job;
  const CarveResult ring = carve(views, test::silhouettes_of(test::torus(0.8, 0.25), views, {1, 10}), at(128), job);
  const SimplifyResult simple = simplify(ring.mesh, {ring.mesh.triangles.size() / 50, 0}, job);
  EXPECT_TRUE(simple.reached);
  EXPECT_TRUE(check_mesh(simple.mesh).good());
  EXPECT_EQ(check_mesh(simple.mesh).euler, 0);
  EXPECT_LT(simple.moved.rms, ring.grid.voxel);
}

TEST(Simplify, RefusesWhatIsNoManifold) {
  Mesh fin{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}}, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
  Job job;
  const Error e = test::expect_error([&] { simplify(fin, {2, 0}, job); });
  EXPECT_EQ(e.code(), ErrorCode::bad_input);
  EXPECT_THAT(e.message(), testing::HasSubstr("closed"));
}

}  // namespace
}  // namespace lumihull
