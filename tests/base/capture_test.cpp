#include <fcntl.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <tuple>

#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

Capture small_capture(const fs::path& folder) {
  Capture capture = Capture::create(folder);
  capture.unit = Unit::metres;
  capture.cameras.push_back({.width = 8, .height = 6, .f = 10, .u0 = 4, .v0 = 3, .k1 = -0.1});
  for (int i = 0; i < 3; ++i) {
    Shot shot;
    shot.name = "p" + std::to_string(i);
    shot.file = "photos/" + shot.name + ".png";
    if (i != 1) shot.cam_from_world = Pose{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {0.1, 1.0 / 3, double(i)}};
    capture.shots.push_back(shot);
    fs::create_directories(folder / "photos");
    write_png(folder / shot.file, Image(8, 6, 3));
  }
  capture.background_rgb = {1, 2, 3};
  capture.options["hull"]["resolution"] = std::int64_t(150);
  capture.options["hull"]["region"] = std::vector<double>{-1, 2.5};
  capture.options["key"]["background"] = std::string("auto");
  capture.stages["key"] = {sha256("x"), 1.5, 1000, "2026-01-02T03:04:05Z"};
  capture.notes.push_back("a \"note\"");
  capture.set_hold_out(2);
  return capture;
}

TEST(Capture, SaveAndOpenRoundTrip) {
  const test::TemporaryFolder folder;
  const Capture a = small_capture(folder / "c");
  a.save();
  const Capture b = Capture::open(folder / "c");
  EXPECT_EQ(b.unit, Unit::metres);
  ASSERT_EQ(b.shots.size(), 3u);
  EXPECT_FALSE(b.positioned(1));
  EXPECT_EQ(b.shots[0].cam_from_world->translation, a.shots[0].cam_from_world->translation);
  EXPECT_EQ(b.shots[0].cam_from_world->rotation.coeffs(), a.shots[0].cam_from_world->rotation.coeffs());
  EXPECT_EQ(b.cameras[0].k1, -0.1);
  EXPECT_EQ(b.background_rgb, a.background_rgb);
  EXPECT_EQ(b.options, a.options);
  EXPECT_EQ(b.notes, a.notes);
  EXPECT_EQ(b.stages.at("key").seconds, 1.5);
  EXPECT_EQ(b.hold_out(), 2);
  EXPECT_TRUE(b.held_out(0) && !b.held_out(1) && b.held_out(2));
  const std::string first = read_file(folder / "c" / "capture.json");
  b.save();
  EXPECT_EQ(read_file(folder / "c" / "capture.json"), first);
}

TEST(Capture, RefusesAFolderInUse) {
  const test::TemporaryFolder folder;
  write_file(folder / "mine.txt", "x");
  EXPECT_EQ(test::expect_error([&] { Capture::create(folder.path()); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { Capture::open(folder.path()); }).code(), ErrorCode::not_found);
}

TEST(Capture, WrongFieldsAreNamedByPointer) {
  const test::TemporaryFolder folder;
  small_capture(folder / "c").save();
  const std::string good = read_file(folder / "c" / "capture.json");
  const std::string cameras = read_file(folder / "c" / "cameras.json");
  const auto complaint = [&](const std::string& file, std::string text, const std::string& from,
                             const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    write_file(folder / "c" / file, text);
    const Error e = test::expect_error([&] { Capture::open(folder / "c"); });
    write_file(folder / "c" / "capture.json", good);
    write_file(folder / "c" / "cameras.json", cameras);
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_THAT(e.subject(), HasSubstr(file));
    return e.message();
  };
  EXPECT_THAT(complaint("capture.json", good, "\"unit\": \"m\"", "\"unit\": 3"), HasSubstr("/unit"));
  EXPECT_THAT(complaint("capture.json", good, "\"version\": 1", "\"version\": 2"), HasSubstr("/version"));
  EXPECT_THAT(complaint("capture.json", good, "\"name\": \"p1\"", "\"name\": \"p0\""), HasSubstr("/shots/1/name"));
  EXPECT_THAT(complaint("capture.json", good, "\"name\": \"p1\"", "\"name\": \"../p\""), HasSubstr("/shots/1/name"));
  EXPECT_THAT(complaint("capture.json", good, "\"camera\": 0", "\"camera\": -1"), HasSubstr("/shots/0/camera"));
  {  // the complaint is cameras.json's: it lacks what capture.json names
    std::string text = good;
    text.replace(text.find("\"camera\": 0"), 11, "\"camera\": 7");
    write_file(folder / "c" / "capture.json", text);
    const Error e = test::expect_error([&] { Capture::open(folder / "c"); });
    write_file(folder / "c" / "capture.json", good);
    EXPECT_THAT(e.what(), AllOf(HasSubstr("cameras.json"), HasSubstr("/cameras"), HasSubstr("p0")));
  }
  EXPECT_THAT(complaint("capture.json", good, "\"seconds\": 1.5", "\"seconds\": -1"),
              HasSubstr("/stages/key/seconds: expected a number of at least 0"));
  EXPECT_THAT(complaint("capture.json", good, "\"hold_out\": 2", "\"hold_out\": 1"), HasSubstr("/evaluate/hold_out"));
  EXPECT_THAT(complaint("capture.json", good, "\"name\": \"p1\"", "\"name\": \"p\\n1\""), HasSubstr("/shots/1/name"));
  EXPECT_THAT(complaint("capture.json", good, "{", "["), HasSubstr("JSON"));
  EXPECT_THAT(complaint("cameras.json", cameras, "\"f\": 10.0", "\"f\": -10"), HasSubstr("/cameras/0/f"));
  EXPECT_THAT(complaint("cameras.json", cameras, "\"f\": 10.0", "\"f\": 1e999"), HasSubstr("1e999"));
  EXPECT_THAT(complaint("cameras.json", cameras, "0.5,", "0.6,"), HasSubstr("/cam_from_world/p0/q"));
  EXPECT_THAT(complaint("cameras.json", cameras, "\"p2\": {", "\"p9\": {"), HasSubstr("/cam_from_world/p9"));
}

TEST(Capture, KeepsHowWellCamerasAndPosesAreKnown) {
  const test::TemporaryFolder folder;
  Capture capture = small_capture(folder / "c");
  capture.save();
  EXPECT_THAT(read_file(folder / "c/cameras.json"), HasSubstr("\"version\": 1")) << "nothing that is new: as before";
  Eigen::Matrix<double, 6, 6> pose = Eigen::Matrix<double, 6, 6>::Identity() * 1e-9;
  pose(0, 4) = pose(4, 0) = 1.0 / 3e9;
  capture.shots[2].pose_quality = PoseQuality{pose, 75, 0.0421};
  capture.shots[1].pose_quality = PoseQuality{pose, 9, 1};  // without a pose: not kept
  Eigen::Matrix<double, 10, 10> intrinsics = Eigen::Matrix<double, 10, 10>::Zero();
  intrinsics(0, 0) = 0.25, intrinsics(3, 3) = 0.5, intrinsics(0, 3) = intrinsics(3, 0) = -0.1;
  capture.camera_covariances[0] = intrinsics;
  capture.save();
  const std::string text = read_file(folder / "c/cameras.json");
  const Capture again = Capture::open(folder / "c");
  ASSERT_TRUE(again.shots[2].pose_quality.has_value());
  EXPECT_EQ(again.shots[2].pose_quality->covariance, pose);
  EXPECT_EQ(again.shots[2].pose_quality->points, 75);
  EXPECT_EQ(again.shots[2].pose_quality->rms_px, 0.0421);
  EXPECT_FALSE(again.shots[0].pose_quality || again.shots[1].pose_quality);
  EXPECT_EQ(again.camera_covariances.at(0), intrinsics);
  again.save();
  EXPECT_EQ(read_file(folder / "c/cameras.json"), text);

  for (const auto& [from, to, place] : {std::tuple{"\"points\": 75", "\"points\": -1", "/pose_quality/p2/points"},
                                        {"\"rms_px\": 0.0421", "\"rms_px\": null", "/pose_quality/p2/rms_px"},
                                        {"0.25,", "-0.25,", "/camera_covariances/0/covariance"},
                                        {"0.25,", "0.001,", "/camera_covariances/0/covariance"},
                                        {"\"camera\": 0", "\"camera\": 1", "/camera_covariances/0/camera"},
                                        {"\"version\": 2", "\"version\": 3", "/version"}}) {
    std::string wrong = text;
    ASSERT_NE(wrong.find(from), std::string::npos) << from;
    wrong.replace(wrong.find(from), std::string(from).size(), to);
    write_file(folder / "c/cameras.json", wrong);
    EXPECT_THAT(test::expect_error([&] { Capture::open(folder / "c"); }).message(), HasSubstr(place));
  }
  // A covariance beyond what can be read again never replaces the file.
  write_file(folder / "c/cameras.json", text);
  capture.camera_covariances[0](0, 0) = -1;
  EXPECT_EQ(test::expect_error([&] { capture.save(); }).code(), ErrorCode::bad_input);
  EXPECT_EQ(read_file(folder / "c/cameras.json"), text);
}

TEST(Capture, OptionsOfAnotherTypeAreAnError) {
  const test::TemporaryFolder folder;
  const Capture c = small_capture(folder / "c");
  EXPECT_EQ(c.option("hull", "resolution", std::int64_t(5)), 150);
  EXPECT_EQ(c.option("hull", "resolution", 5.0), 150.0);
  EXPECT_EQ(c.option("hull", "other", std::int64_t(5)), 5);
  EXPECT_THAT(test::expect_error([&] { c.option("hull", "resolution", std::string()); }).message(),
              HasSubstr("/options/hull/resolution"));
}

TEST(Capture, PhotographsMustHaveTheirCamerasSize) {
  const test::TemporaryFolder folder;
  const Capture c = small_capture(folder / "c");
  EXPECT_EQ(c.read_photo(0).width(), 8);
  write_png(folder / "c" / "photos" / "p1.png", Image(6, 8, 3));
  const Error e = test::expect_error([&] { c.read_photo(1); });
  EXPECT_THAT(e.message(), HasSubstr("8 x 6"));
  EXPECT_THAT(e.subject(), HasSubstr("p1.png"));
  EXPECT_EQ(test::expect_error([&] { c.view(1); }).subject(), "p1");
}

TEST(Capture, AMaskThatAPersonEditedIsRecognised) {
  const test::TemporaryFolder folder;
  Capture c = small_capture(folder / "c");
  EXPECT_EQ(c.mask_state(c.shots[0]), MaskSource::none);
  EXPECT_EQ(test::expect_error([&] { c.read_mask(0); }).code(), ErrorCode::not_found);
  Image mask(8, 6, 1);
  mask.row<std::uint8_t>(2)[3] = 255;
  c.write_mask(0, mask, MaskSource::keyed);
  EXPECT_EQ(c.mask_state(c.shots[0]), MaskSource::keyed);
  EXPECT_EQ(c.read_mask(0).row<std::uint8_t>(2)[3], 255);
  mask.row<std::uint8_t>(2)[4] = 255;
  write_png(c.mask_path(c.shots[0]), mask);
  EXPECT_EQ(c.mask_state(c.shots[0]), MaskSource::edited);
  write_png(c.mask_path(c.shots[0]), Image(6, 8, 1));
  EXPECT_THAT(test::expect_error([&] { c.read_mask(0); }).message(), HasSubstr("8 x 6"));
}

TEST(Capture, MasksOfAKilledRunAreNotTakenForDrawnOnes) {
  const test::TemporaryFolder folder;
  small_capture(folder / "c").save();
  {
    Capture killed = Capture::open(folder / "c");
    killed.write_mask(0, Image(8, 6, 1), MaskSource::keyed);
  }  // never saved
  Capture c = Capture::open(folder / "c");
  EXPECT_EQ(c.mask_state(c.shots[0]), MaskSource::keyed);
  c.save();
  EXPECT_EQ(Capture::open(folder / "c").mask_state(c.shots[0]), MaskSource::keyed);
  Image drawn(8, 6, 1);
  drawn.row<std::uint8_t>(0)[0] = 255;
  fs::create_directories(folder / "c" / "masks");
  write_png(c.mask_path(c.shots[2]), drawn);
  EXPECT_EQ(Capture::open(folder / "c").mask_state(c.shots[2]), MaskSource::edited);
}

TEST(Capture, MasksOfAKilledRunAreFoundWhateverTheirShotsAreCalled) {
  const test::TemporaryFolder folder;
  Capture c = small_capture(folder / "c");
  c.shots[0].name = "  two  words ";
  c.save();
  c.write_mask(0, Image(8, 6, 1), MaskSource::keyed);
  c.write_mask(1, Image(8, 6, 1), MaskSource::imported);
  const Capture again = Capture::open(folder / "c");
  EXPECT_EQ(again.mask_state(again.shots[0]), MaskSource::keyed);
  EXPECT_EQ(again.mask_state(again.shots[1]), MaskSource::imported);
}

TEST(Capture, WhatCouldNotBeReadAgainIsNotSaved) {
  const test::TemporaryFolder folder;
  const Capture good = small_capture(folder / "c");
  good.save();
  const std::string main = read_file(folder / "c" / "capture.json"), cameras = read_file(folder / "c" / "cameras.json");
  const auto refused = [&](const std::function<void(Capture&)>& spoil) {
    Capture bad = good;
    spoil(bad);
    const Error e = test::expect_error([&] { bad.save(); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_EQ(read_file(folder / "c" / "capture.json"), main);
    EXPECT_EQ(read_file(folder / "c" / "cameras.json"), cameras);
    return std::string(e.what());
  };
  EXPECT_THAT(refused([](Capture& c) { c.options["hull"]["x"] = std::nan(""); }), HasSubstr("/options/hull/x"));
  EXPECT_THAT(refused([](Capture& c) { c.shots[1].name = "p0"; }), HasSubstr("/shots/1/name"));
  EXPECT_THAT(refused([](Capture& c) { c.notes = {"caf\xe9"}; }), HasSubstr("UTF-8"));
  EXPECT_THAT(refused([](Capture& c) { c.cameras[0].u0 = INFINITY; }), HasSubstr("/cameras/0/u0"));
  EXPECT_THAT(refused([](Capture& c) { c.shots[0].cam_from_world->translation.x() = NAN; }),
              HasSubstr("/cam_from_world/p0/t"));
  EXPECT_THAT(refused([](Capture& c) { c.cameras.clear(); }), HasSubstr("camera 0"));
  fs::remove(folder / "c" / "cameras.json");
  EXPECT_THAT(test::expect_error([&] { Capture::open(folder / "c"); }).subject(), HasSubstr("cameras.json"));
}

TEST(Capture, ShotsAreAddedUnderPlainNames) {
  const test::TemporaryFolder folder;
  Capture c = small_capture(folder / "c");
  for (const char* name : {"", ".", "..", "a/b", "a\nb", "caf\xe9", "p1"})
    EXPECT_EQ(test::expect_error([&] { c.add_shot(name, "photos/p1.png", 0); }).code(), ErrorCode::invalid_argument)
        << name;
  EXPECT_EQ(test::expect_error([&] { c.add_shot("new", "photos/p1.png", 1); }).subject(), "camera");
  EXPECT_EQ(test::expect_error([&] { c.add_shot("new", "photos/none.png", 0); }).code(), ErrorCode::not_found);
  EXPECT_EQ(c.add_shot("caf\xc3\xa9 1", "photos/p1.png", 0), 3u);
  c.save();
  EXPECT_EQ(Capture::open(folder / "c").shots[3].name, "caf\xc3\xa9 1");
}

TEST(Capture, StampsBearFilesOfAnyYear) {
  const test::TemporaryFolder folder;
  write_file(folder / "a", "one");
  const timespec times[2] = {{10'000'000'000, 5}, {10'000'000'000, 5}};  // the year 2286
  ASSERT_EQ(utimensat(AT_FDCWD, (folder / "a").c_str(), times, 0), 0);
  const FileStamp first = Capture::stamp(folder / "a");
  EXPECT_EQ(Capture::stamp(folder / "a", first).mtime_ns, first.mtime_ns);
}

TEST(Capture, StampsSeeAChangedFile) {
  const test::TemporaryFolder folder;
  write_file(folder / "a", "one");
  const FileStamp first = Capture::stamp(folder / "a");
  EXPECT_EQ(first.sha256, sha256("one"));
  EXPECT_EQ(Capture::stamp(folder / "a", first).sha256, first.sha256);
  write_file(folder / "a", "two!");
  EXPECT_EQ(Capture::stamp(folder / "a", first).sha256, sha256("two!"));
  EXPECT_EQ(test::expect_error([&] { Capture::stamp(folder / "b"); }).code(), ErrorCode::not_found);
}

}  // namespace
}  // namespace lumihull
