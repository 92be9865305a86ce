#include <lumihull/base/files.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/pipeline.h>
#include <lumihull/slf/truth.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "../calib/capture/made_up_model.h"
#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using testing::HasSubstr;

const double kDegree = std::numbers::pi / 180;

/// How the capture's world lies to the truth's: truth = scale · motion · capture.
struct World {
  double scale = 1;
  Pose motion;

  Pose in_capture(const Pose& cam_from_truth) const {
    const Pose p = cam_from_truth * motion;
    return {p.rotation, p.translation / scale};
  }
  Eigen::Vector3d in_capture(const Eigen::Vector3d& p) const { return motion.inverse() * p / scale; }
};

World moved(double scale = 1) {
  return {scale,
          {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized())), {0.4, -1.5, 0.2}}};
}

/// A capture and the truth about it, in a folder: cameras around the origin, nothing else yet.
struct Scene {
  explicit Scene(World w = {}, Unit unit = Unit::metres, std::vector<View> v = {})
      : world(w),
        views(v.empty() ? test::around(8, 3, 2, test::camera(96, 80, 90)) : std::move(v)),
        capture(Capture::create(folder / "capture")),
        truth(folder / "truth") {
    fs::create_directories(truth);
    capture.unit = unit;
    capture.cameras = {views[0].camera};
    for (std::size_t i = 0; i < views.size(); ++i) {
      Shot shot;
      shot.name = "s" + std::to_string(i);
      shot.file = "photos/" + shot.name + ".png";
      shot.cam_from_world = world.in_capture(views[i].cam_from_world);
      capture.shots.push_back(shot);
    }
    write_cameras();
  }

  void write_cameras() const {
    const Camera& c = views[0].camera;
    Json json{{"format", "lumihull-rig-truth"}, {"version", 1}, {"unit", "m"}};
    json["camera"] = {{"width", c.width}, {"height", c.height}, {"f", c.f},   {"s", c.s},
                      {"skew", c.skew},   {"u0", c.u0},         {"v0", c.v0}, {"k1", c.k1},
                      {"k2", c.k2},       {"k3", c.k3},         {"p1", c.p1}, {"p2", c.p2}};
    json["views"] = Json::array();
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto m = views[i].cam_from_world.matrix();
      Json rows = Json::array();
      for (int r = 0; r < 3; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
      json["views"].push_back({{"name", "s" + std::to_string(i)}, {"cam_from_world", rows}});
    }
    write_file(truth / "cameras.json", json.dump());
  }

  slf::TruthComparison compare(slf::TruthOptions options = {}, unsigned threads = 0) const {
    Job job({}, threads);
    options.surface_samples = 5000;
    return slf::compare_with_truth(capture, truth, options, job);
  }
  Error fault() const {
    return test::expect_error([&] { compare(); });
  }

  test::TemporaryFolder folder;
  World world;
  std::vector<View> views;
  Capture capture;
  fs::path truth;
};

double center_spread(const std::vector<View>& views) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const View& v : views) mean += v.center() / double(views.size());
  double sum = 0;
  for (const View& v : views) sum += (v.center() - mean).squaredNorm();
  return std::sqrt(sum / double(views.size()));
}

TEST(TruthPoses, AMotionAndAnUnknownScaleAreNoErrors) {
  const Scene scene(moved(0.4), Unit::unknown);
  const auto c = scene.compare();
  ASSERT_TRUE(c.poses);
  EXPECT_EQ(c.poses->shots.size(), 24u);
  EXPECT_NEAR(c.poses->scale, 0.4, 1e-12);
  EXPECT_LT(c.poses->center_mm.max, 1e-9);
  EXPECT_LT(c.poses->rotation_deg.max, 1e-5);  // acos near 1
  EXPECT_TRUE(std::isnan(c.poses->scale_error_ppm));
  EXPECT_FALSE(c.poses->aligned_by_rotations);
  EXPECT_TRUE(std::isnan(c.poses->consistency));  // no covariances are stated
}

TEST(TruthPoses, AKnownUnitHasAScaleError) {
  // The capture is too large by a thousandth: truth = capture / 1.001.
  const Scene scene(moved(1 / 1.001));
  const auto c = scene.compare();
  EXPECT_NEAR(c.poses->scale_error_ppm, 1000, 1e-6);
  EXPECT_EQ(c.poses->scale, 1);
  EXPECT_NEAR(c.poses->center_mm.rms, center_spread(scene.views), 1e-6);  // 0.001 of it, in mm
}

TEST(TruthPoses, OneShiftedAndOneTurnedCameraAreFound) {
  Scene scene(moved());
  const auto pose = [&](std::size_t i) -> Pose& { return *scene.capture.shots[i].cam_from_world; };
  pose(5).translation += Eigen::Vector3d(0.024, 0, 0);  // the centre moves as far
  // About its own centre, by one degree.
  pose(9) = Pose{Eigen::Quaterniond(Eigen::AngleAxisd(kDegree, Eigen::Vector3d::UnitZ())), {0, 0, 0}} * pose(9);
  const auto c = scene.compare();
  const auto worst = std::max_element(c.poses->shots.begin(), c.poses->shots.end(),
                                      [](const auto& a, const auto& b) { return a.center_mm < b.center_mm; });
  EXPECT_EQ(worst->name, "s5");
  // The alignment follows by about a 24th of the shift, and a turn.
  EXPECT_GT(worst->center_mm, 20);
  EXPECT_LT(worst->center_mm, 23.5);
  EXPECT_LT(c.poses->center_mm.median, 2);
  EXPECT_NEAR(c.poses->shots[9].rotation_deg, 1, 0.05);
  EXPECT_LT(c.poses->shots[10].rotation_deg, 0.05);
}

TEST(TruthPoses, CentresOnALineAreAlignedByTheRotations) {
  std::vector<View> views;
  for (int i = 0; i < 5; ++i)
    views.push_back({test::camera(96, 80, 90), look_at({0.2 * i, 0, 2}, {0, 0.1 * i, 0}, Eigen::Vector3d::UnitY())});
  for (const std::size_t n : {5u, 2u, 1u}) {
    views.resize(n);
    const Scene scene(moved(), Unit::metres, views);
    const auto c = scene.compare();
    ASSERT_TRUE(c.poses) << n;
    EXPECT_TRUE(c.poses->aligned_by_rotations);
    EXPECT_LT(c.poses->center_mm.max, 1e-9);
    EXPECT_LT(c.poses->rotation_deg.max, 1e-5);
  }
  const Scene scaleless(moved(2), Unit::unknown, {views[0]});
  const auto c = scaleless.compare();
  EXPECT_FALSE(c.poses);
  EXPECT_THAT(c.left_out.at(0), HasSubstr("scale"));
}

/// Shots moved by normal errors of a covariance which is stated as `stated` times as large a sigma.
slf::TruthComparison with_errors(bool unknown_scale, double stated, std::uint64_t seed) {
  Scene scene(moved(unknown_scale ? 0.5 : 1), unknown_scale ? Unit::unknown : Unit::metres,
              test::around(20, 10, 2, test::camera(96, 80, 90)));
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 6> a;
  for (int i = 0; i < 36; ++i) a(i / 6, i % 6) = 1e-4 * normal(random);
  for (Shot& shot : scene.capture.shots) {
    Eigen::Matrix<double, 6, 1> e;
    for (int i = 0; i < 6; ++i) e[i] = normal(random);
    e = a * e;
    const Eigen::Vector3d w = e.head<3>();
    shot.cam_from_world =
        Pose{Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized())), e.tail<3>()} * *shot.cam_from_world;
    shot.pose_quality = PoseQuality{stated * stated * a * a.transpose(), 50, 0.1};
  }
  return scene.compare();
}

TEST(TruthPoses, ConsistencyIsOneWhereCovariancesAreRight) {
  for (const bool unknown : {false, true}) {
    SCOPED_TRACE(unknown);
    const auto c = with_errors(unknown, 1, 3);
    EXPECT_NEAR(c.poses->consistency, 1, 0.12);  // 1200 degrees of freedom: a standard deviation of 0.041
    EXPECT_FALSE(c.poses->consistency_by_targets);
    EXPECT_NEAR(with_errors(unknown, 0.5, 3).poses->consistency, 4 * c.poses->consistency, 1e-3);
  }
}

TEST(TruthLens, FocalLengthAndPrincipalPoint) {
  Scene scene;
  Camera& camera = scene.capture.cameras[0];
  camera.f *= 1.01;
  const auto l = scene.compare().lenses.at(0);
  EXPECT_NEAR(l.focal_error_percent, 1, 1e-9);
  // A ray at a distance r from the middle is seen 0.01 r farther out, and no rotation takes that off.
  double squares = 0, most = 0;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 48; ++x) {
      const double r = std::hypot(2.0 * x + 1 - 48, 2.5 * y + 1.25 - 40);
      squares += r * r / (32 * 48), most = std::max(most, r);
    }
  EXPECT_NEAR(l.projection_rms_px, 0.01 * std::sqrt(squares), 1e-3);
  EXPECT_NEAR(l.projection_max_px, 0.01 * most, 1e-3);

  // A rotation looks much like a shift of the principal point where the lens is long.
  for (View& v : scene.views) v.camera.f = 9000;
  scene.write_cameras();
  camera = scene.views[0].camera;
  camera.u0 += 3, camera.v0 -= 2;
  const auto m = scene.compare().lenses.at(0);
  EXPECT_NEAR(m.principal_point_px.x(), 3, 1e-12);
  EXPECT_NEAR(m.principal_point_px.y(), -2, 1e-12);
  EXPECT_LT(m.projection_max_px, 1e-3);
}

Image disc(double radius, Eigen::Vector2d middle = {48, 40}) {
  Image mask(96, 80, 1);
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 96; ++x)
      mask.row<std::uint8_t>(y)[x] = std::uint8_t(
          std::lround(255 * std::clamp(radius + 0.5 - (Eigen::Vector2d(x + 0.5, y + 0.5) - middle).norm(), 0.0, 1.0)));
  return mask;
}

void write_masks(Scene& scene, const Image& found, const Image& truth) {
  fs::create_directories(scene.truth / "masks");
  fs::create_directories(scene.capture.folder() / "masks");
  for (std::size_t i = 0; i < scene.capture.shots.size(); ++i) {
    scene.capture.write_mask(i, found, MaskSource::keyed);
    write_png(scene.truth / "masks" / (scene.capture.shots[i].name + ".png"), truth);
  }
}

void square(Image& mask, int x0, int y0, int side, std::uint8_t value) {
  for (int y = y0; y < y0 + side; ++y) std::fill_n(mask.row<std::uint8_t>(y) + x0, side, value);
}

TEST(TruthMasks, ADilationOfOnePixelIsMeasuredSubPixel) {
  for (const double grown : {0.0, 0.25, 1.0, -1.0, 3.0}) {
    SCOPED_TRACE(grown);
    Scene scene;
    write_masks(scene, disc(20 + grown), disc(20));
    const auto c = scene.compare();
    ASSERT_TRUE(c.masks);
    ASSERT_EQ(c.masks->shots.size(), 24u);
    EXPECT_NEAR(c.masks->edge_px.median, std::abs(grown), 0.06);
    EXPECT_NEAR(c.masks->edge_px.q95, std::abs(grown), 0.1);
    EXPECT_NEAR(c.masks->bias_px, grown * (1 + grown / 40), 0.03);
    const double ratio = std::pow((20 + grown) / 20, 2);
    EXPECT_NEAR(c.masks->iou_mean, std::min(ratio, 1 / ratio), 0.02);
    EXPECT_EQ(c.masks->within, std::abs(grown) < 1.5 ? 1 : 0);
    EXPECT_EQ(c.masks->holes + c.masks->islands, 0u);
    EXPECT_EQ(c.masks->shots[3].edge_px.count, c.masks->shots[4].edge_px.count);
  }
}

TEST(TruthMasks, HolesAndIslandsAreThoseThatTheTruthDoesNotHave) {
  Scene scene;
  Image truth = disc(20), found = disc(20);
  square(truth, 40, 36, 5, 0);  // a true hole, which the mask has, too
  square(found, 40, 36, 5, 0);
  square(found, 52, 36, 3, 0);    // a false one
  square(found, 70, 60, 4, 255);  // something in the background
  square(truth, 5, 5, 4, 255);    // a true second part
  square(found, 5, 5, 4, 255);
  write_masks(scene, found, truth);
  const auto c = scene.compare();
  EXPECT_EQ(c.masks->shots[0].holes, 1u);
  EXPECT_EQ(c.masks->shots[0].hole_px, 9u);
  EXPECT_EQ(c.masks->shots[0].islands, 1u);
  EXPECT_EQ(c.masks->shots[0].island_px, 16u);
  EXPECT_EQ(c.masks->holes, 24u);
  EXPECT_GT(c.masks->edge_px.max, 5);
}

TEST(TruthMasks, AnEmptyMaskIsFarFromEverything) {
  Scene scene;
  write_masks(scene, Image(96, 80, 1), disc(20));
  const auto c = scene.compare();
  EXPECT_EQ(c.masks->iou_mean, 0);
  EXPECT_EQ(c.masks->edge_px.median, 64);
}

hull::Mesh ball(double radius, const World& world = {}) {
  hull::Mesh mesh = test::sphere(60);
  for (Eigen::Vector3f& p : mesh.vertices) p = world.in_capture(radius * p.cast<double>()).cast<float>();
  return mesh;
}

TEST(TruthSurface, BallsOfOtherRadius) {
  for (const double radius : {0.49, 0.5, 0.51}) {
    SCOPED_TRACE(radius);
    Scene scene(moved(0.25), Unit::unknown);
    hull::write_mesh(scene.truth / "mesh.ply", ball(0.5));
    hull::write_mesh(scene.capture.hull_path(), ball(radius, scene.world));
    const auto c = scene.compare();
    ASSERT_TRUE(c.surface);
    const double off = 1000 * std::abs(radius - 0.5);
    for (const slf::Spread* s : {&c.surface->hull_to_truth_mm, &c.surface->truth_to_hull_mm}) {
      EXPECT_EQ(s->count, 5000u);
      EXPECT_NEAR(s->mean, off, 0.02 + 0.001 * off);
      EXPECT_NEAR(s->q95, off, 0.02 + 0.001 * off);
      EXPECT_NEAR(s->max, off, 0.02 + 0.05 * off);
    }
    EXPECT_NEAR(c.surface->volume_ratio, std::pow(radius / 0.5, 3), 1e-3);
    EXPECT_EQ(c.surface->outside_share, radius < 0.5 ? 1 : 0);
    EXPECT_NEAR(c.surface->outside_max_mm, radius < 0.5 ? off : 0, 0.05 + 0.05 * off);
    EXPECT_NEAR(c.surface->voxel_mm, 2000 * radius / 256, 0.05);
    // Seen from 2 m, the ball's outline is the tangent cone's: radius / sqrt(1 - (radius / 2)²) / 2.
    const auto seen = [](double r) { return r / std::sqrt(4 - r * r); };
    const double ratio = std::pow(seen(std::min(radius, 0.5)) / seen(std::max(radius, 0.5)), 2);
    EXPECT_NEAR(c.surface->iou_mean, ratio, 0.015);
    EXPECT_LE(c.surface->iou_least, c.surface->iou_mean + 1e-12);
    ASSERT_EQ(c.surface->silhouettes.size(), 24u);
  }
}

TEST(TruthSurface, WhatWasCutAwayIsContained) {
  Scene scene;
  hull::write_mesh(scene.truth / "mesh.ply", test::box({-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}));
  hull::write_mesh(scene.capture.hull_path(), test::box({-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.3f}));
  const auto c = scene.compare();
  // The top, and the upper fifth of four sides less 1 mm.
  EXPECT_NEAR(c.surface->outside_share, (1 + 4 * 0.199) / 6, 0.01);
  EXPECT_NEAR(c.surface->outside_max_mm, 200, 0.01);
  EXPECT_NEAR(c.surface->truth_to_hull_mm.max, 200, 0.01);
  EXPECT_NEAR(c.surface->hull_to_truth_mm.max, 200, 0.01);  // its top is that far inside
  EXPECT_NEAR(c.surface->volume_ratio, 0.8, 1e-6);
}

/// Targets as a calibration solved them and as they hang, in the scene's worlds.
void write_targets(const Scene& scene, const std::function<void(calib::TargetModel&)>& spoil = {}) {
  calib::TargetModel model = test::made_up_model(8, 6);
  Json truth{{"format", "lumihull-rig-targets"}, {"version", 1}, {"targets", Json::array()}};
  const Pose capture_from_truth = scene.world.motion.inverse();
  for (calib::CalibratedBody& body : model.calibration.bodies) {
    const auto& p = body.body.world_from_body;
    truth["targets"].push_back({{"design", 0},
                                {"id", body.id},
                                {"world_from_target",
                                 {{"q", {p.rotation.w(), p.rotation.x(), p.rotation.y(), p.rotation.z()}},
                                  {"t", {p.translation.x(), p.translation.y(), p.translation.z()}}}}});
    body.body.bend.setZero();
    for (std::size_t k = 0; k < body.points.size(); ++k)
      body.points[k] = capture_from_truth * body.body.point(k) / scene.world.scale;
  }
  if (spoil) spoil(model);
  model.save(scene.capture.folder() / "targets.json");
  write_file(scene.truth / "targets.json", truth.dump());
}

TEST(TruthTargets, PlacesAndIds) {
  const Scene scene(moved(0.5), Unit::unknown);
  write_targets(scene);
  auto c = scene.compare();
  ASSERT_TRUE(c.targets);
  EXPECT_EQ(c.targets->targets.size(), 5u);
  EXPECT_LT(c.targets->point_mm.max, 1e-9);
  EXPECT_EQ(c.targets->not_solved, std::vector<std::string>{"matrix5x5 5"});
  EXPECT_TRUE(c.targets->wrong_ids.empty());

  write_targets(scene, [](calib::TargetModel& m) {
    for (auto& p : m.calibration.bodies[2].points) p.z() += 0.004;  // 2 mm in the truth's scale
    std::swap(m.calibration.bodies[0].points, m.calibration.bodies[3].points);
    m.calibration.bodies[4].id = 77;
    for (auto& f : m.calibration.bodies[4].features) f.id = 77;
  });
  c = scene.compare();
  EXPECT_NEAR(c.targets->targets.at(2).rms_mm, 2, 1e-9);
  EXPECT_LT(c.targets->targets.at(1).rms_mm, 1e-9);
  EXPECT_THAT(c.targets->wrong_ids, testing::UnorderedElementsAre("matrix5x5 77", "matrix5x5 0", "matrix5x5 3"));
  EXPECT_THAT(c.targets->not_solved, testing::ElementsAre("matrix5x5 4", "matrix5x5 5"));
}

TEST(TruthPoses, TheTargetsAreTheDatumOfTheCovariances) {
  Scene scene(moved());
  write_targets(scene);
  // All cameras are off by the same motion of the world, which an alignment by cameras would take off.
  const Pose off{Eigen::Quaterniond::Identity(), {0.003, 0, 0}};
  for (Shot& shot : scene.capture.shots) {
    shot.cam_from_world = *shot.cam_from_world * off;
    shot.pose_quality = PoseQuality{1e-6 * Eigen::Matrix<double, 6, 6>::Identity(), 50, 0.1};
  }
  auto c = scene.compare();
  EXPECT_TRUE(c.poses->consistency_by_targets);
  EXPECT_NEAR(c.poses->consistency, 9.0 / 6, 1e-6);
  EXPECT_LT(c.poses->center_mm.max, 1e-9);
  fs::remove(scene.truth / "targets.json");
  c = scene.compare();
  EXPECT_FALSE(c.poses->consistency_by_targets);
  EXPECT_LT(c.poses->consistency, 1e-12);
}

/// A painted ball with photographs, masks, hull, textured model and test views.
void furnish(Scene& scene) {
  const hull::Mesh mesh = ball(0.5), seen = ball(0.5, scene.world);
  fs::create_directories(scene.capture.folder() / "photos");
  fs::create_directories(scene.truth / "masks");
  fs::create_directories(scene.truth / "test_views" / "masks");
  fs::create_directories(scene.capture.folder() / "masks");
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const slf::Photo photo = test::photograph(mesh, test::bands(), scene.views[i]);
    Shot& shot = scene.capture.shots[i];
    write_png(scene.capture.photo_path(shot), photo.rgb);
    shot.stamp = Capture::stamp(scene.capture.photo_path(shot));
    scene.capture.write_mask(i, photo.alpha, MaskSource::keyed);
    write_png(scene.truth / "masks" / (shot.name + ".png"), photo.alpha);
  }
  hull::write_mesh(scene.truth / "mesh.ply", mesh);
  hull::write_mesh(scene.capture.hull_path(), seen);
  std::vector<slf::PathView> path;
  for (int i = 0; i < 3; ++i) {
    path.push_back({"t" + std::to_string(i),
                    {scene.views[0].camera, look_at({1.5, 0.5 * i, 0.9}, Eigen::Vector3d::Zero(), {0, 0, 1})}});
    const slf::Photo photo = test::photograph(mesh, test::bands(), path.back().view);
    write_png(scene.truth / "test_views" / (path.back().name + ".png"), photo.rgb);
    write_png(scene.truth / "test_views" / "masks" / (path.back().name + ".png"), photo.alpha);
  }
  slf::write_camera_path(scene.truth / "test_views.json", path);
  scene.capture.save();
  std::vector<std::size_t> all(scene.views.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  Job job;
  slf::TextureOptions texture;
  texture.max_side = 512;
  slf::write_glb(scene.capture.folder() / "textured.glb",
                 slf::mean_texture(seen, slf::photos_of(scene.capture, all), texture, job));
}

TEST(TruthViews, ANewViewIsFoundInTheCapturesWorld) {
  Scene plain, far(moved(0.3), Unit::unknown);
  furnish(plain);
  furnish(far);
  slf::TruthOptions options;
  options.pictures = false;
  const auto a = plain.compare(options), b = far.compare(options);
  ASSERT_TRUE(a.views && b.views);
  EXPECT_EQ(a.views->views, 3u);
  for (const char* method : {"mean_texture", "lumigraph"}) {
    EXPECT_GT(a.views->methods.at(method).psnr_inside, 28) << method;
    EXPECT_NEAR(a.views->methods.at(method).psnr_inside, b.views->methods.at(method).psnr_inside, 0.3) << method;
  }
  EXPECT_THAT(a.left_out, testing::Contains(HasSubstr("light_field.glb")));
  EXPECT_THAT(a.left_out, testing::Contains(HasSubstr("test_views/highlights/")));
  EXPECT_FALSE(fs::exists(plain.capture.folder() / "evaluate"));
}

TEST(Truth, TheStageComparesWithNothingHeldOut) {
  Scene scene(moved());
  furnish(scene);
  Job job;
  slf::set_option(scene.capture, "evaluate", "truth", scene.truth.string());
  slf::set_option(scene.capture, "evaluate", "rays", std::int64_t(1));
  const auto result = slf::run_stage(scene.capture, "evaluate", job);
  EXPECT_THAT(result.said, testing::Contains(HasSubstr("poses: 24 of 24 placed")));
  const auto json = Json::parse(read_file(scene.capture.folder() / "evaluate" / "evaluation.json"));
  EXPECT_EQ(json.at("photos_held_out"), 0);
  EXPECT_LT(json.at("truth").at("poses").at("center_mm").at("max").get<double>(), 1e-6);
  EXPECT_EQ(json.at("truth").at("masks").at("iou_mean"), 1);
  EXPECT_EQ(json.at("truth").at("test_views").at("views"), 3);
  const std::string page = read_file(scene.capture.folder() / "evaluate" / "truth.html");
  for (const char* part : {"<h2>Poses", "<h2>Lenses", "<h2>Masks", "<h2>Surface", "Test views", "<svg", "<img"})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_THAT(page, testing::Not(HasSubstr("src=\"http")));
  EXPECT_TRUE(slf::run_stage(scene.capture, "evaluate", job).skipped);
  write_png(scene.truth / "masks" / "s3.png", disc(10));
  EXPECT_FALSE(slf::run_stage(scene.capture, "evaluate", job).skipped);
  slf::run_stage(scene.capture, "report", job);
  EXPECT_THAT(read_file(scene.capture.folder() / "report.html"), HasSubstr("evaluate/truth.html"));
}

TEST(Truth, OneResultForAnyNumberOfThreads) {
  Scene scene(moved());
  write_masks(scene, disc(21), disc(20));
  hull::write_mesh(scene.truth / "mesh.ply", ball(0.5));
  hull::write_mesh(scene.capture.hull_path(), ball(0.51, scene.world));
  write_targets(scene);
  EXPECT_EQ(scene.compare({}, 1).to_json(), scene.compare({}, 5).to_json());
}

TEST(Truth, WhatIsMissingIsNamed) {
  Scene scene(moved());
  const auto bare = scene.compare();
  EXPECT_TRUE(bare.poses);
  for (const char* what : {"targets: ", "masks: ", "surface: ", "new views: "})
    EXPECT_THAT(bare.left_out, testing::Contains(testing::StartsWith(what)));
  EXPECT_THAT(bare.to_json(), HasSubstr("\"left_out\""));

  scene.capture.shots[4].cam_from_world.reset();
  scene.capture.shots[6].name = "other";
  const auto c = scene.compare();
  EXPECT_EQ(c.poses->not_placed, std::vector<std::string>{"s4"});
  EXPECT_EQ(c.poses->not_in_truth, std::vector<std::string>{"other"});
  EXPECT_EQ(c.poses->not_in_capture, std::vector<std::string>{"s6"});
  EXPECT_EQ(c.poses->shots.size(), 22u);

  write_masks(scene, disc(20), disc(20));
  fs::remove(scene.truth / "masks" / "s2.png");
  EXPECT_EQ(scene.compare().masks->without_truth, std::vector<std::string>{"s2"});
  fs::remove(scene.truth / "cameras.json");  // masks alone
  const auto masks = scene.compare();
  EXPECT_TRUE(masks.masks);
  EXPECT_FALSE(masks.poses);
}

TEST(Truth, ACapturesOwnCamerasMayBeTheTruth) {
  Scene scene(moved());
  Capture copy = scene.capture;
  copy.save();
  fs::copy_file(scene.capture.folder() / "cameras.json", scene.truth / "cameras.json",
                fs::copy_options::overwrite_existing);
  EXPECT_LT(scene.compare().poses->center_mm.max, 1e-9);
}

TEST(Truth, ContradictionsAreErrors) {
  Scene scene;
  const auto expect = [&](ErrorCode code, const char* words) {
    const Error e = scene.fault();
    EXPECT_EQ(e.code(), code) << e.what();
    EXPECT_THAT(e.what(), HasSubstr(words));
  };
  const std::string good = read_file(scene.truth / "cameras.json");
  const auto with = [&](const std::function<void(Json&)>& change) {
    Json json = Json::parse(good);
    change(json);
    write_file(scene.truth / "cameras.json", json.dump());
  };
  with([](Json& j) { j["format"] = "other"; });
  expect(ErrorCode::bad_input, "/format");
  with([](Json& j) { j["unit"] = "mm"; });
  expect(ErrorCode::bad_input, "/unit");
  with([](Json& j) { j["views"][3]["name"] = "s2"; });
  expect(ErrorCode::bad_input, "/views/3/name");
  with([](Json& j) { j["views"][3]["cam_from_world"][0][0] = 1.5; });
  expect(ErrorCode::bad_input, "/views/3/cam_from_world");
  with([](Json& j) { j["views"][3].erase("cam_from_world"); });
  expect(ErrorCode::bad_input, "/views/3");
  with([](Json& j) { j["camera"]["width"] = 97; });
  expect(ErrorCode::bad_input, "97 x 80");
  with([](Json& j) {
    for (auto& v : j["views"]) v["name"] = "x" + v["name"].get<std::string>();
  });
  expect(ErrorCode::bad_input, "no view is named like");
  write_file(scene.truth / "cameras.json", good.substr(0, good.size() / 2));
  expect(ErrorCode::bad_input, "cameras.json");
  write_file(scene.truth / "cameras.json", good);

  write_masks(scene, disc(20), disc(20));
  write_png(scene.truth / "masks" / "s1.png", Image(95, 80, 1));
  expect(ErrorCode::bad_input, "s1.png");
  fs::remove_all(scene.truth / "masks");

  write_targets(scene);
  Json targets = Json::parse(read_file(scene.truth / "targets.json"));
  Json twice = targets, design = targets;
  twice["targets"][1]["id"] = twice["targets"][0]["id"];
  write_file(scene.truth / "targets.json", twice.dump());
  expect(ErrorCode::bad_input, "/targets/1/id");
  design["targets"][1]["design"] = 3;
  write_file(scene.truth / "targets.json", design.dump());
  expect(ErrorCode::bad_input, "design");
  fs::remove(scene.truth / "targets.json");

  hull::write_mesh(scene.capture.hull_path(), ball(0.5));
  write_file(scene.truth / "mesh.ply", "ply\n");
  expect(ErrorCode::bad_input, "mesh.ply");
  fs::remove(scene.truth / "mesh.ply");

  Job job;
  slf::TruthOptions options;
  options.surface_samples = 1;
  EXPECT_EQ(test::expect_error([&] { slf::compare_with_truth(scene.capture, scene.truth, options, job); }).code(),
            ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { slf::compare_with_truth(scene.capture, scene.folder / "none", {}, job); }).code(),
            ErrorCode::not_found);
  fs::create_directories(scene.folder / "empty");
  EXPECT_EQ(test::expect_error([&] { slf::compare_with_truth(scene.capture, scene.folder / "empty", {}, job); }).code(),
            ErrorCode::not_found);
  job.cancel();
  EXPECT_EQ(test::expect_error([&] { slf::compare_with_truth(scene.capture, scene.truth, {}, job); }).code(),
            ErrorCode::cancelled);
}

}  // namespace
}  // namespace lumihull
