#include <lumihull/slf/lumigraph.h>
#include <lumihull/slf/metrics.h>

#include <algorithm>
#include <cstring>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

using test::around;
using test::camera;

slf::LumigraphOptions no_trace() {
  slf::LumigraphOptions options;
  options.edge_alpha = test::kNoTrace;
  return options;
}

TEST(Lumigraph, AViewFromAPhotographsPlaceIsThatPhotograph) {
  const hull::Mesh mesh = test::sphere(40);
  const hull::RayScene scene(mesh);
  const slf::PhotoSet photos = test::photographs(mesh, test::bands(), around(10, 3, 4, camera(160, 120, 170)));
  slf::Lumigraph lumigraph(mesh, scene, photos);
  Job job;
  for (const std::size_t i : {0u, 13u, 29u}) {
    SCOPED_TRACE(i);
    const slf::Photo photo = photos.read(i);
    const slf::Rendering r = lumigraph.render(photos.views[i], {3, false}, job);
    Image solid = photo.alpha;  // the rim takes its colours from elsewhere
    for (int y = 3; y < solid.height() - 3; ++y)
      for (int x = 3; x < solid.width() - 3; ++x)
        for (int k = 0; k < 49; ++k)
          if (photo.alpha.row<std::uint8_t>(y + k / 7 - 3)[x + k % 7 - 3] < 255) solid.row<std::uint8_t>(y)[x] = 0;
    const Image picture = slf::composited(r.rgba, {0, 0, 0});
    EXPECT_GT(slf::psnr(picture, photo.rgb, &solid), 42);
    EXPECT_GT(slf::psnr(picture, slf::composited(photo.rgb, photo.alpha, {0, 0, 0})), 32);
  }
}

TEST(Lumigraph, ANewViewIsCloseToTheTruth) {
  const hull::Mesh mesh = test::sphere(40);
  const hull::RayScene scene(mesh);
  slf::Lumigraph lumigraph(mesh, scene,
                           test::photographs(mesh, test::bands(), around(10, 3, 4, camera(160, 120, 170))));
  const View view{camera(200, 160, 200), look_at({2.5, 2.2, 1.1}, {0, 0, 0}, {0, 0, 1})};
  Job job;
  const slf::Rendering r = lumigraph.render(view, {3, true}, job);
  const slf::Photo truth = test::photograph(mesh, test::bands(), view);
  EXPECT_GT(slf::psnr(slf::composited(r.rgba, {0, 0, 0}), slf::composited(truth.rgb, truth.alpha, {0, 0, 0})), 35);
  // The middle of the picture looks at the nearest point of the sphere.
  EXPECT_NEAR(r.depth.row<float>(80)[100], view.center().norm() - 1, 0.01);
  EXPECT_TRUE(std::isinf(r.depth.row<float>(0)[0]));
}

TEST(Lumigraph, APlainObjectIsPlainEverywhere) {
  const hull::Mesh mesh = test::merged(test::sphere(24), test::box({-0.2f, -0.2f, 0.8f}, {0.2f, 0.2f, 1.6f}));
  const hull::RayScene scene(mesh);
  Camera bent = camera(120, 120, 110);
  bent.k1 = 0.08, bent.p1 = 0.002;
  slf::Lumigraph lumigraph(mesh, scene, test::photographs(mesh, test::plain(200, 90, 30), around(8, 3, 4, bent)),
                           no_trace());
  Job job;
  for (const View& view : around(3, 3, 3.1, bent))
    EXPECT_LE(test::largest_difference(lumigraph.render(view, {}, job).rgba, {200, 90, 30}), 1);
}

TEST(Lumigraph, AnOccludersColourDoesNotLeak) {
  // A red plate before a blue box: photographs taken from the front show the plate where the box's middle is.
  const hull::Mesh plate = test::box({-0.5f, 1.5f, -0.5f}, {0.5f, 1.6f, 0.5f});
  const hull::Mesh mesh = test::merged(test::box({-1, -1, -1}, {1, 1, 1}), plate);
  const auto paint = [](const Eigen::Vector3f& p) {
    return p.y() > 1.25f ? Eigen::Vector3f(220, 20, 20) : Eigen::Vector3f(20, 40, 220);
  };
  std::vector<View> views;
  for (int i = -4; i <= 4; ++i)
    views.push_back({camera(160, 160, 150), look_at({1.2 * i, 6, 0.3}, {0, 0, 0}, {0, 0, 1})});
  const hull::RayScene scene(mesh);
  slf::Lumigraph lumigraph(mesh, scene, test::photographs(mesh, paint, views));
  Job job;
  // From the side, between plate and box.
  const View view{camera(160, 160, 150), look_at({3.2, 4.2, 0.4}, {0, 0, 0}, {0, 0, 1})};
  const slf::Rendering r = lumigraph.render(view, {2, true}, job);
  const slf::Photo truth = test::photograph(mesh, paint, view);
  int inside = 0, wrong = 0;
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 160; ++x) {
      const std::uint8_t *p = r.rgba.row<std::uint8_t>(y) + 4 * x, *t = truth.rgb.row<std::uint8_t>(y) + 3 * x;
      if (truth.alpha.row<std::uint8_t>(y)[x] < 255 || (t[0] != 220 && t[2] != 220)) continue;
      ++inside;
      wrong += std::abs(p[0] - t[0]) > 60;
    }
  EXPECT_GT(inside, 1000);
  EXPECT_LT(wrong, inside / 100);  // the outline of the plate's shadow, where photographs mix both colours in a pixel
}

TEST(Lumigraph, ThreadsAndCacheDoNotChangeABit) {
  const hull::Mesh mesh = test::sphere(30);
  const hull::RayScene scene(mesh);
  const slf::PhotoSet photos = test::photographs(mesh, test::bands(), around(16, 3, 4, camera(96, 80, 90)));
  const View view{camera(150, 110, 140), look_at({2, -3, 0.5}, {0, 0, 0}, {0, 0, 1})};
  slf::Rendering first;
  for (const auto& [threads, cache] :
       {std::pair{1u, std::size_t(1) << 30}, {2u, std::size_t(1) << 30}, {5u, std::size_t(0)}}) {
    Job job({}, threads);
    slf::LumigraphOptions options;
    options.cache_bytes = cache;
    slf::Lumigraph lumigraph(mesh, scene, photos, options);
    for (int again = 0; again < 2; ++again) {
      const slf::Rendering r = lumigraph.render(view, {2, true}, job);
      if (first.rgba.empty()) first = r;
      EXPECT_EQ(std::memcmp(first.rgba.data(), r.rgba.data(), r.rgba.bytes()), 0) << threads;
      EXPECT_EQ(std::memcmp(first.depth.data(), r.depth.data(), r.depth.bytes()), 0) << threads;
    }
  }
}

TEST(Lumigraph, CoverageIsTheShareOfTheRays) {
  const hull::Mesh mesh = test::box({-1, -1, -1}, {1, 1, 1});
  const hull::RayScene scene(mesh);
  // The camera looks along -y at the face y = 1 at depth 2; f = 10 px: the face is 10 px wide, from 5.25 to 15.25.
  View view{camera(20, 20, 10), look_at({0, 3, 0}, {0, 0, 0}, {0, 0, 1})};
  view.camera.u0 += 0.25;
  slf::Lumigraph lumigraph(mesh, scene, test::photographs(mesh, test::plain(9, 8, 7), {view}));
  Job job;
  const slf::Rendering r = lumigraph.render(view, {4, false}, job);
  const std::uint8_t* row = r.rgba.row<std::uint8_t>(10);
  EXPECT_EQ(row[4 * 4 + 3], 0);
  EXPECT_EQ(row[4 * 5 + 3], 191);  // 3 of 4 columns of rays
  EXPECT_EQ(row[4 * 10 + 3], 255);
  EXPECT_EQ(row[4 * 15 + 3], 64);
}

TEST(Lumigraph, WhatNoPhotographSawTakesTheColoursAround) {
  const hull::Mesh mesh = test::sphere(24);
  const hull::RayScene scene(mesh);
  const View front{camera(100, 100, 100), look_at({0, 4, 0}, {0, 0, 0}, {0, 0, 1})};
  slf::Lumigraph lumigraph(mesh, scene, test::photographs(mesh, test::plain(120, 60, 180), {front}), no_trace());
  Job job;
  const View side{camera(100, 100, 100), look_at({4, 0.5, 0}, {0, 0, 0}, {0, 0, 1})};
  EXPECT_LE(test::largest_difference(lumigraph.render(side, {}, job).rgba, {120, 60, 180}), 1);
}

TEST(Lumigraph, Faults) {
  const hull::Mesh mesh = test::sphere(6);
  const hull::RayScene scene(mesh);
  const View view{camera(40, 40, 40), look_at({0, 4, 0}, {0, 0, 0}, {0, 0, 1})};
  const slf::PhotoSet good = test::photographs(mesh, test::plain(1, 2, 3), {view});
  Job job;

  EXPECT_EQ(test::expect_error([&] {
              slf::PhotoSet none;
              none.read = good.read;
              slf::Lumigraph l(mesh, scene, none);
            }).code(),
            ErrorCode::degenerate);

  slf::PhotoSet lost = good;
  lost.views[0].cam_from_world.translation.x() = std::nan("");
  EXPECT_EQ(test::expect_error([&] { slf::Lumigraph l(mesh, scene, lost); }).subject(), "photo0");

  slf::PhotoSet other_size = good;
  other_size.views[0].camera.width = 41;
  slf::Lumigraph wrong(mesh, scene, other_size);
  const Error e = test::expect_error([&] { wrong.render(view, {}, job); });
  EXPECT_EQ(e.code(), ErrorCode::bad_input);
  EXPECT_EQ(e.subject(), "photo0");

  slf::LumigraphOptions options;
  options.photographs = 0;
  EXPECT_EQ(test::expect_error([&] { slf::Lumigraph l(mesh, scene, good, options); }).code(),
            ErrorCode::invalid_argument);
  slf::Lumigraph fine(mesh, scene, good);
  EXPECT_EQ(test::expect_error([&] { fine.render(view, {0, false}, job); }).code(), ErrorCode::invalid_argument);

  Job stopped;
  stopped.cancel();
  EXPECT_EQ(test::expect_error([&] { fine.render(view, {}, stopped); }).code(), ErrorCode::cancelled);
}

TEST(Lumigraph, AnEmptyMeshGivesAnEmptyPicture) {
  const hull::Mesh mesh;
  const hull::RayScene scene(mesh);
  const View view{camera(40, 30, 40), look_at({0, 4, 0}, {0, 0, 0}, {0, 0, 1})};
  slf::Lumigraph lumigraph(mesh, scene, test::photographs(test::sphere(6), test::plain(1, 2, 3), {view}));
  Job job;
  const slf::Rendering r = lumigraph.render(view, {}, job);
  for (std::size_t i = 0; i < r.rgba.bytes(); ++i) ASSERT_EQ(r.rgba.data()[i], std::byte{0});
}

}  // namespace
}  // namespace lumihull
