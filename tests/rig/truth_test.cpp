// What a renderer is judged by: captures with test views, highlights, plain materials.

#include <lumihull/base/files.h>
#include <lumihull/rig/rig_capture.h>
#include <lumihull/slf/camera_path.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

RigOptions small() {
  RigOptions o;
  o.object = "pebble";
  o.photos = 4, o.empty_photos = 0;
  o.width = 150;
  o.light = test::coarse_light();
  o.format = PhotoFormat::png;
  o.photo.full_well = 0;
  return o;
}

nlohmann::json highlights(const fs::path& file) {
  const auto json = nlohmann::json::parse(read_file(file));
  EXPECT_EQ(json.at("format"), "lumihull-highlights");
  EXPECT_EQ(json.at("version"), 1);
  return json.at("shots");
}

Vector3d point_of(const nlohmann::json& highlight) {
  const auto p = highlight.at("point").get<std::vector<double>>();
  return Vector3d(p.at(0), p.at(1), p.at(2));
}

Vector2d pixel_of(const nlohmann::json& highlight) {
  const auto p = highlight.at("pixel").get<std::vector<double>>();
  return Vector2d(p.at(0), p.at(1));
}

/// Linear light of the brightest channel at a pixel.
double light(const Image& picture, const Vector2d& pixel) {
  const std::uint8_t* p = picture.row<std::uint8_t>(int(pixel.y())) + 3 * int(pixel.x());
  return linear_from_srgb(float(*std::max_element(p, p + 3)) / 255);
}

TEST(Truth, HighlightsBelongToTheShots) {
  const test::TemporaryFolder folder;
  Job job;
  RigOptions o = small();
  o.photo.exposure = .5;
  make_capture(folder / "glossy", o, job);
  o.matt = true;
  make_capture(folder / "matt", o, job);
  EXPECT_FALSE(fs::exists(folder / "matt" / "truth" / "highlights.json"));
  const Capture glossy = Capture::open(folder / "glossy"), matt = Capture::open(folder / "matt");
  const auto shots = highlights(folder / "glossy" / "truth" / "highlights.json");
  ASSERT_EQ(shots.size(), 4u);
  int strong = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(shots[i].at("name"), glossy.shots[i].name);
    const Image with = glossy.read_photo(i), without = matt.read_photo(i);
    for (const auto& h : shots[i].at("highlights")) {
      const Vector2d pixel = pixel_of(h);
      EXPECT_LT((*glossy.view(i).project(point_of(h)) - pixel).norm(), 1e-9);
      const double strength = h.at("strength");
      EXPECT_LT(light(without, pixel), .45);  // no paint is brighter under these lamps
      if (light(with, pixel) > .98) continue;
      // The gloss, the room's reflection, and a little less paint.
      EXPECT_NEAR(light(with, pixel) - light(without, pixel), strength, .12 * strength + .05);
      strong += strength > .25;
    }
  }
  EXPECT_GE(strong, 3);
}

TEST(Truth, TestViewsAreACameraPathWithPicturesMasksAndHighlights) {
  const test::TemporaryFolder folder;
  Job job;
  RigOptions o = small();
  o.test_views = 9;
  o.photo.full_well = 500;  // a bad sensor: the test views have none of its noise
  o.photo.reduce = 3;
  const Capture capture = make_capture(folder / "c", o, job);
  EXPECT_EQ(capture.shots.size(), 4u);
  const fs::path truth = folder / "c" / "truth";
  const auto path = slf::read_camera_path(truth / "test_views.json");
  ASSERT_EQ(path.size(), 9u);
  const auto shots = highlights(truth / "test_highlights.json");
  ASSERT_EQ(shots.size(), 9u);

  RigOptions same = o;
  same.photo.full_well = 0, same.photo.reduce = 1;
  make_capture(folder / "same", same, job);

  double travelled = 0;
  Vector3d before = Vector3d::Zero();
  for (std::size_t i = 0; i < 9; ++i) {
    SCOPED_TRACE(path[i].name);
    EXPECT_EQ(path[i].name, "test_000" + std::to_string(i + 1));
    EXPECT_EQ(shots[i].at("name"), path[i].name);
    EXPECT_EQ(path[i].view.camera.k1, capture.cameras[0].k1);
    const fs::path picture = "test_views/" + path[i].name + ".png";
    EXPECT_EQ(read_file(truth / picture), read_file(folder / "same" / "truth" / picture));
    const Image mask = read_image(truth / "test_views" / "masks" / (path[i].name + ".png"));
    ASSERT_EQ(mask.width(), 150);
    ASSERT_EQ(read_image(truth / picture).width(), 150);
    // The brightest lamp's highlight is there all along the path, on the object, and moves in small steps.
    ASSERT_FALSE(shots[i].at("highlights").empty());
    const auto first = shots[i].at("highlights")[0];
    EXPECT_EQ(first.at("lamp"), 0);
    const Vector3d point = point_of(first);
    const Vector2d pixel = pixel_of(first);
    EXPECT_LT((*path[i].view.project(point) - pixel).norm(), 1e-6);
    EXPECT_EQ(mask.row<std::uint8_t>(int(pixel.y()))[int(pixel.x())], 255);
    if (i > 0) {
      EXPECT_GT((point - before).norm(), .005);
      EXPECT_LT((point - before).norm(), .12);
      travelled += (point - before).norm();
    }
    before = point;
  }
  EXPECT_GT(travelled, .25);  // of an object of 0.6 m
}

TEST(Truth, AnUnlitObjectHasOneColorOnly) {
  const test::TemporaryFolder folder;
  Job job;
  int n = 0;
  for (const double exposure : {.4, 1., 3.})
    for (const std::array<std::uint8_t, 3> color : {std::array<std::uint8_t, 3>{200, 120, 60}, {255, 1, 0}}) {
      SCOPED_TRACE(exposure);
      RigOptions o = small();
      o.object = n % 2 ? "vase" : "pebble";
      o.photos = 2, o.width = 90;
      o.unlit = color;
      o.photo.exposure = exposure;
      const fs::path to = folder / std::to_string(n++);
      const Capture capture = make_capture(to, o, job);
      EXPECT_FALSE(fs::exists(to / "truth" / "highlights.json"));
      for (std::size_t i = 0; i < 2; ++i) {
        const Image photo = capture.read_photo(i);
        const Image mask = read_image(to / "truth" / "masks" / (capture.shots[i].name + ".png"));
        std::size_t inside = 0, wrong = 0;
        for (int y = 0; y < mask.height(); ++y)
          for (int x = 0; x < mask.width(); ++x) {
            if (mask.row<std::uint8_t>(y)[x] != 255) continue;
            ++inside;
            wrong += !std::equal(color.begin(), color.end(), photo.row<std::uint8_t>(y) + 3 * x);
          }
        EXPECT_GT(inside, 300u);
        EXPECT_EQ(wrong, 0u);
      }
    }
}

TEST(Truth, AUniformMattObjectShowsItsLightAlone) {
  const test::TemporaryFolder folder;
  Job job;
  RigOptions o = small();
  o.photos = 1;
  o.matt = true;
  const auto chroma_spread = [&](const char* name) {
    const Capture capture = make_capture(folder / name, o, job);
    const Image photo = capture.read_photo(0);
    const Image mask = read_image(folder / name / "truth" / "masks" / (capture.shots[0].name + ".png"));
    double low = 1e9, high = 0;
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x) {
        if (mask.row<std::uint8_t>(y)[x] != 255) continue;
        const std::uint8_t* p = photo.row<std::uint8_t>(y) + 3 * x;
        const double ratio = linear_from_srgb(float(p[0]) / 255) / linear_from_srgb(float(p[2]) / 255);
        low = std::min(low, ratio), high = std::max(high, ratio);
      }
    return high / low;
  };
  // Red to blue: the islands' paint differs from the ground's by a factor above four, the lamps by a few percent.
  EXPECT_GT(chroma_spread("painted"), 3);
  o.uniform = true;
  EXPECT_LT(chroma_spread("uniform"), 2);
}

}  // namespace
}  // namespace lumihull::rig
