// COLMAP's program with what is exported to it, and driven as a source of poses.
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>
#include <lumihull/calib/calibrate_capture.h>
#include <lumihull/calib/feature_poses.h>
#include <lumihull/calib/target_tracks.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

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
  const auto adjusted = run_colmap("bundle_adjuster --input_path '" + (folder / "model").string() + "' --output_path '" +
                                       (folder / "adjusted").string() + "'",
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
  ASSERT_TRUE(run_colmap("point_triangulator --clear_points 1 --database_path '" + database + "' --image_path '" + images +
                             "' --input_path '" + (folder / "model").string() + "' --output_path '" +
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
    EXPECT_EQ(test::expect_error([&] { ScaleDistance::from_text(wrong); }).code(), ErrorCode::invalid_argument) << wrong;

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

TEST(Features, TempleIsPlacedWithAScale) {
  NEEDS_COLMAP();
  LUMIHULL_NEED_REAL_DATA(temple, "temple");
  const test::TemporaryFolder folder;
  Job job;
  ImportOptions import;
  import.output = folder / "truth";
  const Capture truth = import_middlebury(temple / "templeSR_par.txt", import, job);
  Capture capture = truth;  // the camera known, its poses not
  for (Shot& shot : capture.shots) shot.cam_from_world.reset();
  FeatureOptions options;
  const double known = (truth.view(1).center() - truth.view(3).center()).norm();
  options.scale_distance = ScaleDistance{truth.shots[1].name, truth.shots[3].name, known};
  const FeatureReport report = poses_from_features(capture, options, job);
  EXPECT_GE(report.placed, 10u);
  EXPECT_EQ(capture.unit, Unit::metres);
  EXPECT_FALSE(fs::exists(capture.folder() / "features"));
  for (std::size_t a = 0; a < truth.shots.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      if (!capture.positioned(a) || !capture.positioned(b)) continue;
      const double mine = (capture.view(a).center() - capture.view(b).center()).norm();
      EXPECT_NEAR(mine, (truth.view(a).center() - truth.view(b).center()).norm(), 0.05 * known) << a << " " << b;
    }
}

}  // namespace
}  // namespace lumihull::calib
