#include <lumihull/calib/despill.h>
#include <lumihull/slf/light_field.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/textured_mesh.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "fit/mirror.h"
#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

/// Colour of a place as an eye sees it.
using ViewPaint = std::function<Eigen::Vector3f(const Eigen::Vector3f& place, const Eigen::Vector3f& eye)>;

slf::PhotoSet photographs_of(const hull::Mesh& mesh, const ViewPaint& paint, const std::vector<View>& views) {
  const auto kept = std::make_shared<std::vector<slf::Photo>>();
  slf::PhotoSet photos;
  for (const View& view : views) {
    const Eigen::Vector3f eye = view.center().cast<float>();
    kept->push_back(test::photograph(
        mesh, [&](const Eigen::Vector3f& p) { return paint(p, eye); }, view));
    photos.names.push_back("photo" + std::to_string(photos.names.size()));
    photos.views.push_back(view);
  }
  photos.read = [kept](std::size_t i) { return kept->at(i); };
  return photos;
}

/// A ball of bands with a broad white gloss from one lamp.
ViewPaint glossy(float exponent = 5) {
  return [bands = test::bands(), exponent](const Eigen::Vector3f& p, const Eigen::Vector3f& eye) -> Eigen::Vector3f {
    const Eigen::Vector3f n = p.normalized(), v = (eye - p).normalized();
    const Eigen::Vector3f mirrored = 2 * n.dot(v) * n - v;
    const float c = std::max(0.0f, mirrored.dot(Eigen::Vector3f(1, 0.5f, 0.8f).normalized()));
    return 0.7f * bands(p) + Eigen::Vector3f::Constant(70 * std::pow(c, exponent));
  };
}

/// Factors of known rank: two patterns on the surface times two smooth functions of the eye's direction.
ViewPaint rank_two() {
  return [](const Eigen::Vector3f& p, const Eigen::Vector3f& eye) -> Eigen::Vector3f {
    const Eigen::Vector3f d = eye.normalized();
    const Eigen::Vector3f first(0.2f + 0.2f * p.x(), 0.1f, 0.2f * p.y()), second(0.05f, 0.1f * p.z(), 0.05f * p.x());
    return 255 * (Eigen::Vector3f(0.5f, 0.45f, 0.4f) + 0.9f * d.x() * first + 0.9f * d.y() * second);
  };
}

/// Pixels well inside of the object: at its rim photographs hold some green.
Image inner(const Image& alpha) {
  Image out(alpha.width(), alpha.height(), 1);
  for (int y = 2; y + 2 < alpha.height(); ++y)
    for (int x = 2; x + 2 < alpha.width(); ++x) {
      int least = 255;
      for (int j = -2; j <= 2; ++j)
        for (int i = -2; i <= 2; ++i) least = std::min<int>(least, alpha.row<std::uint8_t>(y + j)[x + i]);
      out.row<std::uint8_t>(y)[x] = least == 255 ? 255 : 0;
    }
  return out;
}

double mean_psnr(const slf::LightField& field, const slf::PhotoSet& photos, int terms = slf::kMaxTerms) {
  const slf::LightFieldRenderer renderer(field, terms);
  Job job;
  double sum = 0;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const slf::Photo photo = photos.read(i);
    const Image picture = slf::composited(renderer.render(photos.views[i], {.rays = 3}, job).rgba, {0, 0, 0});
    const Image inside = inner(photo.alpha);
    sum += slf::psnr(picture, slf::composited(photo.rgb, photo.alpha, {0, 0, 0}), &inside);
  }
  return sum / double(photos.size());
}

double mean_psnr(const slf::TexturedMesh& textured, const slf::PhotoSet& photos) {
  const hull::RayScene scene(textured.mesh);
  Job job;
  double sum = 0;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const slf::Photo photo = photos.read(i);
    const Image picture =
        slf::composited(slf::render_texture(textured, scene, photos.views[i], {.rays = 3}, job).rgba, {0, 0, 0});
    const Image inside = inner(photo.alpha);
    sum += slf::psnr(picture, slf::composited(photo.rgb, photo.alpha, {0, 0, 0}), &inside);
  }
  return sum / double(photos.size());
}

std::vector<View> training_views() { return test::around(16, 5, 4, test::camera(120, 100, 110)); }

/// Between the training views.
std::vector<View> new_views() {
  std::vector<View> views;
  for (int i = 0; i < 7; ++i) {
    const double a = 0.3 + 0.9 * i, z = 0.3 + 0.2 * (i % 3);
    const Eigen::Vector3d eye = 4 * Eigen::Vector3d(std::cos(a), std::sin(a), z).normalized();
    views.push_back({test::camera(120, 100, 110), look_at(eye, {0, 0, 0}, {0, 0, 1})});
  }
  return views;
}

TEST(LightField, ShowsGlossThatTheMeanColourCannot) {
  const hull::Mesh mesh = test::sphere(40);
  const slf::PhotoSet seen = photographs_of(mesh, glossy(), training_views());
  const slf::PhotoSet fresh = photographs_of(mesh, glossy(), new_views());
  Job job;
  slf::LightFieldReport report;
  const slf::LightField field =
      slf::fit_light_field(mesh, seen, {.terms = 4, .edge_alpha = test::kNoTrace}, job, &report);
  const slf::TexturedMesh mean = slf::mean_texture(mesh, seen, {.edge_alpha = test::kNoTrace}, job);
  EXPECT_GT(mean_psnr(field, fresh), mean_psnr(mean, fresh) + 3);
  EXPECT_GT(mean_psnr(field, seen), mean_psnr(mean, seen) + 6);
  EXPECT_LT(report.rms, 0.5 * report.rms_of_mean);
  EXPECT_LT(report.unseen_share, 0.2);
}

TEST(LightField, LosesNothingOnAMattObject) {
  const hull::Mesh mesh = test::sphere(40);
  const slf::PhotoSet seen = test::photographs(mesh, test::bands(), training_views());
  const slf::PhotoSet fresh = test::photographs(mesh, test::bands(), new_views());
  Job job;
  const slf::LightField field = slf::fit_light_field(mesh, seen, {}, job);
  // Beyond 50 dB it is the bytes' rounding that differs.
  EXPECT_GT(mean_psnr(field, fresh), std::min(50.0, mean_psnr(slf::mean_texture(mesh, seen, {}, job), fresh) - 0.05));
}

TEST(LightField, LeavesOutTermsThatWouldOnlyHoldNoise) {
  const hull::Mesh mesh = test::sphere(40);
  const std::vector<View> few = test::around(12, 3, 4, test::camera(120, 100, 110));
  const slf::PhotoSet fresh = test::photographs(mesh, test::bands(), new_views());
  const slf::PhotoSet seen = test::photographs(mesh, test::bands(), few);
  Job job;
  slf::LightFieldReport report;
  const slf::LightField field = slf::fit_light_field(mesh, seen, {}, job, &report);
  EXPECT_LE(field.terms.size(), 1u);
  EXPECT_GT(report.rms, 0.5 * report.rms_of_mean);  // what is dropped explains nothing
  EXPECT_GT(mean_psnr(field, fresh), std::min(50.0, mean_psnr(slf::mean_texture(mesh, seen, {}, job), fresh) - 0.05));
  // ... and no others.
  EXPECT_GE(slf::fit_light_field(mesh, photographs_of(mesh, glossy(), few), {.terms = 3}, job).terms.size(), 3u);
}

/// Photographs as a camera takes them whose exposure and white balance change, in linear light.
slf::PhotoSet exposed(slf::PhotoSet photos, const std::vector<Eigen::Vector3f>& gains) {
  photos.read = [read = photos.read, gains](std::size_t i) {
    slf::Photo photo = read(i);
    for (int y = 0; y < photo.rgb.height(); ++y)
      for (int x = 0; x < 3 * photo.rgb.width(); ++x) {
        std::uint8_t& byte = photo.rgb.row<std::uint8_t>(y)[x];
        const float light = linear_from_srgb(float(byte) / 255) * gains[i][x % 3];
        byte = std::uint8_t(std::lround(255 * srgb_from_linear(std::min(1.0f, light))));
      }
    return photo;
  };
  return photos;
}

TEST(LightField, MirrorsWhatAllPlacesMirrorAlike) {
  // A highlight narrower than the photographs' spacing: between two of them it is where neither has it.
  const hull::Mesh ball = test::sphere(24);
  const auto training = photographs_of(ball, glossy(40), test::around(8, 3, 4, test::camera(160, 120, 200)));
  std::vector<View> between;
  for (int i = 0; i < 48; i += 5)
    between.push_back(test::around(16, 3, 4, test::camera(160, 120, 200))[std::size_t(i)]);
  const auto others = photographs_of(ball, glossy(40), between);
  slf::LightFieldOptions options;
  options.edge_alpha = test::kNoTrace;
  options.terms = 2, options.iterations = 3, options.texel_px = 1;
  Job job;
  slf::LightFieldReport report;
  const slf::LightField with = slf::fit_light_field(ball, training, options, job, &report);
  options.reflections = false;
  const slf::LightField without = slf::fit_light_field(ball, training, options, job);
  ASSERT_TRUE(with.reflection);
  EXPECT_FALSE(without.reflection);
  EXPECT_GT(report.reflection_share, 0.5);
  EXPECT_GT(mean_psnr(with, others), mean_psnr(without, others) + 2)
      << mean_psnr(with, others) << " dB, without " << mean_psnr(without, others) << " dB";
  // The brightest direction is the lamp's.
  const slf::LightFieldReflection& r = *with.reflection;
  const slf::SphereGrid grid(r.light.width());
  const auto light = [&](const Eigen::Vector3f& d) {
    const slf::SphereGrid::Place at = grid.at(d);
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k)
      sum += double(at.weight[k]) * double(r.light.row<std::uint8_t>(0)[3 * at.node[k] + 1]);
    return sum;
  };
  const Eigen::Vector3f lamp = Eigen::Vector3f(1, 0.5f, 0.8f).normalized();
  const Eigen::Vector3f across = lamp.unitOrthogonal(), along = lamp.cross(across);
  for (const Eigen::Vector3f& side : {across, along})
    for (const float sign : {-1.0f, 1.0f}) EXPECT_GT(light(lamp), light((lamp + sign * 0.3f * side).normalized()) + 30);
}

TEST(LightField, LeavesOutReflectionsWhereThereAreNone) {
  const hull::Mesh ball = test::sphere(16);
  const auto photos = photographs_of(
      ball, [bands = test::bands()](const Eigen::Vector3f& p, const Eigen::Vector3f&) { return bands(p); },
      test::around(8, 2, 4, test::camera(120, 90, 150)));
  slf::LightFieldOptions options;
  options.edge_alpha = test::kNoTrace;
  Job job;
  for (const int terms : {0, 2}) {
    options.terms = terms;
    EXPECT_FALSE(slf::fit_light_field(ball, photos, options, job).reflection) << terms;
  }
}

TEST(LightField, NearLampsAndSeveralMaterialsAreMirrored) {
  // A lamp 3 from the middle of a ball of radius 1, of which one half mirrors a quarter as much as the other.
  const hull::Mesh ball = test::sphere(24);
  const Eigen::Vector3f lamp = 3 * Eigen::Vector3f(1, 0.3f, 0.8f).normalized();
  const auto paint = [bands = test::bands(), lamp](const Eigen::Vector3f& p, const Eigen::Vector3f& eye) {
    const Eigen::Vector3f r = slf::mirrored((eye - p).normalized(), p.normalized());
    const float c = std::max(0.0f, r.dot((lamp - p).normalized())), most = p.y() > 0 ? 0.4f : 0.1f;
    return Eigen::Vector3f((0.6f * bands(p) / 255).unaryExpr([&](float v) {
      return 255 * srgb_from_linear(std::min(1.0f, linear_from_srgb(v) + most * std::pow(c, 30.0f)));
    }));
  };
  slf::LightFieldOptions options;
  options.edge_alpha = test::kNoTrace;
  options.terms = 0, options.texel_px = 1;
  Job job;
  const auto photos = photographs_of(ball, paint, test::around(10, 4, 4, test::camera(160, 120, 200)));
  const auto field = slf::fit_light_field(ball, photos, options, job);
  ASSERT_TRUE(field.reflection);
  const slf::LightFieldReflection& r = *field.reflection;
  EXPECT_NEAR(r.inverse_radius, 1.0f / 3, 0.12f);
  double sum[2] = {0, 0}, count[2] = {0, 0};
  for (std::size_t v = 0; v < ball.vertices.size(); ++v) {
    const Eigen::Vector3f& p = ball.vertices[v];
    if (p.x() < 0.2f || std::abs(p.y()) < 0.2f) continue;  // the lamp's side
    sum[p.y() > 0] += double(r.strength[v]), ++count[p.y() > 0];
  }
  // In truth four times; places without a highlight in the photographs are drawn to 1.
  EXPECT_GT(sum[1] / count[1], 1.6 * sum[0] / count[0]);
}

TEST(Mirror, RaysMeetTheSphereAroundTheObject) {
  const Eigen::Vector3f point(0.5f, -1, 0.25f), ray = Eigen::Vector3f(1, 2, -2) / 3;
  EXPECT_EQ(slf::met({{7, 8, 9}, 0}, point, ray), ray);
  const slf::Surroundings around{{0.25f, 0, 0}, 0.2f};
  const Eigen::Vector3f there = around.center + 5 * slf::met(around, point, ray), way = there - point;
  EXPECT_NEAR((there - around.center).norm(), 5, 1e-5);
  EXPECT_GT(way.dot(ray), 0);
  EXPECT_LT(way.cross(ray).norm(), 1e-5);
}

TEST(SphereGrid, HasNoSeam) {
  const slf::SphereGrid grid(9);
  // Values that vary over the sphere, one a direction.
  std::vector<float> values(grid.size());
  for (std::uint32_t i = 0; i < values.size(); ++i) values[i] = float((grid.alias(i) * 7919) % 101);
  const auto at = [&](const Eigen::Vector3f& d) {
    const slf::SphereGrid::Place p = grid.at(d);
    float sum = 0, weight = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += p.weight[k] * values[p.node[k]], weight += p.weight[k];
    EXPECT_NEAR(weight, 1, 1e-6);
    return sum;
  };
  for (int i = 0; i < 2000; ++i) {
    const float z = -1 + float(i) / 1000, a = float(i) * 2.4f, r = std::sqrt(std::max(0.0f, 1 - z * z));
    const Eigen::Vector3f d(r * std::cos(a), r * std::sin(a), z);
    EXPECT_NEAR(at(d), at((d + 1e-5f * Eigen::Vector3f(0.6f, -0.8f, 0.3f)).normalized()), 0.05f) << d.transpose();
  }
  // Across the border, where a quarter of the lower half ends and the next begins.
  for (float t = 0; t < 1; t += 0.05f) EXPECT_NEAR(at({t, 1e-6f, t - 1}), at({t, -1e-6f, t - 1}), 0.01f) << t;
}

TEST(LightField, EvensOutExposureAndWhiteBalance) {
  const hull::Mesh mesh = test::sphere(40);
  const std::vector<View> views = test::around(10, 3, 4, test::camera(120, 100, 110));
  std::vector<Eigen::Vector3f> gains;
  Eigen::Vector3f product(1, 1, 1);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto a = float(i);
    gains.emplace_back(1 + 0.25f * std::sin(a), 1 + 0.2f * std::cos(2 * a), 1 + 0.3f * std::sin(3 * a));
    product = product.cwiseProduct(gains.back());
  }
  const Eigen::Vector3f mean = product.array().pow(1 / float(views.size()));
  for (const bool gloss : {false, true}) {
    const slf::PhotoSet even =
        gloss ? photographs_of(mesh, glossy(80), views) : test::photographs(mesh, test::bands(), views);
    Job job;
    slf::LightFieldReport plain, evened, untouched;
    slf::fit_light_field(mesh, exposed(even, gains), {.terms = 0, .edge_alpha = test::kNoTrace}, job, &plain);
    EXPECT_TRUE(plain.gains.empty());
    slf::fit_light_field(mesh, exposed(even, gains), {.terms = 0, .even_exposure = true, .edge_alpha = test::kNoTrace},
                         job, &evened);
    slf::fit_light_field(mesh, even, {.terms = 0, .even_exposure = true, .edge_alpha = test::kNoTrace}, job,
                         &untouched);
    ASSERT_EQ(evened.gains.size(), views.size());
    for (std::size_t i = 0; i < views.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(evened.gains[i][c] * mean[c] / gains[i][c], 1, gloss ? 0.04 : 0.01) << i << ' ' << c;
        EXPECT_NEAR(untouched.gains[i][c], 1, gloss ? 0.04 : 0.01) << i << ' ' << c;
      }
    EXPECT_LT(evened.rms_of_mean, 0.6 * plain.rms_of_mean);
    if (!gloss) {
      EXPECT_LT(evened.rms_of_mean, 0.008);
    }
  }
}

TEST(LightField, PhotographsCanBeDespilled) {
  const calib::ColorCount green{{0, 220, 0}, 1};
  const calib::Despill despill({&green, 1});
  const hull::Mesh mesh = test::sphere(16);
  const auto views = test::around(4, 1, 4, test::camera(40, 40, 40));
  const slf::PhotoSet photos = slf::despilled(test::photographs(mesh, test::plain(100, 160, 80), views), despill, 1);
  const slf::Photo before = test::photographs(mesh, test::plain(100, 160, 80), views).read(0), after = photos.read(0);
  const std::uint8_t* middle = after.rgb.row<std::uint8_t>(20) + 3 * 20;
  EXPECT_EQ(before.rgb.row<std::uint8_t>(20)[3 * 20 + 1], 160);
  EXPECT_NEAR(middle[0], 100, 1);
  EXPECT_NEAR(middle[1], 90, 1);  // G' = min(G, (R + B) / 2)
  EXPECT_NEAR(middle[2], 80, 1);
  EXPECT_EQ(test::expect_error([&] { slf::despilled(photos, despill, 1.5f); }).code(), ErrorCode::invalid_argument);
}

TEST(LightField, RecoversFactorsOfKnownRankAndOrdersThemByEnergy) {
  const hull::Mesh mesh = test::sphere(40);
  const slf::PhotoSet seen = photographs_of(mesh, rank_two(), training_views());
  const slf::PhotoSet fresh = photographs_of(mesh, rank_two(), new_views());
  Job job;
  const slf::LightField field = slf::fit_light_field(
      mesh, seen,
      {.terms = 4, .surface_ridge = 1e-4, .view_smoothness = 1e-3, .reflections = false, .edge_alpha = test::kNoTrace},
      job);
  const double none = mean_psnr(field, fresh, 0), one = mean_psnr(field, fresh, 1), two = mean_psnr(field, fresh, 2),
               all = mean_psnr(field, fresh, 4);
  EXPECT_GT(one, none + 4);
  EXPECT_GT(two, one + 3);
  EXPECT_LT(std::abs(all - two), 1.5);  // the others hold nothing
  EXPECT_GT(two, 38);
}

TEST(LightField, IsTheSameForAnyNumberOfThreads) {
  const hull::Mesh mesh = test::sphere(16);
  const slf::PhotoSet seen = photographs_of(mesh, glossy(), test::around(6, 2, 4, test::camera(60, 50, 55)));
  std::string bytes[2];
  for (const unsigned threads : {1u, 3u}) {
    Job job({}, threads);
    bytes[threads > 1] = slf::encode_light_field(slf::fit_light_field(mesh, seen, {.terms = 3, .iterations = 3}, job));
  }
  EXPECT_TRUE(bytes[0] == bytes[1]);
}

TEST(LightField, PlacesThatNobodySawTakeTheColoursAroundThem) {
  const hull::Mesh mesh = test::sphere(24);
  std::vector<View> views;  // all from one side
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d eye(4, 0.5 * (i - 2.5), 0.3 * (i % 2));
    views.push_back({test::camera(80, 70, 75), look_at(eye, {0, 0, 0}, {0, 0, 1})});
  }
  const slf::PhotoSet seen = test::photographs(mesh, test::plain(180, 90, 40), views);
  Job job;
  slf::LightFieldReport report;
  const slf::LightField field =
      slf::fit_light_field(mesh, seen, {.terms = 2, .edge_alpha = test::kNoTrace}, job, &report);
  EXPECT_GT(report.unseen_share, 0.3);
  const View behind{test::camera(80, 70, 75), look_at({-4, 0, 0}, {0, 0, 0}, {0, 0, 1})};
  EXPECT_LE(test::largest_difference(slf::LightFieldRenderer(field).render(behind, {}, job).rgba, {180, 90, 40}), 1);
}

TEST(LightField, StandsDegenerateTrianglesAndUnusedVertices) {
  hull::Mesh mesh = test::sphere(16);
  const auto n = std::uint32_t(mesh.vertices.size());
  mesh.vertices.push_back({5, 5, 5});  // nobody uses it
  mesh.vertices.push_back(mesh.vertices[0]);
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({0, n + 1, 1});  // two vertices at one place
  mesh.triangles.push_back({2, 2, 2});
  const slf::PhotoSet seen =
      test::photographs(test::sphere(16), test::plain(60, 160, 200), test::around(6, 2, 4, test::camera(60, 50, 55)));
  Job job;
  const slf::LightField field = slf::fit_light_field(mesh, seen, {.terms = 2, .edge_alpha = test::kNoTrace}, job);
  const Image rgba = slf::LightFieldRenderer(field).render(seen.views[0], {}, job).rgba;
  EXPECT_LE(test::largest_difference(rgba, {60, 160, 200}), 1);
  EXPECT_NO_THROW(slf::encode_light_field(field));
}

TEST(LightField, ChoosesNodesAmongManyPhotographs) {
  const hull::Mesh mesh = test::sphere(16);
  const slf::PhotoSet seen = photographs_of(mesh, glossy(), test::around(12, 3, 4, test::camera(60, 50, 55)));
  Job job;
  const slf::LightField field = slf::fit_light_field(mesh, seen, {.terms = 3, .max_nodes = 12}, job);
  EXPECT_EQ(field.nodes.size(), 12u);
  const slf::LightField all = slf::fit_light_field(mesh, seen, {.terms = 3}, job);
  EXPECT_EQ(all.nodes.size(), 36u);
  EXPECT_GT(mean_psnr(all, seen), mean_psnr(field, seen));
  EXPECT_GT(mean_psnr(field, seen), mean_psnr(field, seen, 0) + 1);
  // The others do no harm to what those at the nodes alone would say.
  slf::PhotoSet few;
  for (std::size_t i = 0; i < seen.size(); ++i)
    for (const auto& node : field.nodes)
      if (node == seen.views[i].center().cast<float>())
        few.names.push_back(seen.names[i]), few.views.push_back(seen.views[i]);
  ASSERT_EQ(few.size(), 12u);
  few.read = [&](std::size_t i) { return seen.read(std::size_t(std::stoi(few.names[i].substr(5)))); };
  const slf::LightField without = slf::fit_light_field(mesh, few, {.terms = 3}, job);
  const slf::PhotoSet fresh = photographs_of(mesh, glossy(), new_views());
  EXPECT_GT(mean_psnr(field, fresh), mean_psnr(without, fresh) - 0.05);
  EXPECT_GT(mean_psnr(field, seen), mean_psnr(without, seen));
}

TEST(LightField, SaysWhatItNeeds) {
  const hull::Mesh mesh = test::sphere(8);
  const auto views = test::around(4, 1, 4, test::camera(40, 40, 40));
  const slf::PhotoSet two = test::photographs(mesh, test::plain(9, 9, 9), {views[0], views[1]});
  const slf::PhotoSet four = test::photographs(mesh, test::plain(9, 9, 9), views);
  Job job;
  const Error few = test::expect_error([&] { slf::fit_light_field(mesh, two, {}, job); });
  EXPECT_EQ(few.code(), ErrorCode::degenerate);
  EXPECT_THAT(few.message(), testing::HasSubstr("at least three photographs, not 2"));
  EXPECT_EQ(test::expect_error([&] { slf::fit_light_field({}, four, {}, job); }).code(), ErrorCode::degenerate);
  hull::Mesh bad = mesh;
  bad.triangles[3][1] = 1u << 30;
  EXPECT_EQ(test::expect_error([&] { slf::fit_light_field(bad, four, {}, job); }).code(), ErrorCode::bad_input);
  for (const slf::LightFieldOptions& o :
       {slf::LightFieldOptions{.terms = 13}, slf::LightFieldOptions{.terms = -1},
        slf::LightFieldOptions{.max_nodes = 256}, slf::LightFieldOptions{.texel_px = NAN},
        slf::LightFieldOptions{.iterations = 0}, slf::LightFieldOptions{.surface_ridge = -1}})
    EXPECT_EQ(test::expect_error([&] { slf::fit_light_field(mesh, four, o, job); }).code(),
              ErrorCode::invalid_argument);
  Job cancelled;
  cancelled.cancel();
  EXPECT_EQ(test::expect_error([&] { slf::fit_light_field(mesh, four, {}, cancelled); }).code(), ErrorCode::cancelled);
}

}  // namespace
}  // namespace lumihull
