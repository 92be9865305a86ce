// The program as its users have it: a small capture by the virtual rig, every verb, and what goes wrong.

#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/rig/rig_capture.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/light_field_glb.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using test::lumihull;
using test::Outcome;
using testing::HasSubstr;

/// Eighteen small photographs of the vase, made once; tests work on copies.
class ProgramTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder();
    rig::RigOptions options;
    options.photos = 18;
    options.empty_photos = 3;
    options.width = 300;
    Job job;
    rig::make_capture(*folder_ / "rig", options, job);
  }
  static void TearDownTestSuite() { delete folder_; }

  /// A fresh copy of the capture.
  void SetUp() override {
    capture_ = mine_ / "c";
    fs::copy(*folder_ / "rig", capture_, fs::copy_options::recursive);
  }
  std::string capture() const { return capture_.string(); }
  fs::path first_photo() const {
    const Capture c = Capture::open(capture_);
    return c.photo_path(c.shots[1]);
  }
  /// Status 1, and a message of one line that names what it is about.
  static void expect_failure(const Outcome& outcome, const std::string& names) {
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(names));
    const auto at = outcome.err.find("lumihull: ");
    ASSERT_NE(at, std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find('\n', at), outcome.err.size() - 1) << "one line, the last: " << outcome.err;
  }

  static inline test::TemporaryFolder* folder_ = nullptr;
  test::TemporaryFolder mine_;
  fs::path capture_;
};

TEST_F(ProgramTest, RunsFromPhotographsToTheReport) {
  const Outcome run = lumihull({"run", capture(), "--hold-out", "6", "--resolution", "64", "--quiet"});
  ASSERT_EQ(run.status, 0) << run.err;
  for (const char* file : {"hull.ply", "textured.glb", "report.html", "key.json", "evaluate/evaluation.json"})
    EXPECT_TRUE(fs::exists(capture_ / file)) << file;

  const Outcome evaluate = lumihull({"evaluate", capture(), "--json", "--quiet"});
  ASSERT_EQ(evaluate.status, 0) << evaluate.err;
  const auto json = nlohmann::json::parse(evaluate.out);
  EXPECT_EQ(json["photos_held_out"], 3);
  EXPECT_EQ(json["photos_used"], 15);
  EXPECT_GT(json["silhouette_iou"], 0.9);
  EXPECT_GT(json["methods"]["lumigraph"]["psnr"], 20.0);
  EXPECT_GT(json["methods"]["mean_texture"]["psnr_inside"], 10.0);
  EXPECT_GT(json["stages"]["hull"]["peak_bytes"], 1'000'000);
  EXPECT_GT(json["model_bytes"], 1000);

  // Nothing changed: the second run does nothing.
  const Outcome again = lumihull({"run", capture(), "--json", "--quiet"});
  ASSERT_EQ(again.status, 0) << again.err;
  for (const auto& [stage, result] : nlohmann::json::parse(again.out)["stages"].items())
    EXPECT_TRUE(result["skipped"]) << stage;

  // One option changes: that stage and what follows from it are done again.
  const Outcome finer = lumihull({"run", capture(), "--resolution", "72", "--json", "--quiet"});
  ASSERT_EQ(finer.status, 0) << finer.err;
  const auto stages = nlohmann::json::parse(finer.out)["stages"];
  EXPECT_TRUE(stages["key"]["skipped"]);
  EXPECT_FALSE(stages["hull"]["skipped"]);
  EXPECT_FALSE(stages["texture"]["skipped"]);
  EXPECT_FALSE(stages["evaluate"]["skipped"]);

  // Views: a turntable, held-out photographs, cameras from a file.
  ASSERT_EQ(
      lumihull({"render", capture(), "--turntable", "3", "--width", "160", "--height", "90", "-o", mine_ / "t"}).status,
      0);
  EXPECT_TRUE(fs::exists(mine_ / "t" / "frame_0002.png"));
  EXPECT_EQ(lumihull({"render", capture(), "--turntable", "3", "-o", mine_ / "t"}).status, 2) << "never overwrites";
  ASSERT_EQ(lumihull({"render", capture(), "--held-out", "--method", "mean_texture", "--background", "1,2,3", "-o",
                      mine_ / "h"})
                .status,
            0);
  EXPECT_EQ(std::distance(fs::directory_iterator(mine_ / "h"), {}), 3);
  const Capture c = Capture::open(capture_);
  const slf::PathView view{"mine", c.view(2)};
  slf::write_camera_path(mine_ / "cameras.json", {&view, 1});
  ASSERT_EQ(lumihull({"render", capture(), "--cameras", mine_ / "cameras.json", "-o", mine_ / "m"}).status, 0);
  EXPECT_TRUE(fs::exists(mine_ / "m" / "mine.png"));

  for (const auto& [format, name] : {std::pair{"ply", "m.ply"}, {"obj", "m.obj"}, {"glb", "m.glb"}}) {
    const Outcome exported = lumihull({"export", format, capture(), "-o", mine_ / name, "--json"});
    EXPECT_EQ(exported.status, 0) << format;
    EXPECT_EQ(nlohmann::json::parse(exported.out)["output"], (mine_ / name).string());
    EXPECT_GT(fs::file_size(mine_ / name), 1000u);
    EXPECT_EQ(lumihull({"export", format, capture(), "-o", mine_ / name}).status, 2) << "never overwrites";
  }
}

TEST_F(ProgramTest, AModelIsRenderedByItsFileAlone) {
  ASSERT_EQ(lumihull({"import", "masks", capture_ / "truth" / "masks", "--into", capture()}).status, 0);
  ASSERT_EQ(lumihull({"hull", capture(), "-q", "--resolution", "48"}).status, 0);
  const auto small = [&](const std::string& source, const fs::path& output, std::vector<std::string> more = {}) {
    std::vector<std::string> command{"render",   source, "--turntable", "2",    "--width", "120",
                                     "--height", "80",   "-o",          output, "-q"};
    command.insert(command.end(), more.begin(), more.end());
    return lumihull(command);
  };
  const auto second = [](const fs::path& folder) { return read_file(folder / "frame_0001.png"); };

  // Without a light field photographs are blended.
  ASSERT_EQ(small(capture(), mine_ / "default").status, 0);
  ASSERT_EQ(small(capture(), mine_ / "lumigraph", {"--method", "lumigraph"}).status, 0);
  EXPECT_EQ(second(mine_ / "default"), second(mine_ / "lumigraph"));

  const Outcome texture = lumihull({"texture", capture(), "-q", "--json"});
  ASSERT_EQ(texture.status, 0) << texture.err;
  EXPECT_FALSE(nlohmann::json::parse(texture.out)["stages"]["texture"]["skipped"]);
  const Outcome lightfield = lumihull({"lightfield", capture(), "-q", "--terms", "3", "--triangles", "2000", "--json"});
  ASSERT_EQ(lightfield.status, 0) << lightfield.err;
  EXPECT_FALSE(nlohmann::json::parse(lightfield.out)["stages"]["lightfield"]["skipped"]);
  EXPECT_EQ(Capture::open(capture_).option("lightfield", "terms", std::int64_t(0)), 3);

  // With one it is the default, and its file alone shows the same.
  ASSERT_EQ(small(capture(), mine_ / "field").status, 0);
  EXPECT_NE(second(mine_ / "field"), second(mine_ / "lumigraph"));
  const slf::PathView view{"same", Capture::open(capture_).view(3)};
  slf::write_camera_path(mine_ / "cameras.json", {&view, 1});
  const auto same = [&](const std::string& source, const std::string& output) {
    EXPECT_EQ(lumihull({"render", source, "--cameras", mine_ / "cameras.json", "-o", mine_ / output}).status, 0);
    return read_file(mine_ / output / "same.png");
  };
  const std::string by_capture = same(capture(), "by_capture");
  fs::rename(capture_ / "light_field.glb", mine_ / "light_field.glb");
  fs::rename(capture_ / "textured.glb", mine_ / "textured.glb");
  ASSERT_EQ(small(mine_ / "light_field.glb", mine_ / "alone").status, 0);
  EXPECT_EQ(same(mine_ / "light_field.glb", "by_file"), by_capture);
  ASSERT_EQ(small(mine_ / "textured.glb", mine_ / "plain").status, 0);
  ASSERT_EQ(small(mine_ / "light_field.glb", mine_ / "everywhere", {"--rays", "4"}).status, 0);
  ASSERT_EQ(small(mine_ / "light_field.glb", mine_ / "adaptive", {"--rays", "4", "--adaptive"}).status, 0);
  EXPECT_NE(second(mine_ / "adaptive"), second(mine_ / "everywhere"));

  // Factored ring by ring, vertices have surface maps of their own.
  EXPECT_TRUE(slf::read_light_field(mine_ / "light_field.glb").slot.empty());
  ASSERT_EQ(lumihull({"lightfield", capture(), "-q", "--factorization", "pca"}).status, 0);
  EXPECT_FALSE(slf::read_light_field(capture_ / "light_field.glb").slot.empty());

  const auto refused = [&](std::vector<std::string> arguments, const std::string& names) {
    arguments.insert(arguments.begin(), {"render", mine_ / "light_field.glb"});
    const Outcome outcome = lumihull(arguments);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, HasSubstr(names));
  };
  refused({}, "--output");
  refused({"--held-out", "-o", mine_ / "no"}, "--held-out");
  refused({"--method", "shaded", "-o", mine_ / "no"}, "--method");
  expect_failure(lumihull({"render", mine_ / "nowhere.glb", "-o", mine_ / "no"}), "nowhere.glb");
  expect_failure(lumihull({"render", first_photo(), "-o", mine_ / "no"}), first_photo().filename());
  EXPECT_FALSE(fs::exists(mine_ / "no"));
}

TEST_F(ProgramTest, WrongUseIsStatusTwo) {
  EXPECT_EQ(lumihull({}).status, 2);
  EXPECT_EQ(lumihull({"dance"}).status, 2);
  EXPECT_EQ(lumihull({"key"}).status, 2);
  EXPECT_EQ(lumihull({"hull", capture(), "--resolution", "1"}).status, 2);
  const Outcome words = lumihull({"hull", capture(), "--resolution", "many"});
  EXPECT_EQ(words.status, 2);
  EXPECT_THAT(words.err, HasSubstr("resolution"));
  EXPECT_EQ(lumihull({"run", capture(), "--hold-out", "1"}).status, 2);
  EXPECT_EQ(lumihull({"import", "projections", "P.txt", "more.txt", "-o", mine_ / "new"}).status, 2);
  const Outcome help = lumihull({"hull", "--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_THAT(help.out, HasSubstr("--resolution"));
  for (const auto& [verb, flag] : {std::pair{"texture", "--texel-px"},
                                   {"lightfield", "--factorization"},
                                   {"render", "--adaptive"},
                                   {"render", "light_field.glb exists"}}) {
    const Outcome outcome = lumihull({verb, "--help"});
    EXPECT_EQ(outcome.status, 0) << verb;
    EXPECT_THAT(outcome.out, HasSubstr(flag)) << verb;
  }
  EXPECT_EQ(lumihull({"lightfield", capture(), "--factorization", "svd"}).status, 2);
}

TEST_F(ProgramTest, NotACapture) {
  expect_failure(lumihull({"run", mine_ / "nowhere"}), "capture.json");
  expect_failure(lumihull({"hull", capture()}), "mask");
  expect_failure(lumihull({"render", capture()}), "hull");
  expect_failure(lumihull({"render", capture(), "--method", "mean_texture"}), "run the stage \"texture\" first");
  expect_failure(lumihull({"export", "ply", capture(), "-o", mine_ / "m.ply"}), "run the stage \"hull\" first");
}

TEST_F(ProgramTest, ATruncatedPhotographIsNamed) {
  const std::string bytes = read_file(first_photo());
  std::ofstream(first_photo(), std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  expect_failure(lumihull({"run", capture(), "-q"}), first_photo().filename());
}

TEST_F(ProgramTest, APhotographOfAnotherSizeIsNamed) {
  write_jpeg(first_photo(), Image(64, 48, 3));
  expect_failure(lumihull({"run", capture(), "-q"}), first_photo().filename());
}

TEST_F(ProgramTest, AMissingPhotographIsNamed) {
  fs::remove(first_photo());
  expect_failure(lumihull({"key", capture(), "-q"}), first_photo().filename());
}

TEST_F(ProgramTest, NotANumberInAMatrixIsNamedWithItsLine) {
  std::ofstream(mine_ / "P.txt") << first_photo().string() << " 1 0 0 0 0 1 0 0 0 0 1 nan\n";
  const Outcome outcome = lumihull({"import", "projections", mine_ / "P.txt", "-o", mine_ / "new"});
  expect_failure(outcome, "P.txt");
  EXPECT_THAT(outcome.err, HasSubstr("line 1"));
  EXPECT_FALSE(fs::exists(mine_ / "new"));
}

TEST_F(ProgramTest, AFullDiskLeavesTheCaptureAsItWas) {
  ASSERT_EQ(lumihull({"run", capture(), "-q", "--resolution", "48"}).status, 0);
  const std::string hull = read_file(capture_ / "hull.ply"), state = read_file(capture_ / "capture.json");
  const Outcome outcome = lumihull({"hull", capture(), "-q", "--resolution", "80"}, {.file_size_limit = 20'000});
  expect_failure(outcome, "hull.ply");
  EXPECT_EQ(read_file(capture_ / "hull.ply"), hull);
  EXPECT_EQ(read_file(capture_ / "capture.json"), state);
  for (const auto& entry : fs::recursive_directory_iterator(capture_))
    EXPECT_THAT(entry.path().filename().string(), Not(HasSubstr(".part"))) << "half-written files are removed";
}

TEST_F(ProgramTest, KilledAtAnyTimeItGoesOn) {
  // The files themselves are whole, masks that were keyed are not taken for drawn ones, and the next run ends and takes
  // away what the killed ones had half written.
  for (const double seconds : {0.02, 0.05, 0.1, 0.2, 0.4}) {
    const Outcome killed = lumihull({"run", capture(), "-q", "--resolution", "96"}, {.kill_after_s = seconds});
    if (killed.status == 0) break;
    EXPECT_EQ(killed.status, 128 + SIGKILL);
    ASSERT_NO_THROW(Capture::open(capture_)) << "after " << seconds << " s";
    if (fs::exists(capture_ / "hull.ply")) {
      EXPECT_NO_THROW(hull::read_mesh(capture_ / "hull.ply"));
    }
  }
  const Outcome end = lumihull({"run", capture(), "-q", "--resolution", "96"});
  ASSERT_EQ(end.status, 0) << end.err;
  const Capture c = Capture::open(capture_);
  for (const Shot& shot : c.shots) EXPECT_EQ(c.mask_state(shot), MaskSource::keyed) << shot.name;
  for (const auto& entry : fs::recursive_directory_iterator(capture_))
    EXPECT_THAT(entry.path().filename().string(), Not(HasSubstr(".part")));
}

TEST_F(ProgramTest, CtrlCStopsCleanly) {
  const Outcome outcome =
      lumihull({"run", capture(), "-q", "--resolution", "512"}, {.kill_after_s = 0.3, .signal = SIGINT});
  EXPECT_EQ(outcome.status, 130) << outcome.err;
  EXPECT_NO_THROW(Capture::open(capture_));
}

TEST_F(ProgramTest, AMaskThatAPersonDrewWins) {
  ASSERT_EQ(lumihull({"key", capture(), "-q"}).status, 0);
  Capture c = Capture::open(capture_);
  Image mask = c.read_mask(3);
  for (int y = 0; y < 20; ++y) std::fill_n(mask.row<std::uint8_t>(y), 20, std::uint8_t(255));
  write_png(c.mask_path(c.shots[3]), mask);
  const std::string drawn = read_file(c.mask_path(c.shots[3]));
  ASSERT_EQ(lumihull({"key", capture(), "-q", "--k", "5"}).status, 0);
  EXPECT_EQ(read_file(c.mask_path(c.shots[3])), drawn);
}

TEST_F(ProgramTest, AHullThatVanishesNamesThePhotograph) {
  ASSERT_EQ(lumihull({"key", capture(), "-q"}).status, 0);
  // One photograph's mask is that of something else: everything is carved away by it.
  Capture c = Capture::open(capture_);
  Image wrong(c.cameras[0].width, c.cameras[0].height, 1);
  for (int y = 0; y < 12; ++y) std::fill_n(wrong.row<std::uint8_t>(y), 12, std::uint8_t(255));
  write_png(c.mask_path(c.shots[4]), wrong);
  expect_failure(lumihull({"hull", capture(), "-q", "--resolution", "64"}), c.shots[4].name);
}

TEST_F(ProgramTest, EmptyAndFullMasksAreLeftOutAndNamed) {
  ASSERT_EQ(lumihull({"key", capture(), "-q"}).status, 0);
  Capture c = Capture::open(capture_);
  Image full(c.cameras[0].width, c.cameras[0].height, 1);
  std::fill_n(full.row<std::uint8_t>(0), full.bytes(), std::uint8_t(255));
  write_png(c.mask_path(c.shots[4]), Image(full.width(), full.height(), 1));
  write_png(c.mask_path(c.shots[5]), full);
  const Outcome outcome = lumihull({"hull", capture(), "-q", "--resolution", "64"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr(c.shots[4].name));
  EXPECT_THAT(outcome.out, HasSubstr(c.shots[5].name));
}

TEST_F(ProgramTest, ACameraInsideTheObjectIsNamed) {
  ASSERT_EQ(lumihull({"run", capture(), "-q", "--resolution", "48"}).status, 0);
  Capture c = Capture::open(capture_);
  const hull::Mesh mesh = hull::read_mesh(c.hull_path());
  // A point inside: half way between the first two crossings of a ray towards the object.
  const hull::RayScene scene(mesh);
  const Eigen::Vector3f toward = Eigen::Vector3f(0.011f, 0.013f, 0.25f), from(2, 1.5f, 0.9f);
  const hull::Hit in = scene.hit({from, toward - from});
  ASSERT_TRUE(in);
  const hull::Hit out = scene.hit({from, toward - from, in.t * 1.0001f});
  ASSERT_TRUE(out);
  const Eigen::Vector3d middle = (from + 0.5f * (in.t + out.t) * (toward - from)).cast<double>();
  Image full(c.cameras[0].width, c.cameras[0].height, 1);
  for (int y = 0; y < full.height(); ++y)
    std::fill_n(full.row<std::uint8_t>(y) + 1, full.width() - 1, std::uint8_t(255));
  c.shots[7].cam_from_world->translation = -(c.shots[7].cam_from_world->rotation * middle);
  c.write_mask(7, full, MaskSource::imported);
  c.save();
  const Outcome outcome = lumihull({"hull", capture(), "-q", "--resolution", "48"});
  expect_failure(outcome, c.shots[7].name);
  EXPECT_THAT(outcome.err, HasSubstr("inside"));
}

TEST_F(ProgramTest, ImportsPlainPhotographsMasksAndTheEnclosure) {
  std::vector<std::string> command{"import", "photos"};
  for (const auto& entry : fs::directory_iterator(capture_ / "photos")) command.push_back(entry.path());
  command.insert(command.end(), {"-o", mine_ / "p", "--json", "-q"});
  const Outcome import = lumihull(command);
  ASSERT_EQ(import.status, 0) << import.err;
  EXPECT_EQ(nlohmann::json::parse(import.out)["photos"], 18);
  EXPECT_EQ(lumihull(command).status, 2) << "the folder is in use";

  command = {"import", "enclosure", "--into", mine_ / "p"};
  for (const auto& entry : fs::directory_iterator(capture_ / "enclosure")) command.push_back(entry.path());
  ASSERT_EQ(lumihull(command).status, 0);
  EXPECT_EQ(Capture::open(mine_ / "p").enclosure.size(), 3u);
  ASSERT_EQ(lumihull({"key", mine_ / "p", "-q"}).status, 0) << "keying needs no poses";

  ASSERT_EQ(lumihull({"import", "masks", mine_ / "p" / "masks", "--into", capture()}).status, 0);
  const Capture c = Capture::open(capture_);
  EXPECT_EQ(c.mask_state(c.shots[0]), MaskSource::imported);
  expect_failure(lumihull({"hull", mine_ / "p", "-q"}), "pose");
}

}  // namespace
}  // namespace lumihull
