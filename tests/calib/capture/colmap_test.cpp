// COLMAP's program with what is exported to it, and driven as a source of poses.
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>
#include <lumihull/calib/calibrate_capture.h>
#include <lumihull/calib/feature_poses.h>
#include <lumihull/calib/target_tracks.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <sstream>

#include "alignment.h"
#include "printed_scene.h"
#include "support.h"

namespace lumihull::calib {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

std::optional<std::string> run_colmap(const std::string& arguments, const fs::path& log) {
  const std::string command =
      "QT_QPA_PLATFORM=offscreen colmap " + arguments + " > '" + log.string() + "' 2>&1 < /dev/null";
  if (std::system(command.c_str()) != 0) return std::nullopt;
  return read_file(log);
}

bool colmap_is_there() { return std::system("command -v colmap > /dev/null 2>&1") == 0; }
#define NEEDS_COLMAP() \
  if (!colmap_is_there()) GTEST_SKIP() << "needs the program colmap (Debian's package colmap)"

double number_after(const std::string& text, const std::string& word) {
  const std::size_t at = text.find(word);
  EXPECT_NE(at, std::string::npos) << word << " in\n" << text;
  return at == std::string::npos ? -1 : std::strtod(text.c_str() + at + word.size(), nullptr);
}

Capture imported(const test::PrintedScene& scene, const fs::path& folder) {
  Job job;
  ImportOptions options;
  options.output = folder;
  return import_photos(scene.photos, options, job);
}

TEST(Colmap, ReadsAdjustsAndTriangulatesWhatIsExported) {
  NEEDS_COLMAP();
  const test::TemporaryFolder folder;
  const test::PrintedScene scene = test::print_scene(folder.path());
  Capture capture = imported(scene, folder / "capture");
  Job job;
  CalibrateCaptureOptions options;
  options.targets = "matrix5x5:18mm";
  const CalibrateCaptureReport report = calibrate_capture(capture, options, job);
  const std::vector<Track> tracks = target_tracks(capture);
  export_colmap(capture, folder / "model", {}, tracks);
  std::size_t sights = 0;
  for (const Track& track : tracks) sights += track.sights.size();

  const auto analyzed = run_colmap("model_analyzer --path '" + (folder / "model").string() + "'", folder / "log");
  ASSERT_TRUE(analyzed.has_value()) << read_file(folder / "log");
  EXPECT_EQ(number_after(*analyzed, "Registered images: "), double(capture.shots.size()));
  EXPECT_EQ(number_after(*analyzed, "Points: "), double(tracks.size()));
  EXPECT_EQ(number_after(*analyzed, "Observations: "), double(sights));
  EXPECT_LT(number_after(*analyzed, "Mean reprojection error: "), 1.1 * report.model.calibration.rms_px);

  // With the poses that it is given, adjusting changes next to nothing: circles' centres are where it expects points.
  fs::create_directories(folder / "adjusted");
  const auto adjusted = run_colmap("bundle_adjuster --input_path '" + (folder / "model").string() +
                                       "' --output_path '" + (folder / "adjusted").string() + "'",
                                   folder / "log");
  ASSERT_TRUE(adjusted.has_value()) << read_file(folder / "log");
  EXPECT_TRUE(fs::exists(folder / "adjusted/images.bin"));
  Job quiet;
  RefitImportOptions import;
  import.output = folder / "again";
  const Capture again = import_colmap(folder / "adjusted", folder.path(), import, quiet);
  ASSERT_EQ(again.shots.size(), capture.shots.size());
  // Its scale is free: compare shapes.
  const auto length = [](const Capture& c, std::size_t a, std::size_t b) {
    return (c.view(a).center() - c.view(b).center()).norm();
  };
  for (std::size_t i = 2; i < capture.shots.size(); ++i)
    EXPECT_NEAR(length(again, 0, i) / length(again, 0, 1), length(capture, 0, i) / length(capture, 0, 1), 5e-3);

  // Triangulation wants its database: our points as its key points, matched by their tracks.
  const auto lists = folder / "keypoints";
  fs::create_directories(lists);
  std::vector<std::vector<std::pair<Eigen::Vector2d, std::size_t>>> points(capture.shots.size());
  for (std::size_t t = 0; t < tracks.size(); ++t)
    for (const Track::Sight& s : tracks[t].sights) points[s.shot].emplace_back(s.pixel, t);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::ofstream file(lists / (fs::path(capture.shots[i].file).filename().string() + ".txt"));
    file.precision(12);
    file << points[i].size() << " 128\n";
    for (const auto& [pixel, track] : points[i]) {
      file << pixel.x() << " " << pixel.y() << " 1 0";
      for (int k = 0; k < 128; ++k) file << " 0";
      file << "\n";
    }
  }
  std::ofstream matches(folder / "matches.txt");
  for (std::size_t a = 0; a < points.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      std::ostringstream pairs;
      for (std::size_t i = 0; i < points[a].size(); ++i)
        for (std::size_t k = 0; k < points[b].size(); ++k)
          if (points[a][i].second == points[b][k].second) pairs << i << " " << k << "\n";
      if (pairs.str().empty()) continue;
      matches << fs::path(capture.shots[a].file).filename().string() << " "
              << fs::path(capture.shots[b].file).filename().string() << "\n"
              << pairs.str() << "\n";
    }
  matches.close();
  const std::string images = (capture.folder() / "photos").string(), database = (folder / "database.db").string();
  ASSERT_TRUE(run_colmap("feature_importer --database_path '" + database + "' --image_path '" + images +
                             "' --import_path '" + lists.string() + "' --ImageReader.single_camera 1",
                         folder / "log"))
      << read_file(folder / "log");
  ASSERT_TRUE(run_colmap("matches_importer --database_path '" + database + "' --match_list_path '" +
                             (folder / "matches.txt").string() + "' --match_type inliers --SiftMatching.use_gpu 0",
                         folder / "log"))
      << read_file(folder / "log");
  fs::create_directories(folder / "triangulated");
  ASSERT_TRUE(run_colmap("point_triangulator --clear_points 1 --database_path '" + database + "' --image_path '" +
                             images + "' --input_path '" + (folder / "model").string() + "' --output_path '" +
                             (folder / "triangulated").string() + "'",
                         folder / "log"))
      << read_file(folder / "log");
  const auto triangulated =
      run_colmap("model_analyzer --path '" + (folder / "triangulated").string() + "'", folder / "log");
  ASSERT_TRUE(triangulated.has_value());
  EXPECT_GT(number_after(*triangulated, "Points: "), 0.9 * double(tracks.size()));
  EXPECT_LT(number_after(*triangulated, "Mean reprojection error: "), 1.2 * report.model.calibration.rms_px);
}

TEST(Features, WhatIsWrongIsSaidInWords) {
  EXPECT_FALSE(ScaleDistance::from_text("").has_value());
  const auto scale = ScaleDistance::from_text("left one, right one, 0.25");
  ASSERT_TRUE(scale.has_value());
  EXPECT_EQ(scale->photo_a, "left one");
  EXPECT_EQ(scale->photo_b, "right one");
  EXPECT_EQ(scale->metres, 0.25);
  EXPECT_EQ(ScaleDistance::from_text("a b 2")->photo_b, "b");
  for (const char* wrong : {"a", "a b", "a,b,-1", "a,b,0", "a,b,1m", "a,a,1", "a,b,nan", "a b c 1"})
    EXPECT_EQ(test::expect_error([&] { ScaleDistance::from_text(wrong); }).code(), ErrorCode::invalid_argument)
        << wrong;

  const test::TemporaryFolder folder;
  const test::PrintedScene scene = test::print_scene(folder.path(), "matrix5x5:18mm", 3);
  Capture capture = imported(scene, folder / "capture");
  Job job;
  FeatureOptions options;
  options.program = "lumihull-no-such-program";
  const Error absent = test::expect_error([&] { poses_from_features(capture, options, job); });
  EXPECT_EQ(absent.code(), ErrorCode::not_found);
  EXPECT_THAT(absent.message(), HasSubstr("COLMAP"));
  options.program = "false";
  const Error failed = test::expect_error([&] { poses_from_features(capture, options, job); });
  EXPECT_EQ(failed.code(), ErrorCode::io);
  EXPECT_THAT(failed.message(), HasSubstr("feature_extractor failed with status 1"));
  EXPECT_TRUE(fs::exists(capture.folder() / "features/colmap.log"));
  EXPECT_FALSE(fs::exists(capture.folder() / "features/photos"));
  options.scale_distance = ScaleDistance{"p0", "p9", 1};
  EXPECT_THAT(test::expect_error([&] { poses_from_features(capture, options, job); }).message(), HasSubstr("p9"));
  capture.shots.resize(2);
  EXPECT_EQ(test::expect_error([&] { poses_from_features(capture, {}, job); }).code(), ErrorCode::degenerate);
}

template <class T>
void put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A stand-in for COLMAP: a script whose mapper gives back a model that was written before.
fs::path stand_in(const fs::path& folder, const test::PrintedScene& scene, double metres_per_unit, std::size_t placed) {
  const fs::path model = folder / "stand_in_model";
  fs::create_directories(model);
  std::string cameras, images;
  put(cameras, std::uint64_t(1)), put(cameras, std::uint32_t(1)), put(cameras, std::int32_t(1));  // PINHOLE
  put(cameras, std::uint64_t(640)), put(cameras, std::uint64_t(480));
  for (const double p : {760.0, 760.0, 325.0, 236.0}) put(cameras, p);
  put(images, std::uint64_t(placed));
  for (std::size_t i = 0; i < placed; ++i) {
    const Pose& pose = scene.cam_from_world[i];
    put(images, std::uint32_t(i + 1));
    for (const double q : {pose.rotation.w(), pose.rotation.x(), pose.rotation.y(), pose.rotation.z()}) put(images, q);
    for (int k = 0; k < 3; ++k) put(images, pose.translation[k] / metres_per_unit);
    put(images, std::uint32_t(1));
    images += "0/" + std::to_string(i) + ".png";
    images += '\0';
    put(images, std::uint64_t(0));
  }
  write_file(model / "cameras.bin", cameras);
  write_file(model / "images.bin", images);
  const fs::path script = folder / "stand_in.sh";
  write_file(script,
             "#!/bin/sh\n[ $1 = mapper ] || exit 0\nwhile [ $1 != --output_path ]; do shift; done\n"
             "mkdir $2/0 && cp '" +
                 model.string() + "'/*.bin $2/0\n");
  fs::permissions(script, fs::perms::owner_all);
  return script;
}

TEST(Features, TakesOverTheModelAndGivesItAScale) {
  const test::TemporaryFolder folder;
  const test::PrintedScene scene = test::print_scene(folder.path(), "matrix5x5:18mm", 5);
  Capture capture = imported(scene, folder / "capture");
  write_file(target_model_path(capture), "of another world");
  Job job;
  FeatureOptions options;
  options.program = stand_in(folder.path(), scene, 2.5, 4).string();
  const auto error = [&] {
    std::vector<std::optional<Pose>> poses;
    for (const Shot& shot : capture.shots) poses.push_back(shot.cam_from_world);
    return scene.center_error_m(poses);
  };
  FeatureReport report = poses_from_features(capture, options, job);
  EXPECT_EQ(report.placed, 4u);
  EXPECT_FALSE(report.scale.has_value());
  EXPECT_EQ(capture.unit, Unit::unknown);
  EXPECT_TRUE(capture.positioned(3));
  EXPECT_FALSE(capture.positioned(4));
  EXPECT_GT(error(), 0.1);
  EXPECT_EQ(capture.cameras[0].f, 760);
  EXPECT_FALSE(fs::exists(target_model_path(capture)));
  EXPECT_FALSE(fs::exists(capture.folder() / "features"));

  options.scale_distance =
      ScaleDistance{"p0", "p2", (scene.cam_from_world[0].center() - scene.cam_from_world[2].center()).norm()};
  report = poses_from_features(capture, options, job);
  EXPECT_NEAR(report.scale.value_or(0), 2.5, 1e-9);
  EXPECT_EQ(Capture::open(capture.folder()).unit, Unit::metres);
  EXPECT_LT(error(), 1e-9);

  options.scale_distance = ScaleDistance{"p0", "p4", 1};
  EXPECT_EQ(test::expect_error([&] { poses_from_features(capture, options, job); }).subject(), "p4");
  EXPECT_LT(error(), 1e-9) << "a failure leaves what was there";

  options.scale_distance.reset();
  options.targets = scene.set;
  report = poses_from_features(capture, options, job);
  EXPECT_NEAR(report.scale.value_or(0), 2.5, 0.025) << "the stand-in has no lens distortion, the pictures do";
}

TEST(Features, AStoppedRunGoesOnWithItsDatabase) {
  const test::TemporaryFolder folder;
  const test::PrintedScene scene = test::print_scene(folder.path(), "matrix5x5:18mm", 4);
  Capture capture = imported(scene, folder / "capture");
  Job job;
  FeatureOptions options;
  // A stand-in that notes its commands, and whose matcher fails once.
  const fs::path inner = stand_in(folder.path(), scene, 1, 4), script = folder / "noting.sh", notes = folder / "notes";
  write_file(script, "#!/bin/sh\necho $1 >> '" + notes.string() +
                         "'\n[ $1 = feature_extractor ] && : > \"$3\"\n[ $1 = " + "exhaustive_matcher ] && [ ! -e '" +
                         (folder / "once").string() + "' ] && : > '" + (folder / "once").string() +
                         "' && exit 3\nexec '" + inner.string() + "' \"$@\"\n");
  fs::permissions(script, fs::perms::owner_all);
  options.program = script.string();
  EXPECT_THAT(test::expect_error([&] { poses_from_features(capture, options, job); }).message(),
              HasSubstr("exhaustive_matcher failed with status 3"));
  EXPECT_TRUE(fs::exists(capture.folder() / "features/database.db"));
  EXPECT_FALSE(fs::exists(capture.folder() / "features/photos"));
  EXPECT_EQ(poses_from_features(capture, options, job).placed, 4u);
  EXPECT_EQ(read_file(notes), "feature_extractor\nexhaustive_matcher\nexhaustive_matcher\nmapper\n");
  EXPECT_FALSE(fs::exists(capture.folder() / "features"));

  // Another way of matching, or another photograph, is another database.
  for (const bool photo : {false, true}) {
    SCOPED_TRACE(photo);
    fs::remove(folder / "once");
    options.sequential = false;
    EXPECT_EQ(test::expect_error([&] { poses_from_features(capture, options, job); }).code(), ErrorCode::io);
    options.sequential = !photo;
    if (photo) write_png(capture.photo_path(capture.shots[1]), Image(640, 480, 3));
    fs::remove(notes);
    poses_from_features(capture, options, job);
    EXPECT_THAT(read_file(notes), HasSubstr("feature_extractor\n"));
  }
}

TEST(Features, TempleIsPlaced) {
  NEEDS_COLMAP();
  LUMIHULL_NEED_REAL_DATA(temple, "temple");
  const test::TemporaryFolder folder;
  Job job;
  ImportOptions import;
  import.output = folder / "truth";
  const Capture truth = import_middlebury(temple / "templeSR_par.txt", import, job);
  Capture capture = truth;  // the camera known, its poses not
  for (Shot& shot : capture.shots) shot.cam_from_world.reset();
  const FeatureReport report = poses_from_features(capture, {}, job);
  EXPECT_GE(report.placed, 8u);
  EXPECT_EQ(capture.unit, Unit::unknown);
  // What COLMAP makes of it is COLMAP's, and its mapper draws lots: most distances between cameras agree up to the
  // scale, which is what a wrong order, a transform the other way round or another camera's pose would not leave.
  std::vector<std::pair<double, double>> lengths;
  std::vector<double> ratios;
  double longest = 0;
  for (std::size_t a = 0; a < truth.shots.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      if (!capture.positioned(a) || !capture.positioned(b)) continue;
      lengths.emplace_back((capture.view(a).center() - capture.view(b).center()).norm(),
                           (truth.view(a).center() - truth.view(b).center()).norm());
      ratios.push_back(lengths.back().first / lengths.back().second);
      longest = std::max(longest, lengths.back().second);
    }
  ASSERT_FALSE(ratios.empty());
  std::nth_element(ratios.begin(), ratios.begin() + std::ptrdiff_t(ratios.size() / 2), ratios.end());
  const double scale = ratios[ratios.size() / 2];
  const auto near = std::count_if(lengths.begin(), lengths.end(),
                                  [&](const auto& l) { return std::abs(l.first / scale - l.second) < 0.05 * longest; });
  EXPECT_GT(double(near), 0.7 * double(lengths.size()));

  // Turned, moved and scaled onto the truth by the cameras' centres: how far off the rest is.
  std::vector<Eigen::Vector3d> found, true_centers;
  for (std::size_t i = 0; i < truth.shots.size(); ++i)
    if (capture.positioned(i))
      found.push_back(capture.view(i).center()), true_centers.push_back(truth.view(i).center());
  const test::Alignment aligned = test::align_points(found, true_centers, false);
  std::vector<double> angles, offsets;
  for (std::size_t i = 0; i < truth.shots.size(); ++i) {
    if (!capture.positioned(i)) continue;
    const Eigen::Quaterniond turned = capture.shots[i].cam_from_world->rotation * aligned.motion.rotation.conjugate();
    angles.push_back(180 / std::numbers::pi * turned.angularDistance(truth.shots[i].cam_from_world->rotation));
    const double distance = true_centers[offsets.size()].norm();  // the object stands about the origin
    offsets.push_back((aligned.motion * (aligned.scale * found[offsets.size()]) - true_centers[offsets.size()]).norm() /
                      distance);
  }
  std::sort(angles.begin(), angles.end()), std::sort(offsets.begin(), offsets.end());
  std::printf(
      "temple: %zu of %zu placed; directions off by %.2f degrees (median; %.2f most), centres by %.2f %% of their "
      "distance (%.2f most)\n",
      report.placed, truth.shots.size(), angles[angles.size() / 2], angles.back(), 100 * offsets[offsets.size() / 2],
      100 * offsets.back());
  EXPECT_LT(angles[angles.size() / 2], 5);
  EXPECT_LT(offsets[offsets.size() / 2], 0.1);
}

}  // namespace
}  // namespace lumihull::calib
