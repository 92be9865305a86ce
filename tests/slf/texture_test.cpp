#include <lumihull/slf/glb.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/renderer.h>
#include <lumihull/slf/textured_mesh.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <map>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

using test::around;
using test::camera;

std::vector<View> eight_by_three(int size = 120) { return around(8, 3, 4, camera(size, size, size)); }

slf::TextureOptions no_trace() {
  slf::TextureOptions options;
  options.edge_alpha = test::kNoTrace;
  return options;
}

double quality(const slf::TexturedMesh& textured, const test::Paint& paint, const View& view) {
  const hull::RayScene scene(textured.mesh);
  Job job;
  const slf::Rendering r = slf::render_texture(textured, scene, view, {3, false}, job);
  const slf::Photo truth = test::photograph(textured.mesh, paint, view);
  return slf::psnr(slf::composited(r.rgba, {0, 0, 0}), slf::composited(truth.rgb, truth.alpha, {0, 0, 0}));
}

TEST(MeanTexture, ShowsThePaintFromNewViews) {
  const hull::Mesh mesh = test::sphere(40);
  Job job;
  slf::TextureReport report;
  const slf::TexturedMesh textured =
      slf::mean_texture(mesh, test::photographs(mesh, test::bands(), eight_by_three()), {}, job, &report);
  const View view{camera(200, 200, 200), look_at({2.6, 1.9, 1}, {0, 0, 0}, {0, 0, 1})};
  EXPECT_GT(quality(textured, test::bands(), view), 35);
  EXPECT_LT(report.filled_share, 0.01);
  EXPECT_LT(report.charts, 100u);
  // 0.7 pixels at the nearest point of the sphere, f = 120, distance 3; the median is seen from a little farther.
  EXPECT_NEAR(report.texel_size, 0.7 * 3 / 120, 0.004);
}

TEST(MeanTexture, WorksThroughADistortingLens) {
  const hull::Mesh mesh = test::sphere(40);
  Camera bent = camera(120, 120, 120);
  bent.k1 = 0.15, bent.k2 = -0.02, bent.p1 = 0.004, bent.p2 = -0.003, bent.skew = 2, bent.s = 1.1;
  Job job;
  const slf::TexturedMesh textured =
      slf::mean_texture(mesh, test::photographs(mesh, test::bands(), around(8, 3, 4, bent)), {}, job);
  const View view{bent, look_at({2.6, 1.9, 1}, {0, 0, 0}, {0, 0, 1})};
  EXPECT_GT(quality(textured, test::bands(), view), 35);
}

TEST(MeanTexture, APlainObjectIsPlainEverywhere) {
  // A box on a sphere, and a second box that hides inside the first one's shadow: seams, thin charts, places unseen.
  const hull::Mesh mesh = test::merged(test::sphere(24), test::box({-0.2f, -0.2f, 0.8f}, {0.2f, 0.2f, 1.6f}));
  Job job;
  slf::TexturedMesh textured =
      slf::mean_texture(mesh, test::photographs(mesh, test::plain(200, 90, 30), eight_by_three()), no_trace(), job);
  const hull::RayScene scene(mesh);
  for (const View& view : around(3, 3, 3.1, camera(200, 200, 180)))
    EXPECT_LE(test::largest_difference(slf::render_texture(textured, scene, view, {}, job).rgba, {200, 90, 30}), 1);
  for (std::size_t i = 0; i < textured.texture.bytes(); i += 3)  // between the charts, too
    ASSERT_NEAR(int(textured.texture.data()[i]), 200, 1);
}

TEST(MeanTexture, AnOccludersColourDoesNotLeak) {
  const hull::Mesh mesh =
      test::merged(test::box({-1, -1, -1}, {1, 1, 1}), test::box({-0.5f, 1.5f, -0.5f}, {0.5f, 1.6f, 0.5f}));
  const auto paint = [](const Eigen::Vector3f& p) {
    return p.y() > 1.25f ? Eigen::Vector3f(220, 20, 20) : Eigen::Vector3f(20, 40, 220);
  };
  std::vector<View> views;
  for (int i = -4; i <= 4; ++i)
    views.push_back({camera(160, 160, 150), look_at({1.2 * i, 6, 0.3}, {0, 0, 0}, {0, 0, 1})});
  Job job;
  const slf::TexturedMesh textured = slf::mean_texture(mesh, test::photographs(mesh, paint, views), {}, job);
  EXPECT_GT(quality(textured, paint, {camera(160, 160, 150), look_at({3.2, 4.2, 0.4}, {0, 0, 0}, {0, 0, 1})}), 27);
  // The face behind the plate: triangles 6 and 7 of the box are y = 1. No texel of it is red.
  int red = 0, sampled = 0;
  for (const std::size_t t : {6u, 7u})
    for (int i = 1; i < 40; ++i)
      for (int j = 1; j < 40 - i; ++j) {
        const auto& uv = textured.uv[t];
        const Eigen::Vector2f at = uv[0] + float(i) / 40 * (uv[1] - uv[0]) + float(j) / 40 * (uv[2] - uv[0]);
        const int x = int(at.x() * float(textured.texture.width())), y = int(at.y() * float(textured.texture.height()));
        red += textured.texture.row<std::uint8_t>(y)[3 * x] > 120;
        ++sampled;
      }
  EXPECT_LT(red, sampled / 50);
}

TEST(MeanTexture, PhotographsCountByTheSizeOfTheirPixels) {
  // A bright photograph from two units before a face, a dark one from four: four to one where both have one lens, one
  // to one where the farther one's is twice as long.
  const hull::Mesh mesh = test::box({-1, -1, -1}, {1, 1, 1});
  Job job;
  for (const double longer : {1.0, 2.0}) {
    SCOPED_TRACE(longer);
    const View near{camera(120, 120, 80), look_at({0, 3, 0}, {0, 0, 0}, {0, 0, 1})};
    const View far{camera(120, 120, 80 * longer), look_at({0, 5, 0}, {0, 0, 0}, {0, 0, 1})};
    slf::PhotoSet photos = test::photographs(mesh, test::plain(200, 200, 200), {near});
    photos.names.push_back("far");
    photos.views.push_back(far);
    photos.read = [read = photos.read, dark = test::photograph(mesh, test::plain(50, 50, 50), far)](std::size_t i) {
      return i == 0 ? read(0) : dark;
    };
    const slf::TexturedMesh textured = slf::mean_texture(mesh, photos, {}, job);
    const hull::RayScene scene(mesh);
    const Image picture = slf::render_texture(textured, scene, near, {}, job).rgba;
    EXPECT_NEAR(picture.row<std::uint8_t>(60)[4 * 60], longer == 1 ? (4 * 200 + 50) / 5 : 125, 2);
  }
}

TEST(MeanTexture, NoTexelShowsTwoPlaces) {
  // A paint of position alone: were a texel shared between two places, one of them would show the other's colour.
  const hull::Mesh mesh = test::merged(test::box({-1, -0.1f, -1}, {1, 0.1f, 1}), test::sphere(12));
  Job job;
  const slf::TexturedMesh textured =
      slf::mean_texture(mesh, test::photographs(mesh, test::plain(90, 90, 90), eight_by_three()), {}, job);
  std::map<std::pair<int, int>, Eigen::Vector3f> place;
  float farthest = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int i = 0; i <= 30; ++i)
      for (int j = 0; j <= 30 - i; ++j) {
        const float b1 = float(i) / 30, b2 = float(j) / 30;
        const auto& uv = textured.uv[t];
        const Eigen::Vector2f at = uv[0] + b1 * (uv[1] - uv[0]) + b2 * (uv[2] - uv[0]);
        const std::pair key(int(at.x() * float(textured.texture.width())),
                            int(at.y() * float(textured.texture.height())));
        const auto& v = mesh.triangles[t];
        const Eigen::Vector3f here =
            (1 - b1 - b2) * mesh.vertices[v[0]] + b1 * mesh.vertices[v[1]] + b2 * mesh.vertices[v[2]];
        const auto [it, fresh] = place.try_emplace(key, here);
        if (!fresh) farthest = std::max(farthest, (it->second - here).norm());
      }
  EXPECT_LT(farthest, 0.1f);  // some texels of 0.02
}

TEST(MeanTexture, PlacesThatNobodySawAreFilledFromAround) {
  const hull::Mesh mesh = test::sphere(24);
  const std::vector<View> one = {{camera(100, 100, 100), look_at({0, 4, 0}, {0, 0, 0}, {0, 0, 1})}};
  Job job;
  slf::TextureReport report;
  const slf::TexturedMesh textured =
      slf::mean_texture(mesh, test::photographs(mesh, test::plain(120, 60, 180), one), no_trace(), job, &report);
  EXPECT_GT(report.filled_share, 0.4);
  EXPECT_LT(report.filled_share, 0.8);
  const hull::RayScene scene(mesh);
  const View back{camera(100, 100, 100), look_at({0, -4, 0}, {0, 0, 0}, {0, 0, 1})};
  EXPECT_LE(test::largest_difference(slf::render_texture(textured, scene, back, {}, job).rgba, {120, 60, 180}), 1);
}

TEST(MeanTexture, ThreadsDoNotChangeABit) {
  const hull::Mesh mesh = test::sphere(20);
  const slf::PhotoSet photos = test::photographs(mesh, test::bands(), eight_by_three(80));
  slf::TexturedMesh first;
  for (const unsigned threads : {1u, 2u, 5u}) {
    Job job({}, threads);
    slf::TexturedMesh textured = slf::mean_texture(mesh, photos, {}, job);
    if (first.uv.empty()) first = textured;
    ASSERT_EQ(first.texture.bytes(), textured.texture.bytes());
    EXPECT_EQ(std::memcmp(first.texture.data(), textured.texture.data(), first.texture.bytes()), 0) << threads;
    EXPECT_EQ(std::memcmp(first.uv.data(), textured.uv.data(), first.uv.size() * sizeof(first.uv[0])), 0) << threads;
  }
}

TEST(MeanTexture, EachPhotographIsReadOnceAndLetGo) {
  const hull::Mesh mesh = test::sphere(12);
  slf::PhotoSet photos = test::photographs(mesh, test::bands(), eight_by_three(60));
  std::atomic<int> reads = 0;
  photos.read = [read = photos.read, &reads](std::size_t i) {
    ++reads;
    return read(i);
  };
  Job job;
  slf::mean_texture(mesh, photos, {}, job);
  EXPECT_EQ(reads, int(photos.size()));
}

TEST(MeanTexture, StaysWithinItsSize) {
  const hull::Mesh mesh = test::sphere(30);
  const slf::PhotoSet photos = test::photographs(mesh, test::bands(), eight_by_three());
  slf::TextureOptions options;
  options.max_side = 128;
  Job job;
  const slf::TexturedMesh textured = slf::mean_texture(mesh, photos, options, job);
  EXPECT_LE(textured.texture.width(), 128);
  EXPECT_LE(textured.texture.height(), 128);
  // A photograph that resolves ten thousand times more than fits: memory follows the texture, not the photograph.
  const View close{camera(24, 24, 4e5), look_at({0, 4, 0}, {0, 0, 0}, {0, 0, 1})};
  const slf::TexturedMesh enlarged =
      slf::mean_texture(mesh, test::photographs(mesh, test::plain(9, 9, 9), {close}), options, job);
  EXPECT_LE(enlarged.texture.width(), 128);
  EXPECT_LE(enlarged.texture.height(), 128);
  EXPECT_GT(enlarged.texture.width() * enlarged.texture.height(), 128 * 128 / 3);
  // Too many pieces for it: 2,000 loose triangles need four texels each, at least.
  hull::Mesh pieces;
  for (int i = 0; i < 2000; ++i) {
    const float x = float(i % 10), y = float(i / 10 % 10), z = float(i / 100);
    const auto at = std::uint32_t(pieces.vertices.size());
    pieces.vertices.insert(pieces.vertices.end(), {{x, y, z}, {x + 0.5f, y, z}, {x, y + 0.5f, z}});
    pieces.triangles.push_back({at, at + 1, at + 2});
  }
  options.max_side = 64;
  EXPECT_EQ(test::expect_error([&] { slf::mean_texture(pieces, photos, options, job); }).code(),
            ErrorCode::invalid_argument);
}

TEST(MeanTexture, DegenerateTrianglesDoNoHarm) {
  hull::Mesh mesh = test::sphere(12);
  mesh.triangles.push_back({5, 5, 5});
  mesh.triangles.push_back({5, 6, 5});
  Job job;
  const slf::TexturedMesh textured = slf::mean_texture(
      mesh, test::photographs(test::sphere(12), test::plain(50, 60, 70), eight_by_three(60)), {}, job);
  EXPECT_NO_THROW(slf::validate(textured, "mesh"));
  hull::Mesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {{0, 1, 2}};
  EXPECT_NO_THROW(slf::mean_texture(flat, test::photographs(mesh, test::plain(1, 2, 3), eight_by_three(40)), {}, job));
}

TEST(MeanTexture, Faults) {
  const hull::Mesh mesh = test::sphere(6);
  const slf::PhotoSet photos = test::photographs(mesh, test::plain(1, 2, 3), eight_by_three(40));
  Job job;
  slf::PhotoSet none;
  none.read = photos.read;
  EXPECT_EQ(test::expect_error([&] { slf::mean_texture(mesh, none, {}, job); }).code(), ErrorCode::degenerate);
  EXPECT_EQ(test::expect_error([&] { slf::mean_texture({}, photos, {}, job); }).code(), ErrorCode::degenerate);
  hull::Mesh broken = mesh;
  broken.triangles[3][1] = 1u << 30;
  EXPECT_EQ(test::expect_error([&] { slf::mean_texture(broken, photos, {}, job); }).code(), ErrorCode::bad_input);
  slf::TextureOptions options;
  options.texel_px = std::nan("");
  EXPECT_EQ(test::expect_error([&] { slf::mean_texture(mesh, photos, options, job); }).code(),
            ErrorCode::invalid_argument);
  slf::PhotoSet unreadable = photos;
  unreadable.read = [](std::size_t) -> slf::Photo { throw Error(ErrorCode::io, "it went away", "photo"); };
  EXPECT_EQ(test::expect_error([&] { slf::mean_texture(mesh, unreadable, {}, job); }).code(), ErrorCode::io);
}

TEST(RenderShaded, IsBrightestWhereTheSurfaceFacesTheCamera) {
  const hull::Mesh mesh = test::sphere(40);
  const hull::RayScene scene(mesh);
  Job job;
  const View view{camera(100, 100, 150), look_at({0, 4, 0}, {0, 0, 0}, {0, 0, 1})};
  const Image picture = slf::render_shaded(mesh, scene, view, {}, job).rgba;
  EXPECT_NEAR(picture.row<std::uint8_t>(50)[4 * 50], 217, 3);
  EXPECT_LT(picture.row<std::uint8_t>(50)[4 * 84], 150);
  EXPECT_EQ(picture.row<std::uint8_t>(2)[4 * 2 + 3], 0);
}

}  // namespace
}  // namespace lumihull
