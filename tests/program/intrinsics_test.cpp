// lumihull intrinsics: photographs of a chessboard, the camera that comes of them, and what goes wrong.
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/calib/lens_calibration.h>
#include <lumihull/rig/flat_print.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using test::lumihull;
using testing::HasSubstr;

constexpr int kPhotos = 8;
const std::string kBoard = "chessboard:7x5:25mm";

Camera true_camera() {
  Camera camera{.width = 400, .height = 300, .f = 350, .u0 = 203, .v0 = 148};
  camera.k1 = .08;
  return camera;
}

/// A chessboard from all sides, in a picture of a camera's size.
Image photograph(const Camera& camera, int i) {
  const calib::TargetSet set = calib::TargetSet::from_word(kBoard);
  const rig::FlatPrint print = rig::print_of(set.grids[0], {.03f, .03f, .03f}, {.8f, .8f, .8f});
  const Eigen::Vector3d middle(.075, .05, 0);
  const double angle = 2 * M_PI * i / kPhotos;
  const Eigen::Vector3d eye = middle + Eigen::Vector3d(.12 * std::cos(angle), .12 * std::sin(angle), -.2);
  const View view{camera, look_at(eye, middle, {0, -1, 0})};
  return rig::photograph_prints(view, std::span(&print, 1), {.3f, .3f, .3f}, {.blur_px = .7, .noise_read = .005},
                                std::uint64_t(i));
}

class IntrinsicsVerb : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder();
    for (int i = 0; i < kPhotos; ++i) write_png(photo(i), photograph(true_camera(), i));
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string photo(int i) { return (*folder_ / ("p" + std::to_string(i) + ".png")).string(); }
  static std::vector<std::string> command(int photos = kPhotos) {
    std::vector<std::string> words{"intrinsics", "--targets", kBoard};
    for (int i = 0; i < photos; ++i) words.push_back(photo(i));
    return words;
  }
  std::string mine(const std::string& name) const { return (mine_ / name).string(); }
  static inline test::TemporaryFolder* folder_ = nullptr;
  test::TemporaryFolder mine_;
};

std::vector<std::string> with(std::vector<std::string> command, const std::vector<std::string>& more) {
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

TEST_F(IntrinsicsVerb, SaysAndWritesTheCamera) {
  const auto run = lumihull(
      with(command(), {"--json", "--quiet", "-o", mine("camera.json"), "--opencv", mine("camera.yml"), "--colmap",
                       mine("cameras.txt"), "--report", mine("lens.html"), "--draw", mine("drawn")}));
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.out, read_file(mine("camera.json")));
  const auto json = nlohmann::json::parse(run.out);
  const Camera truth = true_camera();
  const calib::LensCalibration found = calib::load_intrinsics(mine("camera.json"));
  EXPECT_NEAR(found.camera.f, truth.f, std::max(.05, 4 * std::sqrt(found.covariance(0, 0))));
  EXPECT_NEAR(found.camera.f, truth.f, .5);
  EXPECT_NEAR(found.camera.u0, truth.u0, .5);
  EXPECT_NEAR(found.camera.k1, truth.k1, .01);
  EXPECT_EQ(found.camera.width, 400);
  EXPECT_EQ(json["measured"]["views"], kPhotos);
  EXPECT_EQ(json["measured"]["points"].get<int>() + json["measured"]["outliers"].get<int>(), kPhotos * 35);
  EXPECT_LT(json["measured"]["rms_px"].get<double>(), .05);
  EXPECT_THAT(run.err, HasSubstr("targets in 8 of 8 photographs"));

  // OpenCV counts pixels from the first one's centre, COLMAP as we do.
  const std::string opencv = read_file(mine("camera.yml")), colmap = read_file(mine("cameras.txt"));
  double fx = 0, cx = 0, fy = 0, cy = 0;
  const std::size_t matrix = opencv.find("data:", opencv.find("camera_matrix"));
  ASSERT_NE(matrix, std::string::npos) << opencv;
  ASSERT_EQ(std::sscanf(opencv.c_str() + matrix, "data: [%lf, %*f, %lf, %*f, %lf, %lf", &fx, &cx, &fy, &cy), 4)
      << opencv;
  EXPECT_NEAR(fx, truth.f, .7);
  EXPECT_NEAR(fy, truth.f, .7);
  EXPECT_NEAR(cx + .5, truth.u0, .7);
  EXPECT_NEAR(cy + .5, truth.v0, .7);
  int width = 0, height = 0;
  char model[32] = "";
  const std::size_t line = colmap.find("\n1 ") + 1;
  ASSERT_EQ(
      std::sscanf(colmap.c_str() + line, "1 %31s %d %d %lf %lf %lf %lf", model, &width, &height, &fx, &fy, &cx, &cy), 7)
      << colmap;
  EXPECT_THAT(model, HasSubstr("OPENCV"));
  EXPECT_EQ(width, 400);
  EXPECT_NEAR(fx, truth.f, .7);
  EXPECT_NEAR(cx, truth.u0, .7);

  // The page needs nothing but itself.
  const std::string page = read_file(mine("lens.html"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_EQ(page.find("src="), std::string::npos);
  EXPECT_EQ(page.find("href="), std::string::npos);
  for (int i = 0; i < kPhotos; ++i) {
    const Image drawn = read_image(mine("drawn/p" + std::to_string(i) + ".png")), plain = read_image(photo(i));
    ASSERT_EQ(drawn.width(), 400);
    ASSERT_EQ(drawn.channels(), 3);
    int green = 0;
    for (int y = 0; y < 300; ++y)
      for (int x = 0; x < 400; ++x) {
        const std::uint8_t* p = drawn.row<std::uint8_t>(y) + 3 * x;
        green += p[1] > p[0] + 80 && p[1] > p[2] + 80;
      }
    EXPECT_GT(green, 35 * 8) << i;
  }
}

TEST_F(IntrinsicsVerb, TheSameForAnyNumberOfThreads) {
  std::string first;
  for (const char* threads : {"1", "3"}) {
    const auto run = lumihull(with(command(), {"--json", "--quiet", "-o", mine("camera.json"), "--threads", threads}));
    ASSERT_EQ(run.status, 0) << run.err;
    if (first.empty()) first = run.out;
    EXPECT_EQ(run.out, first);
  }
}

TEST_F(IntrinsicsVerb, ChoosesWhatIsEstimatedAndStartsFromACamera) {
  ASSERT_EQ(lumihull(with(command(), {"--quiet", "-o", mine("a.json")})).status, 0);
  const auto run =
      lumihull(with(command(), {"--quiet", "-o", mine("b.json"), "--free", "f,u0,v0", "--start", mine("a.json")}));
  ASSERT_EQ(run.status, 0) << run.err;
  const auto a = calib::load_intrinsics(mine("a.json")), b = calib::load_intrinsics(mine("b.json"));
  EXPECT_EQ(a.camera.k1, b.camera.k1);
  EXPECT_EQ(b.covariance(5, 5), 0);
  EXPECT_GT(b.covariance(0, 0), 0);
  EXPECT_THAT(run.out, HasSubstr("(fixed)"));
}

TEST_F(IntrinsicsVerb, DrawingsReplaceNothing) {
  // A folder of its own in which a photograph has another one's name.
  fs::create_directories(mine("more"));
  fs::copy_file(photo(7), mine("more/p0.png"));
  auto words = command(7);
  words.push_back(mine("more/p0.png"));
  ASSERT_EQ(lumihull(with(words, {"--quiet", "-o", mine("camera.json"), "--draw", mine("drawn")})).status, 0);
  EXPECT_TRUE(fs::exists(mine("drawn/p0.png")));
  EXPECT_TRUE(fs::exists(mine("drawn/p0-2.png")));
  const std::string before = read_file(mine("more/p0.png"));
  const auto onto = lumihull(with(words, {"--quiet", "-o", mine("other.json"), "--draw", mine("more")}));
  EXPECT_EQ(onto.status, 2) << onto.err;
  EXPECT_THAT(onto.err, HasSubstr("would replace the photograph"));
  EXPECT_EQ(read_file(mine("more/p0.png")), before);
  EXPECT_FALSE(fs::exists(mine("other.json")));
}

TEST_F(IntrinsicsVerb, SaysWhatIsWrongAndWritesNothing) {
  const auto refused = [&](std::vector<std::string> words, int status, const std::vector<std::string>& said) {
    SCOPED_TRACE(said[0]);
    const auto run =
        lumihull(with(std::move(words), {"--quiet", "-o", mine("camera.json"), "--report", mine("lens.html")}));
    EXPECT_EQ(run.status, status) << run.err;
    for (const std::string& text : said) EXPECT_THAT(run.err, HasSubstr(text));
    EXPECT_FALSE(fs::exists(mine("camera.json")));
    EXPECT_FALSE(fs::exists(mine("lens.html")));
  };
  Camera smaller = true_camera();
  smaller.width = 380;
  write_png(mine("small.png"), photograph(smaller, 0));
  refused(with(command(), {mine("small.png")}), 1, {"small.png", "380 x 300", "400 x 300"});

  std::vector<std::string> none{"intrinsics", "--targets", "chessboard:9x6:25mm"};
  for (int i = 0; i < 4; ++i) none.push_back(photo(i));
  refused(none, 1, {"no photograph shows the targets", "inner corners"});

  write_file(mine("words.png"), "no picture");
  refused(with(command(), {mine("words.png")}), 1, {"words.png"});
  refused(with(command(), {mine("absent.png")}), 1, {"absent.png"});
  refused(command(1), 1, {"view"});

  write_file(mine("board.json"), R"({"format": "lumihull-targets", "version": 1,
    "designs": [{"family": "matrix5x5", "size_m": 0.018}],
    "boards": [{"name": "box", "targets": [
      {"design": 0, "id": 3, "board_from_target": {"q": [1, 0, 0, 0], "t": [0, 0, 0]}},
      {"design": 0, "id": 3, "board_from_target": {"q": [1, 0, 0, 0], "t": [0.2, 0, 0]}}]}]})");
  refused({"intrinsics", photo(0), "--targets", mine("board.json")}, 1, {"board.json", "/boards/0/targets/1"});

  refused(with(command(), {"--free", "f,u0,k9"}), 2, {"k9", "p2"});
  refused(with(command(), {"--outlier-sigma", "-1"}), 2, {"outlier"});
  refused(with(command(), {"--start", mine("absent.json")}), 1, {"absent.json"});
  EXPECT_EQ(lumihull({"intrinsics", photo(0)}).status, 2) << "no targets named";
  EXPECT_EQ(lumihull({"intrinsics", "--targets", kBoard}).status, 2) << "no photographs";
}

TEST_F(IntrinsicsVerb, RealChessboards) {
  LUMIHULL_NEED_REAL_DATA(data, "chessboards");
  std::vector<std::string> words{"intrinsics", "--targets", "chessboard:9x6:25mm", "--json",
                                 "--quiet",    "-o",        mine("camera.json")};
  std::vector<std::string> photos;
  for (const auto& entry : fs::directory_iterator(data))
    if (entry.path().filename().string().starts_with("left")) photos.push_back(entry.path().string());
  std::sort(photos.begin(), photos.end());
  ASSERT_GE(photos.size(), 10u);
  const auto run = lumihull(with(words, photos));
  ASSERT_EQ(run.status, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json["measured"]["views"], photos.size());
  EXPECT_NEAR(json["camera"]["f"].get<double>(), 533.4, 1.5);  // OpenCV's and mrcal's, from the same corners
  EXPECT_LT(json["measured"]["rms_px"].get<double>(), .2);
}

}  // namespace
}  // namespace lumihull
