// From nothing to poses: simulated detections of known truth, and what goes wrong in real captures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lumihull/base/error.h>
#include <lumihull/calib/calibrate.h>

#include <algorithm>
#include <random>

#include "simulated_capture.h"

namespace lumihull::calib {
namespace {

using test::pose_errors;
using test::simulate_capture;
using test::SimulatedCapture;
using test::SimulatedOptions;
using testing::HasSubstr;

Calibration calibrate(const SimulatedCapture& capture, bool known = true, CalibrateOptions options = {},
                      unsigned threads = 0) {
  Job job({}, threads);
  if (known) options.refine_intrinsics = false;
  return calibrate_targets(capture.set, capture.photos, capture.cameras(known), options, job);
}

std::vector<const Removed*> removed_as(const Calibration& c, Removed::Kind kind, Removed::Why why) {
  std::vector<const Removed*> found;
  for (const Removed& r : c.removed)
    if (r.kind == kind && r.why == why) found.push_back(&r);
  return found;
}

/// A photograph sees a target elsewhere, if at all.
void replace(SimulatedCapture& capture, std::size_t photo, int id, const Pose& world_from_target) {
  auto& targets = capture.photos[photo].targets;
  std::erase_if(targets, [&](const Detection& d) { return d.id == id; });
  const View view{capture.camera, capture.cam_from_world[photo]};
  if (auto now = test::see_target(capture.set, id, world_from_target, view, 0.05, photo)) targets.push_back(*now);
}

TEST(CalibrateTargets, PlacesEveryPhotographOfAnEnclosure) {
  for (const double radius : {0.8, 1.5, 2.7}) {
    SimulatedOptions o;
    o.radius_m = radius;
    o.targets = 120;
    const SimulatedCapture capture = simulate_capture(o);
    for (const PhotoTargets& p : capture.photos) ASSERT_GE(p.targets.size(), 3u) << p.name << " at " << radius;
    const Calibration c = calibrate(capture);
    EXPECT_EQ(c.parts, 1);
    EXPECT_EQ(pose_errors(capture, c).photos, o.photos);
    // As far off as the covariances say; their datum is the targets', the errors' the cameras', so roughly.
    double expected = 0;
    for (std::size_t i = 0; i < c.photos.size(); ++i) {
      const CalibratedPhoto& p = c.photos[i];
      // The centre is -R' t: it moves by -R' (dt - dr x t).
      Eigen::Matrix<double, 3, 6> j;
      const Eigen::Vector3d& t = p.cam_from_world->translation;
      j << 0, -t.z(), t.y(), 1, 0, 0, t.z(), 0, -t.x(), 0, 1, 0, -t.y(), t.x(), 0, 0, 0, 1;
      expected += (j * p.covariance * j.transpose()).trace() / double(c.photos.size());
    }
    EXPECT_LT(pose_errors(capture, c).centre_m, 1.5 * std::sqrt(expected)) << radius;
    EXPECT_GT(pose_errors(capture, c).centre_m, 0.3 * std::sqrt(expected)) << radius;
    EXPECT_LT(pose_errors(capture, c).centre_m, 3e-4) << radius;
    EXPECT_NEAR(c.rms_px, 0.05 * std::sqrt(2.0), 0.01);
    EXPECT_NEAR(c.sigma0, 1, 0.05);
    EXPECT_GT(c.share, 0.995);  // 4 sigma of a Rayleigh: 3.4 in 10,000
    EXPECT_NEAR(c.cross_validation_sigma, 1, 0.4);
    EXPECT_THAT(c.verdict, HasSubstr("Good"));
  }
}

TEST(CalibrateTargets, FindsTheCameraToo) {
  const SimulatedCapture capture = simulate_capture({});
  const Calibration c = calibrate(capture, false);
  EXPECT_EQ(pose_errors(capture, c).photos, 60);
  EXPECT_LT(pose_errors(capture, c).centre_m, 3e-4);
  const double sd = std::sqrt(c.camera_covariances[0](0, 0));
  EXPECT_GT(sd, 0);
  EXPECT_LT(std::abs(c.cameras[0].f - capture.camera.f), 5 * sd);
  EXPECT_NEAR(c.cameras[0].k1, capture.camera.k1, 0.002);
}

TEST(CalibrateTargets, ALensThatHasMoreTermsIsGivenThem) {
  SimulatedOptions o;
  o.photos = 24;
  o.targets = 120;
  o.radius_m = 1.5;
  o.noise_px = 0.01;
  const Calibration plain = calibrate(simulate_capture(o), false);
  EXPECT_EQ(plain.cameras[0].s, 1);  // nothing asks for it
  EXPECT_EQ(plain.cameras[0].k3, 0);
  o.s = 1.0004;
  o.k3 = 0.01;
  const SimulatedCapture capture = simulate_capture(o);
  const Calibration c = calibrate(capture, false);
  EXPECT_EQ(pose_errors(capture, c).photos, o.photos);
  EXPECT_NEAR(c.cameras[0].s, o.s, 5 * std::sqrt(c.camera_covariances[0](1, 1)));
  EXPECT_NEAR(c.cameras[0].k3, o.k3, 5 * std::sqrt(c.camera_covariances[0](7, 7)));
  EXPECT_NEAR(c.sigma0, 1, 0.05);
  EXPECT_GT(c.share, 0.995);
}

TEST(CalibrateTargets, AModelThatDoesNotFitPushesNoPhotographOut) {
  SimulatedOptions o;
  o.photos = 24;
  o.targets = 120;
  o.radius_m = 1.5;
  o.noise_px = 0.005;  // what is left over is far more
  o.s = 1.0008;
  const SimulatedCapture capture = simulate_capture(o);
  CalibrateOptions options;
  options.more_if_needed = false;
  const Calibration c = calibrate(capture, false, options);
  EXPECT_EQ(pose_errors(capture, c).photos, o.photos);
  EXPECT_GT(c.share, 0.9);
  EXPECT_GT(c.sigma0, 1.3);
  EXPECT_THAT(c.verdict, HasSubstr("Usable with care"));
}

TEST(CalibrateTargets, SmallTagsThatCanBeTiltedEitherWay) {
  SimulatedOptions o;
  o.family = "aruco:6x6_250:35mm";
  o.floor_only = true;
  o.targets = 20;
  o.photos = 22;
  o.radius_m = 1.2;
  o.noise_px = 0.1;
  const SimulatedCapture capture = simulate_capture(o);
  const Calibration c = calibrate(capture, false);
  int enough = 0;
  for (const PhotoTargets& p : capture.photos) enough += p.targets.size() >= 3;
  ASSERT_GE(enough, 18);
  EXPECT_GE(pose_errors(capture, c).photos, enough);
  EXPECT_LT(pose_errors(capture, c).centre_m, 5e-4);
  EXPECT_NEAR(c.rms_px, 0.1 * std::sqrt(2.0), 0.015);
  EXPECT_LT(c.bend_m, 2e-3);
  // z stands up from the sheet.
  for (const CalibratedPhoto& p : c.photos) EXPECT_TRUE(p.part != 0 || p.cam_from_world->center().z() > 0);
}

TEST(CalibrateTargets, WrongIdsAreNamedAndDoNotMatter) {
  SimulatedCapture capture = simulate_capture({}), without = capture;
  std::mt19937_64 random(7);
  std::vector<std::pair<int, int>> wrong;  // (photograph, id as read)
  for (std::size_t i = 0; i < capture.photos.size(); ++i)
    for (Detection& d : capture.photos[i].targets) {
      if (random() % 20 != 0) continue;
      const int other = int(random() % 40);
      const bool there = std::any_of(capture.photos[i].targets.begin(), capture.photos[i].targets.end(),
                                     [&](const Detection& x) { return x.id == other; });
      if (there) continue;
      std::erase_if(without.photos[i].targets, [&](const Detection& x) { return x.id == d.id; });
      d.id = other;
      wrong.emplace_back(int(i), other);
    }
  const double clean = pose_errors(without, calibrate(without)).centre_m;
  ASSERT_GT(wrong.size(), 15u);
  const Calibration c = calibrate(capture);
  EXPECT_EQ(pose_errors(capture, c).photos, 60);
  EXPECT_LT(pose_errors(capture, c).centre_m, 1.02 * clean + 2e-6);
  std::vector<std::pair<int, int>> named;
  for (const Removed* r : removed_as(c, Removed::Kind::detection, Removed::Why::wrong_id))
    named.emplace_back(r->photo, r->id);
  std::sort(named.begin(), named.end());
  std::sort(wrong.begin(), wrong.end());
  EXPECT_EQ(named, wrong);
}

TEST(CalibrateTargets, ATargetThatWasMovedHalfWayIsNamed) {
  SimulatedCapture capture = simulate_capture({});
  const double clean = pose_errors(capture, calibrate(capture)).centre_m;
  Pose moved = capture.world_from_target[4];
  moved.translation += Eigen::Vector3d(0.02, -0.03, 0.04);
  for (std::size_t i = 30; i < 60; ++i) replace(capture, i, 4, moved);
  const Calibration c = calibrate(capture);
  EXPECT_LT(pose_errors(capture, c).centre_m, 1.02 * clean + 2e-6);
  const auto named = removed_as(c, Removed::Kind::target, Removed::Why::moved);
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named[0]->id, 4);
  EXPECT_GE(named[0]->photo, 28);
  EXPECT_LE(named[0]->photo, 33);
  EXPECT_THAT(named[0]->text, HasSubstr("moved by 53."));
}

TEST(CalibrateTargets, TwoTargetsWithOneIdAreNamed) {
  SimulatedCapture capture = simulate_capture({});
  std::vector<int> seen(40, 0);
  for (const PhotoTargets& p : capture.photos)
    for (const Detection& d : p.targets) ++seen[std::size_t(d.id)];
  const int id = int(std::max_element(seen.begin(), seen.end()) - seen.begin());
  // Photographs show the one or the other in turn: where both are seen a detector takes neither.
  for (std::size_t i = 0; i < 60; ++i)
    if (i % 3 == 0) {
      Pose other = capture.world_from_target[std::size_t(id)];
      other.translation += 0.3 * (other.rotation * Eigen::Vector3d::UnitX());
      replace(capture, i, id, other);
    }
  const Calibration c = calibrate(capture);
  const auto named = removed_as(c, Removed::Kind::target, Removed::Why::same_id);
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named[0]->id, id);
  EXPECT_EQ(pose_errors(capture, c).photos, 60);
}

TEST(CalibrateTargets, PhotographsOfAnotherSceneAndInAMirrorAreNamed) {
  SimulatedCapture capture = simulate_capture({});
  SimulatedOptions o;
  o.seed = 99;  // the same ids, lying otherwise
  capture.photos[10].targets = simulate_capture(o).photos[12].targets;
  for (Detection& d : capture.photos[20].targets) {
    Eigen::Matrix3d flip = Eigen::Matrix3d::Identity();
    flip(0, 0) = -1, flip(0, 2) = capture.camera.width;
    d.pixel_from_target = flip * d.pixel_from_target;
    for (Feature& f : d.features) f.pixel.x() = capture.camera.width - f.pixel.x();
  }
  const Calibration c = calibrate(capture);
  EXPECT_EQ(pose_errors(capture, c).photos, 58);
  const auto scene = removed_as(c, Removed::Kind::photo, Removed::Why::other_scene);
  ASSERT_EQ(scene.size(), 1u);
  EXPECT_EQ(scene[0]->photo, 10);
  const auto mirror = removed_as(c, Removed::Kind::photo, Removed::Why::mirrored);
  ASSERT_EQ(mirror.size(), 1u);
  EXPECT_EQ(mirror[0]->photo, 20);
}

TEST(CalibrateTargets, PartsThatShareNothingAreBothKept) {
  SimulatedCapture capture = simulate_capture({});
  for (std::size_t i = 0; i < 60; ++i)
    std::erase_if(capture.photos[i].targets, [&](const Detection& d) { return (d.id % 4 < 2) != (i < 40); });
  const Calibration c = calibrate(capture);
  EXPECT_EQ(c.parts, 2);
  for (std::size_t i = 0; i < 60; ++i) {
    if (capture.photos[i].targets.size() < 3) continue;
    EXPECT_EQ(c.photos[i].part, i < 40 ? 0 : 1) << i;
    EXPECT_TRUE(c.photos[i].cam_from_part.has_value()) << i;
    // Poses of two frames must not be taken for one world's.
    EXPECT_EQ(c.photos[i].cam_from_world.has_value(), i < 40) << i;
  }
  // So do targets; their distances within a part are the truth's.
  for (const bool first : {true, false}) {
    const CalibratedBody* before = nullptr;
    for (const CalibratedBody& b : c.bodies) {
      if ((b.id % 4 < 2) != first || !b.part_from_body) continue;
      EXPECT_EQ(b.part, first ? 0 : 1) << b.name;
      EXPECT_EQ(b.placed, first) << b.name;
      if (before) {
        const auto& truth = capture.world_from_target;
        EXPECT_NEAR((b.part_from_body->translation - before->part_from_body->translation).norm(),
                    (truth[std::size_t(b.id)].translation - truth[std::size_t(before->id)].translation).norm(), 1e-2);
      }
      before = &b;
    }
    ASSERT_NE(before, nullptr);
  }
  EXPECT_GE(removed_as(c, Removed::Kind::photo, Removed::Why::not_connected).size(), 18u);
  EXPECT_THAT(c.verdict, HasSubstr("of 60 photographs have no pose"));
}

TEST(CalibrateTargets, ATargetThatIsSeenTwiceCantBeChecked) {
  SimulatedOptions o;
  o.photos = 24;
  SimulatedCapture capture = simulate_capture(o);
  EXPECT_THAT(calibrate(capture).warnings, testing::Not(testing::Contains(HasSubstr("matrix5x5 6"))));
  int seen = 0;
  for (PhotoTargets& p : capture.photos)
    std::erase_if(p.targets, [&](const Detection& d) { return d.id == 6 && ++seen > 2; });
  ASSERT_GT(seen, 2);
  EXPECT_THAT(
      calibrate(capture).warnings,
      testing::Contains(testing::AllOf(HasSubstr("seen only twice: can't be checked"), HasSubstr("matrix5x5 6"))));
}

TEST(CalibrateTargets, OrderAndThreadsDoNotMatter) {
  SimulatedOptions o;
  o.photos = 24;
  SimulatedCapture capture = simulate_capture(o);
  const Calibration one = calibrate(capture, true, {}, 1), two = calibrate(capture, true, {}, 2);
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_EQ(one.photos[i].cam_from_world->translation, two.photos[i].cam_from_world->translation);
    EXPECT_EQ(one.photos[i].cam_from_world->rotation.coeffs(), two.photos[i].cam_from_world->rotation.coeffs());
  }
  SimulatedCapture turned = capture;
  std::reverse(turned.photos.begin(), turned.photos.end());
  const Calibration back = calibrate(turned);
  for (std::size_t i = 0; i < 24; ++i)
    EXPECT_LT((one.photos[i].cam_from_world->center() - back.photos[23 - i].cam_from_world->center()).norm(), 1e-7);
}

TEST(CalibrateTargets, UncertaintiesAreThoseOfTheResiduals) {
  // The same measurements, their noise once as it is and once said to be a quarter of it.
  SimulatedOptions o;
  o.noise_px = 0.2;
  SimulatedCapture capture = simulate_capture(o);
  CalibrateOptions options;
  options.model_photos = 40;
  const Calibration honest = calibrate(capture, false, options);
  for (PhotoTargets& p : capture.photos)
    for (Detection& d : p.targets)
      for (Feature& f : d.features) f.covariance /= 16;
  const Calibration boasting = calibrate(capture, false, options);
  EXPECT_NEAR(honest.sigma0, 1, 0.05);
  EXPECT_NEAR(boasting.sigma0, 4, 0.2);
  EXPECT_THAT(boasting.verdict, HasSubstr("the uncertainties given are enlarged as much"));
  for (std::size_t i = 0; i < honest.photos.size(); ++i) {
    const CalibratedPhoto &a = honest.photos[i], &b = boasting.photos[i];
    ASSERT_TRUE(a.cam_from_world && b.cam_from_world) << i;
    EXPECT_NEAR(b.covariance.trace() / a.covariance.trace(), 1, 0.15) << i;
  }
  EXPECT_NEAR(boasting.camera_covariances[0](0, 0) / honest.camera_covariances[0](0, 0), 1, 0.15);
  EXPECT_NEAR(boasting.bodies[3].point_covariances[0].trace() / honest.bodies[3].point_covariances[0].trace(), 1, 0.15);
}

TEST(CalibrateTargets, WhicheverPhotographsTheModelGrowsFromTheAnswerIsTheSame) {
  SimulatedCapture capture = simulate_capture({});
  CalibrateOptions options;
  options.model_photos = 0;
  const Calibration all = calibrate(capture, true, options);
  options.model_photos = 20;
  const Calibration c = calibrate(capture, true, options);
  EXPECT_EQ(pose_errors(capture, c).photos, 60);
  int in_model = 0;
  for (std::size_t i = 0; i < c.photos.size(); ++i) {
    const CalibratedPhoto &a = all.photos[i], &b = c.photos[i];
    in_model += b.in_model;
    EXPECT_FALSE(b.reason.empty());
    ASSERT_TRUE(a.cam_from_world && b.cam_from_world) << i;
    EXPECT_LT((a.cam_from_world->center() - b.cam_from_world->center()).norm(), 1e-7) << i;
    EXPECT_NEAR(b.covariance.trace() / a.covariance.trace(), 1, 1e-4) << i;  // the lens's and the targets' in it
  }
  EXPECT_EQ(in_model, 20);
}

TEST(CalibrateTargets, TwoCamerasOnARigAreFoundToBe) {
  SimulatedCapture capture = simulate_capture({});
  Pose second;  // 120 mm beside the first, turned by 10 degrees
  second.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.17, Eigen::Vector3d::UnitY()));
  second.translation = {-0.12, 0.01, 0.02};
  const std::size_t shots = capture.photos.size();
  for (std::size_t i = 0; i < shots; ++i) {
    PhotoTargets photo;
    photo.name = capture.photos[i].name + "b";
    photo.shot = int(i);
    photo.camera = 1;
    const Pose pose = second * capture.cam_from_world[i];
    for (int id = 0; id < 40; ++id)
      if (auto d = test::see_target(capture.set, id, capture.world_from_target[std::size_t(id)], {capture.camera, pose},
                                    0.05, 5000 + i * 100 + std::size_t(id)))
        photo.targets.push_back(*d);
    capture.photos.push_back(photo);
    capture.cam_from_world.push_back(pose);
  }
  CalibrateOptions options;
  options.rig = true;
  options.refine_intrinsics = false;
  std::vector<CameraStart> cameras = capture.cameras(true);
  cameras.push_back(cameras[0]);
  Job job;
  const Calibration c = calibrate_targets(capture.set, capture.photos, cameras, options, job);
  EXPECT_EQ(pose_errors(capture, c).photos, 120);
  EXPECT_LT((c.cam_from_rig[1].translation - second.translation).norm(), 2e-4);
  EXPECT_LT(c.cam_from_rig[1].rotation.angularDistance(second.rotation), 5e-5);
  // Fixed to each other exactly.
  for (std::size_t i = 0; i < shots; ++i) {
    const Pose relative = *c.photos[shots + i].cam_from_world * c.photos[i].cam_from_world->inverse();
    EXPECT_LT((relative.translation - c.cam_from_rig[1].translation).norm(), 1e-9);
  }
}

TEST(CalibrateTargets, BarsThatContradictAreNamed) {
  SimulatedOptions o;
  o.photos = 30;
  const SimulatedCapture capture = simulate_capture(o);
  const auto bar = [&](const char* name, unsigned a, unsigned b, double stretch) {
    const Eigen::Vector2d first = capture.set.designs[0].feature(0);
    const Eigen::Vector3d place(first.x(), first.y(), 0);
    const double length = (capture.world_from_target[a] * place - capture.world_from_target[b] * place).norm();
    return ScaleBar{name, a, 0, b, 0, stretch * length, 1e-4};
  };
  CalibrateOptions options;
  options.bars = {bar("one", 2, 8, 1.01), bar("two", 4, 10, 1.01)};  // printed 1 % too large: both bars say so
  options.free_print_scale = true;
  const Calibration c = calibrate(capture, true, options);
  EXPECT_NEAR(c.print_scale.x(), 1.01, 5e-4);
  EXPECT_NEAR(c.print_scale.y(), 1.01, 5e-4);
  EXPECT_TRUE(
      std::none_of(c.warnings.begin(), c.warnings.end(), [](const auto& w) { return w.find("bar") != w.npos; }));
  options.bars[1].length_m *= 1.02;
  const Calibration torn = calibrate(capture, true, options);
  EXPECT_THAT(torn.warnings, testing::Contains(HasSubstr("scale bar two")));
  options.bars[1].body_b = 900;
  EXPECT_THROW(calibrate(capture, true, options), Error);
}

TEST(CalibrateTargets, FaultsAreClear) {
  SimulatedOptions o;
  o.photos = 6;
  SimulatedCapture capture = simulate_capture(o);
  Job job;
  const auto run = [&] { calibrate_targets(capture.set, capture.photos, capture.cameras(true), {}, job); };
  capture.photos[0].camera = 3;
  EXPECT_THROW(run(), Error);
  capture.photos[0].camera = 0;
  const auto kept = capture.photos[2].targets;
  capture.photos[2].targets[0].features[0].pixel.x() = std::nan("");
  EXPECT_THROW(run(), Error);
  capture.photos[2].targets = kept;
  EXPECT_NO_THROW(run());
  for (PhotoTargets& p : capture.photos) p.targets.clear();
  try {
    run();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::degenerate);
    EXPECT_THAT(e.message(), HasSubstr("no target of the set was found"));
  }
  // One photograph is not much, but its targets have places.
  SimulatedOptions one;
  one.photos = 1;
  capture = simulate_capture(one);
  const Calibration c = calibrate(capture);
  EXPECT_EQ(pose_errors(capture, c).photos, 1);
  EXPECT_FALSE(c.warnings.empty());
}

}  // namespace
}  // namespace lumihull::calib
