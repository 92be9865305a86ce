// lumihull repeatability, stability: from poses and films that were made up.
#include <lumihull/base/capture.h>
#include <lumihull/base/image.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

using test::lumihull;
using testing::HasSubstr;

constexpr int kWidth = 240, kHeight = 180;

/// A light disc of 80 px on a dark ground, its edge as wide as a lens makes it; `inverse`: dark on light.
Image disc(double x, double y, bool inverse) {
  Image image(kWidth, kHeight, 3);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const double out = std::hypot(column + .5 - x, row + .5 - y) - 40;
      const double inside = 0.5 * std::erfc(out / (0.8 * std::sqrt(2.0)));
      const double light = 0.05 + 0.6 * (inverse ? 1 - inside : inside);
      const double srgb = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
      for (int c = 0; c < 3; ++c) image.row<std::uint8_t>(row)[3 * column + c] = std::uint8_t(255 * srgb + 0.5);
    }
  return image;
}

class ExperimentVerbs : public testing::Test {
 protected:
  std::string mine(const std::string& name) const { return (mine_ / name).string(); }
  test::TemporaryFolder mine_;
};

TEST_F(ExperimentVerbs, StabilityIsThatOfTheBallsSwing) {
  // 12 px e^(-t / 0.8 s): within half a pixel after 0.8 ln 24 = 2.54 s; a swing of 0.8 s, seen 10 times a second.
  constexpr double kFps = 10;
  std::vector<std::string> words{"stability", "--fps", "10",    "--json",     "--quiet",
                                 "--rest",    "1",     "--svg", mine("s.svg")};
  std::vector<double> swing;
  for (int i = 0; i < 50; ++i) {
    const double t = i / kFps;
    swing.push_back(12 * std::exp(-t / 0.8) * std::cos(2 * std::acos(-1.0) * t / 0.8));
    const std::string file = mine("f" + std::to_string(100 + i) + ".png");
    write_png(file, disc(118.3 + swing.back(), 90.7 - 0.5 * swing.back(), false));
    words.push_back(file);
  }
  auto run = lumihull(words);
  ASSERT_EQ(run.status, 0) << run.err;
  const auto found = nlohmann::json::parse(run.out);
  double worst = 0;
  for (std::size_t i = 0; i < swing.size(); ++i)
    worst = std::max(worst, std::hypot(found["offset_px"][i][0].get<double>() - swing[i],
                                       found["offset_px"][i][1].get<double>() + 0.5 * swing[i]));
  EXPECT_LT(worst, 0.1);  // the mean of the rest is 0.05 px off, for the swing goes on
  double settled = 0;
  for (std::size_t i = 0; i < swing.size(); ++i)
    if (std::abs(swing[i]) * std::sqrt(1.25) > 0.5) settled = double(i + 1) / kFps;
  EXPECT_NEAR(found["settle_s"].get<double>(), settled, 0.11);
  EXPECT_TRUE(std::filesystem::exists(mine("s.svg")));
  EXPECT_THAT(run.err, HasSubstr("ball of 80."));

  // A dark ball before a light ground; pictures without one are told; a film without any is an error.
  words = {"stability", "--json", "--quiet", "--rest", "1"};
  for (int i = 0; i < 6; ++i) {
    write_png(mine("d" + std::to_string(i) + ".png"), i == 3 ? Image(kWidth, kHeight, 3) : disc(120, 90, true));
    words.push_back(mine("d" + std::to_string(i) + ".png"));
  }
  run = lumihull(words);
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(nlohmann::json::parse(run.out)["time_s"].size(), 5u);
  EXPECT_THAT(run.err, HasSubstr("not found in 1 pictures"));
  run = lumihull({"stability", mine("d3.png"), mine("d3.png")});
  EXPECT_EQ(run.status, 1);
  EXPECT_THAT(run.err, HasSubstr("no ball was found"));
  EXPECT_EQ(lumihull({"stability", mine("d0.png"), "--ball", "1,2"}).status, 2);
}

TEST_F(ExperimentVerbs, RepeatabilityReadsACalibratedCapture) {
  Capture capture = Capture::create(mine("c"));
  capture.cameras.assign(1, {.width = 64, .height = 48, .f = 80, .u0 = 32, .v0 = 24});
  capture.unit = Unit::metres;
  std::filesystem::create_directories(mine("c/photos"));
  write_png(mine("c/photos/one.png"), Image(64, 48, 3));
  for (int i = 0; i < 6; ++i) {
    const std::size_t shot = capture.add_shot("v" + std::to_string(i), "photos/one.png", 0);
    CommandedShot& commanded = capture.shots[shot].commanded.emplace();
    commanded.stop = "p" + std::to_string(i % 2) + "-v" + std::to_string(i / 2);
    commanded.device = "main";
    commanded.state = "done";
    commanded.cam_from_world.translation.x() = i % 2;
    capture.shots[shot].cam_from_world = commanded.cam_from_world;
    capture.shots[shot].cam_from_world->translation.y() = 1e-3 * (i / 2 - 1);  // -1, 0, 1 mm
  }
  capture.save();
  const auto run = lumihull({"repeatability", mine("c"), "--json", "--svg", mine("r.svg")});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto found = nlohmann::json::parse(run.out);
  EXPECT_EQ(found["places"].size(), 2u);
  EXPECT_NEAR(found["largest_distance_m"].get<double>(), 1e-3, 1e-9);
  EXPECT_THAT(run.err, HasSubstr("p1-v0: 3 visits, within 1.00 mm and 0.000°"));
  EXPECT_TRUE(std::filesystem::exists(mine("c/repeatability.html")));
  EXPECT_TRUE(std::filesystem::exists(mine("r.svg")));
  capture.unit = Unit::unknown;
  capture.save();
  EXPECT_THAT(lumihull({"repeatability", mine("c")}).err, HasSubstr("no scale"));
}

}  // namespace
}  // namespace lumihull
