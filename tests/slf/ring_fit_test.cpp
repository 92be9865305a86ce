// Light Field Mapping: each vertex's ring factored by itself.

#include <lumihull/slf/light_field.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/metrics.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

using slf::Factorization;
using test::around;
using test::camera;

constexpr std::array<Factorization, 2> kRingMethods{Factorization::pca, Factorization::nmf};

hull::Mesh tetrahedron() {
  hull::Mesh mesh;
  mesh.vertices = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return mesh;
}

hull::Mesh torus(std::uint32_t around, std::uint32_t across) {
  hull::Mesh mesh;
  const auto at = [&](std::uint32_t i, std::uint32_t j) { return i % around * across + j % across; };
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double a = 2 * std::numbers::pi * i / around, b = 2 * std::numbers::pi * j / across;
      const double r = 1 + 0.4 * std::cos(b);
      mesh.vertices.push_back(Eigen::Vector3d(r * std::cos(a), r * std::sin(a), 0.4 * std::sin(b)).cast<float>());
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

hull::Mesh icosphere(int divisions) {
  const float g = std::numbers::phi_v<float>;
  hull::Mesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (auto& v : mesh.vertices) v.normalize();
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int d = 0; d < divisions; ++d) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] = middles.try_emplace(std::minmax(a, b), std::uint32_t(mesh.vertices.size()));
      if (fresh) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const auto& t : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) finer.push_back(t);
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

/// Colour of a place as seen from a direction.
using Gloss = std::function<Eigen::Vector3f(const Eigen::Vector3f& place, const Eigen::Vector3f& eye)>;

slf::PhotoSet photographs(const hull::Mesh& mesh, const Gloss& gloss, const std::vector<View>& views) {
  auto kept = std::make_shared<std::vector<slf::Photo>>();
  slf::PhotoSet set;
  for (const View& view : views) {
    const Eigen::Vector3f eye = view.center().cast<float>().normalized();
    set.names.push_back("photo" + std::to_string(set.names.size()));
    kept->push_back(test::photograph(
        mesh, [&](const Eigen::Vector3f& p) { return gloss(p, eye); }, view));
  }
  set.views = views;
  set.read = [kept](std::size_t i) { return kept->at(i); };
  return set;
}

/// A colour and two products of a place's colour and a function of the direction.
Eigen::Vector3f two_products(const Eigen::Vector3f& p, const Eigen::Vector3f& eye) {
  const Eigen::Vector3f base(120, 110 + 20 * p.x(), 120 - 20 * p.z());
  const Eigen::Vector3f first(40, 30 * std::sin(3 * p.z()), 20), second(-10 * p.y(), 25, 30 * std::cos(2 * p.x()));
  return base + first * (eye.x() - 0.5f * eye.z()) + second * eye.y() * eye.z() * 2;
}

slf::LightFieldOptions options_for(Factorization method, int terms) {
  slf::LightFieldOptions options;
  options.method = method;
  options.terms = terms;
  options.edge_alpha = test::kNoTrace;
  return options;
}

/// Mean over the photographs themselves, of the pixels that hold no background.
double training_quality(const slf::LightField& field, int terms, const slf::PhotoSet& photos) {
  const slf::LightFieldRenderer renderer(field, terms);
  Job job;
  double sum = 0;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    slf::Photo truth = photos.read(i);
    std::uint8_t* alpha = truth.alpha.row<std::uint8_t>(0);
    std::transform(alpha, alpha + truth.alpha.bytes(), alpha, [](std::uint8_t a) { return a == 255 ? a : 0; });
    const Image shown = slf::composited(renderer.render(photos.views[i], {3, false}, job).rgba, {0, 0, 0});
    sum += slf::psnr(shown, slf::composited(truth.rgb, truth.alpha, {0, 0, 0}), &truth.alpha);
  }
  return sum / double(photos.size());
}

TEST(RingFit, NoTriangleHasTwoCornersOfOneSlot) {
  for (const auto& [mesh, most] : {std::pair{tetrahedron(), 4}, {torus(12, 8), 7}, {icosphere(2), 6}}) {
    SCOPED_TRACE(mesh.vertices.size());
    Job job;
    const slf::LightField field =
        slf::fit_light_field(mesh, test::photographs(mesh, test::bands(), around(4, 2, 4, camera(40, 40, 40))),
                             options_for(Factorization::pca, 1), job);
    ASSERT_EQ(field.slot.size(), mesh.vertices.size());
    for (const auto& [a, b, c] : mesh.triangles) {
      EXPECT_NE(field.slot[a], field.slot[b]);
      EXPECT_NE(field.slot[b], field.slot[c]);
      EXPECT_NE(field.slot[c], field.slot[a]);
    }
    EXPECT_LT(*std::max_element(field.slot.begin(), field.slot.end()), most);
    EXPECT_NO_THROW(slf::validate(field, "field"));
  }
}

TEST(RingFit, AMeshOfTooManyNeighboursIsRefused) {
  hull::Mesh mesh = test::sphere(4);  // 26 vertices, each a neighbour of all
  for (std::uint32_t a = 0; a < mesh.vertices.size(); ++a)
    for (std::uint32_t b = a + 1; b < mesh.vertices.size(); ++b)
      mesh.triangles.push_back({a, b, (b + 1) % std::uint32_t(mesh.vertices.size())});
  const slf::PhotoSet photos = test::photographs(mesh, test::bands(), around(4, 1, 4, camera(20, 20, 20)));
  for (const Factorization method : kRingMethods) {
    const Error error = test::expect_error([&] {
      Job job;
      slf::fit_light_field(mesh, photos, options_for(method, 1), job);
    });
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_THAT(error.message(), testing::HasSubstr("16"));
  }
}

TEST(RingFit, PrincipalComponentsReproduceAnAppearanceOfTheirRank) {
  const hull::Mesh mesh = icosphere(2);
  const slf::PhotoSet photos = photographs(mesh, two_products, around(8, 3, 4, camera(120, 120, 120)));
  Job job;
  slf::LightFieldReport report;
  const slf::LightField field = slf::fit_light_field(mesh, photos, options_for(Factorization::pca, 4), job, &report);
  std::vector<double> quality;
  for (int terms = 0; terms <= 4; ++terms) quality.push_back(training_quality(field, terms, photos));
  for (std::size_t k = 1; k < quality.size(); ++k) EXPECT_GE(quality[k], quality[k - 1] - 0.02) << k;
  EXPECT_GT(quality[2], quality[0] + 10);
  EXPECT_GT(quality[4], 40);
  EXPECT_LT(report.rms, 0.3 * report.rms_of_mean);
}

TEST(RingFit, NonNegativeFactorsAreAndShowMoreThanTheMean) {
  const hull::Mesh mesh = icosphere(2);
  const slf::PhotoSet photos = photographs(mesh, two_products, around(8, 3, 4, camera(120, 120, 120)));
  Job job;
  const double mean =
      training_quality(slf::fit_light_field(mesh, photos, options_for(Factorization::nmf, 0), job), 0, photos);
  double before = mean;
  for (const int terms : {1, 3}) {
    const slf::LightField field = slf::fit_light_field(mesh, photos, options_for(Factorization::nmf, terms), job);
    EXPECT_FALSE(field.adds_base);
    ASSERT_EQ(field.terms.size(), std::size_t(terms));
    for (const slf::LightFieldTerm& term : field.terms)
      for (const slf::ByteScale& s : {term.surface_scale, term.view_scale}) {
        EXPECT_GE(s.offset, 0);
        EXPECT_GT(s.scale, 0);
      }
    const double quality = training_quality(field, terms, photos);
    EXPECT_GT(quality, before + 1) << terms;
    before = quality;
  }
  EXPECT_GT(before, mean + 6);
}

TEST(RingFit, TheSameBytesForAnyNumberOfThreads) {
  const hull::Mesh mesh = icosphere(2);
  const slf::PhotoSet photos = photographs(mesh, two_products, around(5, 2, 4, camera(80, 80, 80)));
  for (const Factorization method : kRingMethods) {
    Job one({}, 1), five({}, 5);
    const slf::LightField a = slf::fit_light_field(mesh, photos, options_for(method, 3), one),
                          b = slf::fit_light_field(mesh, photos, options_for(method, 3), five);
    EXPECT_EQ(a.slot, b.slot);
    ASSERT_EQ(a.terms.size(), b.terms.size());
    for (std::size_t k = 0; k < a.terms.size(); ++k) {
      EXPECT_EQ(a.terms[k].view, b.terms[k].view);
      ASSERT_EQ(a.terms[k].surface.size(), b.terms[k].surface.size());
      for (std::size_t s = 0; s < a.terms[k].surface.size(); ++s) {
        const Image &p = a.terms[k].surface[s], &q = b.terms[k].surface[s];
        ASSERT_EQ(p.bytes(), q.bytes());
        EXPECT_EQ(std::memcmp(p.data(), q.data(), p.bytes()), 0);
      }
    }
  }
}

TEST(RingFit, APlainObjectIsPlainEverywhere) {
  // Seams, thin charts, places that nobody saw; a triangle that is none.
  hull::Mesh mesh = test::merged(test::sphere(12), test::box({-0.2f, -0.2f, 0.8f}, {0.2f, 0.2f, 1.6f}));
  mesh.triangles.push_back({3, 3, 7});
  const slf::PhotoSet photos =
      test::photographs(mesh, test::plain(200, 90, 30), around(8, 3, 4, camera(120, 120, 120)));
  for (const auto& [method, terms] : {std::pair{Factorization::joint, 3},
                                      {Factorization::pca, 3},
                                      {Factorization::nmf, 1},
                                      {Factorization::nmf, 3}}) {
    SCOPED_TRACE(int(method));
    SCOPED_TRACE(terms);
    Job job;
    // As the defaults have it: rims of the photographs hold green, and the file's JPEGs round.
    slf::LightFieldOptions options;
    options.method = method, options.terms = terms;
    const slf::LightField field = slf::fit_light_field(mesh, photos, options, job);
    const slf::LightFieldRenderer renderer(field),
        read_back(slf::decode_light_field(slf::encode_light_field(field), "plain"));
    for (const View& view : around(3, 3, 3.1, camera(200, 200, 180))) {
      EXPECT_LE(test::largest_difference(renderer.render(view, {}, job).rgba, {200, 90, 30}), 1);
      EXPECT_LE(test::largest_difference(read_back.render(view, {}, job).rgba, {200, 90, 30}), 1);
    }
  }
}

TEST(RingFit, WhatNobodySawHasTheMeanColour) {
  const hull::Mesh mesh = test::sphere(16);
  std::vector<View> front;
  for (const View& view : around(12, 3, 4, camera(100, 100, 100)))
    if (view.center().x() > 1) front.push_back(view);
  const View behind{camera(100, 100, 100), look_at({-4, 0.3, 0.2}, {0, 0, 0}, {0, 0, 1})};
  for (const Factorization method : kRingMethods) {
    Job job;
    const slf::LightFieldRenderer renderer(slf::fit_light_field(
        mesh, test::photographs(mesh, test::plain(60, 150, 210), front), options_for(method, 2), job));
    EXPECT_LE(test::largest_difference(renderer.render(behind, {}, job).rgba, {60, 150, 210}), 1);
  }
}

}  // namespace
}  // namespace lumihull
