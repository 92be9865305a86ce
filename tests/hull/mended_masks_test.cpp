// Masks of an object that took on its enclosure's colour are mended by the other views; holes that are there stay.
#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/hull/auto_key.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "support.h"

namespace lumihull::hull {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 880, kHeight = 640;  // more than half a megapixel: masks are compared at half the size
constexpr int kViews = 14, kAlongBore = 3;
constexpr double kRadius = 0.8, kBore = 0.17;

/// A ball in a green room, seen from a ring. A round bore runs through it along the axis of one camera: no other
/// one looks through. The room lights two spots of the ball: each is a hole in some masks, a notch in others.
class Scene {
 public:
  explicit Scene(const fs::path& folder, int positioned = kViews) : capture(Capture::create(folder)) {
    fs::create_directories(folder / "photos");
    fs::create_directories(folder / "enclosure");
    capture.cameras.push_back(view(0).camera);
    static const std::vector<std::pair<Image, Image>> renders = [] {
      std::vector<std::pair<Image, Image>> list;
      for (int i = 0; i < kViews; ++i) list.push_back(render(view(i), true, std::uint32_t(i)));
      return list;
    }();
    for (int i = 0; i < kViews; ++i) {
      const auto& [photo, truth] = renders[std::size_t(i)];
      truths.push_back(truth);
      capture.shots.push_back(shot("photos/p" + std::to_string(i), photo));
      if (i < positioned) capture.shots.back().cam_from_world = view(i).cam_from_world;
    }
    for (int i = 0; i < 2; ++i)
      capture.enclosure.push_back(
          shot("enclosure/e" + std::to_string(i), render(view(4 * i + 1), false, 100u + std::uint32_t(i)).first));
    capture.save();
  }

  Capture capture;
  std::vector<Image> truths;  ///< 255: ball, 0: background, 100: background seen through the bore

  /// Shares of the pixels that masks get wrong, over all views.
  struct Errors {
    double missing = 0, extra = 0, filled_bore = 0;
  };
  Errors errors() const {
    double ball = 0, bore = 0;
    Errors e;
    for (std::size_t i = 0; i < truths.size(); ++i) {
      const Image mask = capture.read_mask(i);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const int truth = truths[i].row<std::uint8_t>(y)[x];
          const bool object = mask.row<std::uint8_t>(y)[x] >= 128;
          ball += truth == 255, bore += truth == 100;
          e.missing += truth == 255 && !object, e.extra += truth == 0 && object;
          e.filled_bore += truth == 100 && object;
        }
    }
    return {e.missing / ball, e.extra / ball, e.filled_bore / bore};
  }

  std::string masks() const {
    std::string bytes;
    for (const Shot& s : capture.shots) bytes += read_file(capture.mask_path(s));
    return bytes;
  }

 private:
  static View view(int i) {
    View v;
    v.camera.width = kWidth, v.camera.height = kHeight;
    v.camera.f = 1100, v.camera.u0 = kWidth / 2.0, v.camera.v0 = kHeight / 2.0;
    const double a = 2 * M_PI * i / kViews;
    v.cam_from_world = look_at({4 * std::cos(a), 4 * std::sin(a), 1 + 0.9 * std::sin(3 * a)}, {0, 0, 0}, {0, 0, 1});
    return v;
  }

  Shot shot(const std::string& name, const Image& photo) const {
    Shot s;
    s.name = fs::path(name).filename().string();
    s.file = name + ".png";
    write_png(capture.folder() / s.file, photo, {1});
    return s;
  }

  static std::pair<Image, Image> render(const View& v, bool ball, std::uint32_t seed) {
    Image photo(kWidth, kHeight, 3), truth(kWidth, kHeight, 1);
    std::mt19937 random(seed);
    const Eigen::Vector3d eye = v.center(), axis = view(kAlongBore).center().normalized();
    const Eigen::Vector3d spots[2] = {Eigen::Vector3d(0.2, -1, 0.3).normalized(),
                                      Eigen::Vector3d(-0.5, 0.8, -0.25).normalized()};
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d d =
            v.cam_from_world.rotation.conjugate() * v.camera.ray({x + 0.5, y + 0.5})->normalized();
        // Shades of green: (40, 120, 56) and up to a quarter less.
        const double light = 0.875 + 0.125 * std::sin(0.01 * x + 0.02 * y + eye.x());
        double color[3] = {40 * light, 120 * light, 56 * light};
        int noise = 4;
        const double b = eye.dot(d), disc = b * b - eye.squaredNorm() + kRadius * kRadius;
        if (ball && disc > 0) {
          const double near = -b - std::sqrt(disc), far = -b + std::sqrt(disc);
          bool through = true;
          for (int k = 0; k <= 16 && through; ++k) {
            const Eigen::Vector3d q = eye + (near + (far - near) * k / 16) * d;
            through = q.cross(axis).norm() < kBore;
          }
          truth.row<std::uint8_t>(y)[x] = through ? 100 : 255;
          const Eigen::Vector3d p = (eye + near * d) / kRadius;
          const bool lit = std::max(p.dot(spots[0]), p.dot(spots[1])) > std::cos(0.3);
          if (!through && lit) {
            const double bled[3] = {48, 112, 60};  // between shades of the room, a little paler than any
            std::copy(bled, bled + 3, color);
            noise = 1;
          } else if (!through) {
            const double shade = 0.5 + 0.5 * std::clamp(p.dot(Eigen::Vector3d(0.3, 0.5, 0.8)), 0.0, 1.0);
            const double white[3] = {225, 220, 205};
            for (int c = 0; c < 3; ++c) color[c] = white[c] * shade;
          }
        }
        for (int c = 0; c < 3; ++c)
          photo.row<std::uint8_t>(y)[3 * x + c] =
              std::uint8_t(std::clamp(color[c] + double(random() % std::uint32_t(2 * noise + 1)) - noise, 0.0, 255.0));
      }
    return {std::move(photo), std::move(truth)};
  }
};

TEST(MendedMasks, BleedingIsMendedFromEverySourceAndTheBoreStaysOpen) {
  test::TemporaryFolder folder;
  Scene scene(folder / "c");
  Job job;
  KeyOptions options;
  options.clean = false;
  EXPECT_EQ(key_capture(scene.capture, options, job).mended, 0u);
  Scene::Errors e = scene.errors();
  EXPECT_GT(e.missing, 0.02) << "the scene must be one that colour alone gets wrong";
  fs::copy_file(folder / "c" / "key.json", folder / "saved.json");

  options = {};
  for (int source = 0; source < 4; ++source) {
    options.background = source == 0   ? "enclosure"
                         : source == 1 ? (folder / "saved.json").string()
                         : source == 2 ? "regions"
                                       : "photos";
    options.regions.clear();
    for (int i = 0; source == 2 && i < kViews; ++i)
      options.regions += "p" + std::to_string(i) + ":0,0,880,60;p" + std::to_string(i) + ":0,0,150,640;";
    SCOPED_TRACE(options.background);
    const KeyReport report = key_capture(scene.capture, options, job);
    EXPECT_TRUE(source == 3 || report.mended >= 5u) << report.mended;
    e = scene.errors();
    EXPECT_LT(e.missing, 0.004);
    EXPECT_LT(e.extra, 0.004);
    EXPECT_LT(e.filled_bore, 0.05);
  }
}

TEST(MendedMasks, AreTheSameForAnyNumberOfThreads) {
  test::TemporaryFolder folder;
  Scene scene(folder / "c");
  std::string first;
  for (const unsigned threads : {1u, 3u}) {
    Job job({}, threads);
    EXPECT_GE(key_capture(scene.capture, {}, job).mended, 5u);
    if (threads == 1) first = scene.masks();
    EXPECT_TRUE(scene.masks() == first);
  }
}

TEST(MendedMasks, FourCamerasAreAsNone) {
  test::TemporaryFolder folder;
  std::string alone;
  for (const int cameras : {0, 4}) {
    Scene scene(folder / std::to_string(cameras), cameras);
    Job job;
    EXPECT_EQ(key_capture(scene.capture, {}, job).mended, 0u);
    if (cameras == 0) alone = scene.masks();
    EXPECT_TRUE(scene.masks() == alone);
    EXPECT_GT(scene.errors().missing, 0.02);
  }
}

TEST(MendedMasks, ImportedAndEditedMasksAreNotTouched) {
  test::TemporaryFolder folder;
  Scene scene(folder / "c");
  Image drawn(kWidth, kHeight, 1);  // the upper half of the ball, and a speck
  for (int y = 0; y < kHeight / 2; ++y)
    for (int x = 0; x < kWidth; ++x)
      drawn.row<std::uint8_t>(y)[x] = scene.truths[2].row<std::uint8_t>(y)[x] == 255 ? 255 : 0;
  drawn.row<std::uint8_t>(600)[10] = 255;
  scene.capture.write_mask(2, drawn, MaskSource::imported);
  scene.capture.write_mask(7, scene.truths[7], MaskSource::keyed);
  write_png(scene.capture.mask_path(scene.capture.shots[7]), drawn, {1});
  const auto bytes = [&](std::size_t shot) { return read_file(scene.capture.mask_path(scene.capture.shots[shot])); };
  const std::string imported = bytes(2), edited = bytes(7);
  Job job;
  const KeyReport report = key_capture(scene.capture, {}, job);
  EXPECT_EQ(report.kept, 2u);
  EXPECT_GE(report.mended, 3u) << "others must be mended beside them";
  EXPECT_TRUE(bytes(2) == imported);
  EXPECT_TRUE(bytes(7) == edited);
}

}  // namespace
}  // namespace lumihull::hull
