// lumihull detect: photographs of a printed square, what is said of them, and what goes wrong.
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/rig/flat_print.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using test::lumihull;
using testing::HasSubstr;

class DetectTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder();
    const calib::TargetSet set = calib::TargetSet::from_word("aruco:6x6_250:40mm");
    for (int i = 0; i < 3; ++i) {
      View view;
      view.camera = {.width = 400, .height = 300, .f = 500, .u0 = 200, .v0 = 150};
      view.cam_from_world = look_at({.03 * i, .02, -.15}, {0, 0, 0}, {0, -1, 0});
      const rig::FlatPrint print = rig::print_of(set.designs[0], 20 + i);
      const Image photo = rig::photograph_prints(view, std::span(&print, 1), {.3f, .3f, .3f},
                                                 {.blur_px = .8, .noise_read = .005}, std::uint64_t(i));
      write_png(*folder_ / ("p" + std::to_string(i) + ".png"), photo);
    }
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string photo(int i) { return (*folder_ / ("p" + std::to_string(i) + ".png")).string(); }
  static inline test::TemporaryFolder* folder_ = nullptr;
  test::TemporaryFolder mine_;
};

TEST_F(DetectTest, SaysWhatItFinds) {
  const auto outcome = lumihull({"detect", photo(0), photo(1), photo(2), "--targets", "aruco:6x6_250:40mm", "--draw",
                                 (mine_ / "drawn").string(), "--json", "--quiet"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["targets"], 3);
  EXPECT_EQ(json["features"], 12);
  for (int i = 0; i < 3; ++i) {
    const auto& one = json["photos"][std::size_t(i)];
    EXPECT_EQ(one["width"], 400);
    ASSERT_EQ(one["targets"].size(), 1u);
    EXPECT_EQ(one["targets"][0]["id"], 20 + i);
    EXPECT_EQ(one["targets"][0]["family"], "aruco:6x6_250");
    EXPECT_EQ(one["targets"][0]["features"].size(), 4u);
    EXPECT_GT(one["targets"][0]["features"][0]["covariance"][0], 0.0);
    EXPECT_EQ(one["refused"]["duplicate"], 0);
    const Image drawn = read_image(mine_ / ("drawn/p" + std::to_string(i) + ".png"));
    EXPECT_EQ(drawn.width(), 400);
    EXPECT_EQ(drawn.channels(), 3);
  }
  EXPECT_THAT(outcome.err, HasSubstr("3 targets, 12 points in 3 photographs"));
}

TEST_F(DetectTest, TheSameForAnyNumberOfThreads) {
  const std::vector<std::string> command{"detect", photo(0), photo(1), "--targets", "aruco:6x6_250:40mm", "--json", "--quiet",
                                         "--threads"};
  std::string first;
  for (const char* threads : {"1", "2", "5"}) {
    std::vector<std::string> now = command;
    now.push_back(threads);
    const auto outcome = lumihull(now);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    if (first.empty()) first = outcome.out;
    EXPECT_EQ(outcome.out, first);
  }
}

TEST_F(DetectTest, SaysWhatIsWrong) {
  const auto unknown = lumihull({"detect", photo(0), "--targets", "aruco:9x9_1:40mm"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.err, HasSubstr("9x9_1"));
  const auto missing = lumihull({"detect", (mine_ / "none.png").string(), "--targets", "matrix5x5:18mm"});
  EXPECT_EQ(missing.status, 1);
  EXPECT_THAT(missing.err, HasSubstr("none.png"));
  write_file(mine_ / "broken.png", "no picture");
  const auto broken = lumihull({"detect", photo(0), (mine_ / "broken.png").string(), "--targets", "matrix5x5:18mm"});
  EXPECT_EQ(broken.status, 1);
  EXPECT_THAT(broken.err, HasSubstr("broken.png"));
  EXPECT_EQ(lumihull({"detect", photo(0)}).status, 2) << "no targets named";
  const auto onto = lumihull({"detect", photo(0), "--targets", "matrix5x5:18mm", "--draw", fs::path(photo(0)).parent_path().string()});
  EXPECT_EQ(onto.status, 2) << onto.err;
}

}  // namespace
}  // namespace lumihull
