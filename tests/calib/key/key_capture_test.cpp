// The stage `key` on a small capture with known silhouettes, and on real photographs.
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>
#include <lumihull/hull/auto_key.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "support.h"

namespace lumihull::hull {
namespace {

namespace fs = std::filesystem;
using test::expect_error;

constexpr int kWidth = 200, kHeight = 160;

/// A red ball with a dark and a white patch on a green table, seen from a ring of cameras. Truth: the ball's outline.
struct Scene {
  View view(int i, int n) const {
    View v;
    v.camera.width = kWidth, v.camera.height = kHeight;
    v.camera.f = 220, v.camera.u0 = kWidth / 2.0, v.camera.v0 = kHeight / 2.0;
    const double a = 2 * M_PI * i / n;
    v.cam_from_world = look_at({4 * std::cos(a), 4 * std::sin(a), 1.5 + 0.7 * std::sin(3 * a)}, {0, 0, 0}, {0, 0, 1});
    return v;
  }

  /// photo and truth (255 = ball); without the ball: the empty enclosure.
  std::pair<Image, Image> render(const View& v, bool ball, std::uint32_t seed) const {
    Image photo(kWidth, kHeight, 3), truth(kWidth, kHeight, 1);
    std::mt19937 random(seed);
    const Eigen::Vector3d eye = v.center();
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d d =
            v.cam_from_world.rotation.conjugate() * v.camera.ray({x + 0.5, y + 0.5})->normalized();
        const double b = eye.dot(d), disc = b * b - eye.squaredNorm() + 0.64;
        double color[3] = {50, 150, 70};
        const double light = 0.75 + 0.25 * std::sin(0.01 * x + 0.02 * y + v.center().x());
        for (double& c : color) c *= light;
        if (ball && disc > 0) {
          const Eigen::Vector3d p = eye + (-b - std::sqrt(disc)) * d;
          const double shade = 0.4 + 0.6 * std::clamp(p.normalized().dot(Eigen::Vector3d(0.3, 0.5, 0.8)), 0.0, 1.0);
          const double red[3] = {210, 70, 50}, white[3] = {230, 225, 215}, dark[3] = {60, 40, 45};
          const double* albedo = p.x() > 0.55 ? white : p.y() > 0.5 ? dark : red;
          for (int c = 0; c < 3; ++c) color[c] = albedo[c] * shade;
          truth.row<std::uint8_t>(y)[x] = 255;
        }
        for (int c = 0; c < 3; ++c)
          photo.row<std::uint8_t>(y)[3 * x + c] =
              std::uint8_t(std::clamp(color[c] + double(random() % 9) - 4, 0.0, 255.0));
      }
    return {std::move(photo), std::move(truth)};
  }

  Capture capture(const fs::path& folder, int n, bool enclosure) const {
    Capture c = Capture::create(folder);
    fs::create_directories(folder / "photos");
    fs::create_directories(folder / "enclosure");
    c.cameras.push_back(view(0, n).camera);
    for (int i = 0; i < n; ++i) {
      Shot shot;
      shot.name = "p" + std::to_string(i);
      shot.file = "photos/p" + std::to_string(i) + ".png";
      shot.cam_from_world = view(i, n).cam_from_world;
      write_png(folder / shot.file, render(view(i, n), true, std::uint32_t(i)).first);
      c.shots.push_back(shot);
    }
    for (int i = 0; enclosure && i < 3; ++i) {
      Shot shot;
      shot.name = "e" + std::to_string(i);
      shot.file = "enclosure/e" + std::to_string(i) + ".png";
      write_png(folder / shot.file, render(view(4 * i + 1, n), false, std::uint32_t(100 + i)).first);
      c.enclosure.push_back(shot);
    }
    c.save();
    return c;
  }
};

double iou(const Image& a, const Image& b) {
  double both = 0, either = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) {
      const bool p = a.row<std::uint8_t>(y)[x] >= 128, q = b.row<std::uint8_t>(y)[x] >= 128;
      both += p && q, either += p || q;
    }
  return both / either;
}

double mean_iou(const Capture& c, const Scene& scene) {
  double sum = 0;
  const int n = int(c.shots.size());
  for (int i = 0; i < n; ++i)
    sum += iou(c.read_mask(std::size_t(i)), scene.render(scene.view(i, n), true, std::uint32_t(i)).second);
  return sum / n;
}

std::string all_masks(const Capture& c) {
  std::string bytes;
  for (const Shot& s : c.shots) bytes += read_file(c.mask_path(s));
  return bytes + read_file(c.folder() / "key.json");
}

TEST(KeyCapture, FindsTheBallFromEverySource) {
  test::TemporaryFolder folder;
  const Scene scene;
  Capture c = scene.capture(folder / "c", 12, true);
  Job job;
  KeyReport report = key_capture(c, {}, job);
  EXPECT_EQ(report.source, "enclosure");
  EXPECT_EQ(report.keyed, 12u);
  EXPECT_GT(mean_iou(c, scene), 0.985);
  ASSERT_TRUE(c.background_rgb.has_value());
  EXPECT_GT((*c.background_rgb)[1], (*c.background_rgb)[0] + 30);
  fs::copy_file(folder / "c" / "key.json", folder / "saved.json");
  for (std::size_t i = 0; i < c.shots.size(); ++i) EXPECT_EQ(c.mask_state(c.shots[i]), MaskSource::keyed);

  KeyOptions options;
  options.background = "photos";
  report = key_capture(c, options, job);
  EXPECT_EQ(report.source, "photos and cameras");
  EXPECT_GE(report.rounds, 1);
  EXPECT_GT(mean_iou(c, scene), 0.985);

  options.background = "regions";
  for (const Shot& s : c.shots) options.regions += s.name + ":0,0,200,25;" + s.name + ":0,135,200,25;";
  EXPECT_EQ(key_capture(c, options, job).source, "regions");
  EXPECT_GT(mean_iou(c, scene), 0.97);

  options = {};
  options.background = (folder / "saved.json").string();
  EXPECT_EQ(key_capture(c, options, job).source, "file");
  EXPECT_GT(mean_iou(c, scene), 0.985);

  for (Shot& s : c.shots) s.cam_from_world.reset();
  options.background = "photos";
  report = key_capture(c, options, job);
  EXPECT_EQ(report.source, "photos");
  EXPECT_EQ(report.rounds, 0);
  EXPECT_GT(mean_iou(c, scene), 0.95);
}

TEST(KeyCapture, ThePaperSModeIsTheKeyPixelByPixel) {
  test::TemporaryFolder folder;
  const Scene scene;
  Capture c = scene.capture(folder / "c", 4, true);
  Job job;
  KeyOptions options;
  options.clean = false;
  options.edges = calib::EdgeMode::hard;
  key_capture(c, options, job);
  const auto key = calib::ColorKey::load(folder / "c" / "key.json", job);
  for (std::size_t i = 0; i < 4; ++i) {
    const Image photo = c.read_photo(i), mask = c.read_mask(i);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const std::uint8_t* p = photo.row<std::uint8_t>(y) + 3 * x;
        ASSERT_EQ(mask.row<std::uint8_t>(y)[x], 2 * key.foreground_neighbours({p[0], p[1], p[2]}) > 7 ? 255 : 0);
      }
  }
}

TEST(KeyCapture, IsTheSameForAnyNumberOfThreads) {
  test::TemporaryFolder folder;
  const Scene scene;
  KeyOptions options;
  options.background = "photos";
  std::string first;
  for (const unsigned threads : {1u, 2u, 3u}) {
    Capture c = scene.capture(folder / ("c" + std::to_string(threads)), 8, false);
    Job job({}, threads);
    key_capture(c, options, job);
    if (threads == 1) first = all_masks(c);
    EXPECT_TRUE(all_masks(c) == first) << threads;
  }
}

TEST(KeyCapture, HeldOutPhotographsTrainNothing) {
  test::TemporaryFolder folder;
  const Scene scene;
  KeyOptions options;
  options.background = "photos";
  std::string keys[2];
  for (int changed = 0; changed < 2; ++changed) {
    Capture c = scene.capture(folder / ("c" + std::to_string(changed)), 9, false);
    c.set_hold_out(4);  // p0, p4, p8
    if (changed) {
      Image noise(kWidth, kHeight, 3);
      std::mt19937 random(1);
      for (std::size_t i = 0; i < noise.bytes(); ++i) noise.data()[i] = std::byte(random());
      write_png(c.photo_path(c.shots[4]), noise);
    }
    Job job;
    EXPECT_EQ(key_capture(c, options, job).keyed, 9u);
    keys[changed] = read_file(c.folder() / "key.json");
  }
  EXPECT_TRUE(keys[0] == keys[1]);
}

TEST(KeyCapture, LeavesAPersonsAndImportedMasksAlone) {
  test::TemporaryFolder folder;
  Capture c = Scene().capture(folder / "c", 4, true);
  Image drawn(kWidth, kHeight, 1);
  drawn.row<std::uint8_t>(5)[7] = 255;
  Job job;
  key_capture(c, {}, job);
  write_png(c.mask_path(c.shots[1]), drawn);
  c.write_mask(2, drawn, MaskSource::imported);
  const std::string edited = read_file(c.mask_path(c.shots[1])), imported = read_file(c.mask_path(c.shots[2]));
  const KeyReport report = key_capture(c, {}, job);
  EXPECT_EQ(report.kept, 2u);
  EXPECT_EQ(report.keyed, 2u);
  EXPECT_TRUE(read_file(c.mask_path(c.shots[1])) == edited);
  EXPECT_TRUE(read_file(c.mask_path(c.shots[2])) == imported);
}

TEST(KeyCapture, NamesWhatIsWrong) {
  test::TemporaryFolder folder;
  const Scene scene;
  Capture c = scene.capture(folder / "c", 4, true);
  Job job;
  // A photograph without object: a warning; all of them: an error.
  write_png(c.photo_path(c.shots[2]), scene.render(scene.view(2, 4), false, 5).first);
  const KeyReport report = key_capture(c, {}, job);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_THAT(report.warnings[0], testing::HasSubstr("p2"));
  for (int i = 0; i < 4; ++i)
    write_png(c.photo_path(c.shots[std::size_t(i)]), scene.render(scene.view(i, 4), false, 5).first);
  EXPECT_EQ(expect_error([&] { key_capture(c, {}, job); }).code(), ErrorCode::degenerate);

  const auto refused = [&](auto change) {
    KeyOptions options;
    change(options);
    return expect_error([&] { key_capture(c, options, job); });
  };
  EXPECT_EQ(refused([](KeyOptions& o) { o.k = 0; }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(refused([](KeyOptions& o) { o.max_samples = 1; }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(refused([](KeyOptions& o) { o.background = "regions"; }).code(), ErrorCode::invalid_argument);
  const auto regions = [&](const char* text) {
    return refused([&](KeyOptions& o) { o.background = "regions", o.regions = text; });
  };
  EXPECT_EQ(regions("nobody:0,0,5,5").subject(), "nobody");
  EXPECT_EQ(regions("p1:190,0,11,5").subject(), "p1");
  EXPECT_EQ(regions("p1:2147483647,0,2147483647,5").subject(), "p1");
  EXPECT_EQ(refused([](KeyOptions& o) { o.background = "/nowhere/key.json"; }).code(), ErrorCode::not_found);
  write_file(c.photo_path(c.shots[3]), "not a picture");
  EXPECT_THAT(expect_error([&] { key_capture(c, {}, job); }).what(), testing::HasSubstr("p3"));
  c.enclosure.clear();
  EXPECT_EQ(refused([](KeyOptions& o) { o.background = "enclosure"; }).code(), ErrorCode::not_found);
  job.cancel();
  EXPECT_EQ(expect_error([&] { key_capture(c, {}, job); }).code(), ErrorCode::cancelled);
}

TEST(KeyCaptureReal, DinosaurAgreesWithReferenceMasks) {
  LUMIHULL_NEED_REAL_DATA(data, "dinosaur");
  test::TemporaryFolder folder;
  Job job;
  ProjectionImportOptions import;
  import.output = folder / "dino";
  import.reference = true;
  Capture c = import_projections(data / "P.txt", import, job);
  c.set_hold_out(6);
  key_capture(c, {}, job);
  double sum = 0;
  for (std::size_t i = 0; i < 36; i += 6) {
    const Image reference = read_image(data / "masks" / (c.shots[i].name + ".png"), {.channels = 1});
    const double value = iou(c.read_mask(i), reference);
    EXPECT_GT(value, 0.98) << c.shots[i].name;
    sum += value;
  }
  EXPECT_GE(sum / 6, 0.985);
}

}  // namespace
}  // namespace lumihull::hull
