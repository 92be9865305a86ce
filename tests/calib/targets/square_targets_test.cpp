// Square targets: found, read upright, and measured to the bound, on pictures of exact coverage.
#include <lumihull/calib/detect_targets.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "square_scene.h"
#include "support.h"

namespace lumihull::calib {
namespace {

using test::SquareScene;

TargetSet set_of(const std::string& family) {
  TargetSet set;
  TargetDesign design;
  design.family = TargetFamily::by_name(family);
  design.size_m = 0.04;
  design.ink = {0, 0, 0}, design.paper = {255, 255, 255};
  set.designs.push_back(design);
  return set;
}

struct Setting {
  std::string family = "aruco:6x6_250";
  double side = 60, blur = 1, noise = 0, most_tilt = 60;  // degrees
  int times = 12;
  Eigen::Vector2d shade{0, 0};
  double bend = 0;  // radial distortion: px at 100 px from the middle of the picture's corner
  double paper = 0.8;
};

struct Study {
  int shown = 0, found = 0, wrong = 0, corners = 0;
  double squares = 0, mahalanobis = 0, worst = 0, predicted = 0;  // px
  Eigen::Vector2d inward{0, 0};  // mean error towards the square's middle, and beside
  double rms() const { return std::sqrt(squares / std::max(1, corners)); }
};

std::array<Eigen::Vector2d, 4> corners_of(const SquareScene::Map& view, int grid) {
  return {view({0, 0}), view({grid, 0}), view({grid, grid}), view({0, grid})};
}

Study study_of(const Setting& setting) {
  const TargetSet set = set_of(setting.family);
  const TargetFamily& family = set.designs[0].family;
  const TargetDetector detector(set);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  Study study;
  for (int i = 0; i < setting.times; ++i) {
    const int size = int(2 * setting.side) + 60;
    SquareScene scene(size, size, setting.paper);
    const int id = family.ids()[random() % family.ids().size()];
    const Eigen::Vector2d middle(size / 2.0 + uniform(random), size / 2.0 + uniform(random));
    const double tilt = setting.most_tilt * std::numbers::pi / 180 * uniform(random);
    const auto straight = test::view_of_square(family.grid(), setting.side, 1500, 2 * std::numbers::pi * uniform(random), tilt,
                                               2 * std::numbers::pi * uniform(random), middle,
                                               middle + Eigen::Vector2d(100, -50));
    const auto view = [&](const Eigen::Vector2d& g) -> Eigen::Vector2d {
      const Eigen::Vector2d p = straight(g), d = p / 100;
      return p + setting.bend * d.squaredNorm() * d;
    };
    scene.add(family, id, view);
    const Image photo = scene.photograph(
        {.blur_px = setting.blur, .noise = setting.noise, .shade = setting.shade, .seed = std::uint64_t(i)});
    Job job({}, 1);
    ++study.shown;
    for (const Detection& d : detector.detect(photo, job).targets) {
      if (d.id != id) {
        ++study.wrong;
        continue;
      }
      ++study.found;
      const auto truth = corners_of(view, family.grid());
      const Eigen::Vector2d center = view({family.grid() / 2.0, family.grid() / 2.0});
      for (const Feature& f : d.features) {
        const Eigen::Vector2d e = f.pixel - truth[std::size_t(f.index)];
        const Eigen::Vector2d in = (center - truth[std::size_t(f.index)]).normalized();
        study.squares += e.squaredNorm();
        study.worst = std::max(study.worst, e.norm());
        study.mahalanobis += e.dot(f.covariance.inverse() * e);
        study.predicted += f.covariance.trace();
        study.inward += Eigen::Vector2d(e.dot(in), in.x() * e.y() - in.y() * e.x());
        ++study.corners;
      }
    }
  }
  study.inward /= std::max(1, study.corners);
  study.mahalanobis /= std::max(1, study.corners);
  study.predicted = std::sqrt(study.predicted / std::max(1, study.corners));
  return study;
}

TEST(SquareTargets, EveryFamilyIsReadUpright) {
  for (const std::string& name : TargetFamily::names()) {
    if (TargetFamily::by_name(name).kind() != TargetKind::square) continue;
    const Study s = study_of({.family = name, .side = 70, .blur = .8, .most_tilt = 40, .times = 3});
    EXPECT_EQ(s.found, s.shown) << name;
    EXPECT_EQ(s.wrong, 0) << name;
    EXPECT_LT(s.worst, 0.01) << name;
  }
}

TEST(SquareTargets, CornersAreUnbiased) {
  for (const double blur : {.5, 1., 1.5}) {
    const Study s = study_of({.side = 80, .blur = blur});
    EXPECT_EQ(s.found, s.shown) << blur;
    EXPECT_LT(s.rms(), 0.003) << blur;
    EXPECT_LT(s.inward.norm(), 0.001) << blur;
  }
}

TEST(SquareTargets, CornersAreUnbiasedInUnevenLightAndThroughABendingLens) {
  const Study shaded = study_of({.side = 80, .shade = {.5, -.3}});
  EXPECT_EQ(shaded.found, shaded.shown);
  EXPECT_LT(shaded.rms(), 0.004);
  const Study bent = study_of({.side = 80, .bend = 1.0});
  EXPECT_EQ(bent.found, bent.shown);
  EXPECT_LT(bent.rms(), 0.006);
}

TEST(SquareTargets, PaperThatIsClipped) {
  for (const double paper : {1.05, 1.3, 1.6}) {
    const Study s = study_of({.side = 60, .blur = .8, .noise = .007, .times = 20, .paper = paper});
    std::printf("paper %.2f: rms %.4f px, expected %.4f, inwards %.4f, mahalanobis² %.2f\n", paper, s.rms(), s.predicted,
                s.inward.x(), s.mahalanobis);
    EXPECT_GE(s.found, s.shown - 1) << paper;
    EXPECT_EQ(s.wrong, 0) << paper;
    EXPECT_LT(s.rms(), 0.06) << paper;  // taken for paper that is just white: 0.1 to 0.6 px inwards
    EXPECT_LT(s.mahalanobis, 5) << paper;
  }
}

TEST(SquareTargets, CovariancesAreTrue) {
  Study all;
  for (const double side : {40., 80.})
    for (const double blur : {.5, 1.}) {
      const Study s = study_of({.side = side, .blur = blur, .noise = 0.01, .most_tilt = 50, .times = 25});
      EXPECT_GE(s.found, s.shown - 1) << side << " " << blur;
      EXPECT_LT(s.rms(), 1.15 * s.predicted) << side << " " << blur;
      all.mahalanobis += s.mahalanobis / 4;
    }
  EXPECT_GT(all.mahalanobis, 1.6);  // 400 corners: 2 ± 0.1, and small ones are told to be worse than they are
  EXPECT_LT(all.mahalanobis, 2.3);
}

TEST(SquareTargets, SmallAndSteep) {
  const Study small = study_of({.side = 20, .blur = .5, .most_tilt = 30});
  EXPECT_EQ(small.found, small.shown);
  EXPECT_LT(small.rms(), 0.01);
  const Study steep = study_of({.side = 120, .blur = .7, .most_tilt = 70});
  EXPECT_EQ(steep.found, steep.shown);
  EXPECT_LT(steep.rms(), 0.01);
}

TEST(SquareTargets, LargeAndOutOfFocus) {
  for (const double blur : {3., 5.}) {
    const Study s = study_of({.side = 200, .blur = blur, .noise = 0.01, .most_tilt = 30, .times = 2});
    EXPECT_EQ(s.found, s.shown) << blur;
    EXPECT_LT(s.rms(), 0.1) << blur;
    EXPECT_LT(s.mahalanobis, 6) << blur;  // of 8 corners
  }
}

/// A picture with one 60 px target at each of these places.
Image several(const std::vector<std::pair<int, Eigen::Vector2d>>& targets, int width = 400, int height = 200) {
  const TargetFamily family = TargetFamily::by_name("aruco:6x6_250");
  SquareScene scene(width, height);
  for (const auto& [id, place] : targets)
    scene.add(family, id, test::view_of_square(family.grid(), 60, 1000, .3, .2, .1, place, {200, 100}));
  return scene.photograph({.blur_px = .8, .noise = .005}, PixelType::u8);
}

std::vector<int> ids_of(const Detections& found) {
  std::vector<int> ids;
  for (const Detection& d : found.targets) ids.push_back(d.id);
  return ids;
}

TEST(SquareTargets, ThePlaneIsTheCorners) {
  const TargetSet set = set_of("aruco:6x6_250");
  Job job({}, 1);
  const Detections found = TargetDetector(set).detect(several({{7, {100, 100}}}), job);
  ASSERT_EQ(found.targets.size(), 1u);
  for (const Feature& f : found.targets[0].features) {
    const Eigen::Vector3d p = found.targets[0].pixel_from_target * set.designs[0].feature(f.index).homogeneous();
    EXPECT_LT((p.hnormalized() - f.pixel).norm(), 1e-9);
  }
}

TEST(SquareTargets, SameIdTwiceIsNone) {
  Job job({}, 1);
  const Detections found =
      TargetDetector(set_of("aruco:6x6_250")).detect(several({{7, {80, 100}}, {7, {200, 100}}, {9, {320, 100}}}), job);
  EXPECT_THAT(ids_of(found), testing::ElementsAre(9));
  ASSERT_EQ(found.refused.size(), 2u);
  for (const RefusedTarget& r : found.refused) EXPECT_EQ(r.reason, RefusedTarget::Reason::duplicate);
}

TEST(SquareTargets, OnlyWhatBoardsHold) {
  TargetSet set = set_of("aruco:6x6_250");
  Board board;
  board.name = "plate";
  board.targets.push_back({0, 9, {}});
  set.boards.push_back(board);
  Job job({}, 1);
  const Detections found = TargetDetector(set).detect(several({{7, {80, 100}}, {9, {320, 100}}}), job);
  EXPECT_THAT(ids_of(found), testing::ElementsAre(9));
  ASSERT_EQ(found.refused.size(), 1u);
  EXPECT_EQ(found.refused[0].reason, RefusedTarget::Reason::unknown_id);
  EXPECT_EQ(found.refused[0].id, 7);
}

TEST(SquareTargets, TheSameForAnyNumberOfThreads) {
  const Image photo = several({{1, {80, 100}}, {2, {200, 100}}, {3, {320, 100}}});
  const TargetDetector detector(set_of("aruco:6x6_250"));
  Job one({}, 1), four({}, 4);
  const Detections a = detector.detect(photo, one), b = detector.detect(photo, four);
  ASSERT_EQ(a.targets.size(), 3u);
  ASSERT_EQ(b.targets.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(a.targets[i].features[k].pixel, b.targets[i].features[k].pixel);
      EXPECT_EQ(a.targets[i].features[k].covariance, b.targets[i].features[k].covariance);
    }
}

TEST(SquareTargets, DarkSquaresAreNoTargets) {
  const TargetDetector detector(set_of("apriltag:16h5"));
  SquareScene scene(300, 300);
  for (int i = 0; i < 9; ++i) {
    const Eigen::Vector2d at(40 + i % 3 * 90, 40 + i / 3 * 90);
    const double half = 20 + 2 * i;
    scene.add_polygon({at + Eigen::Vector2d(-half, -half), at + Eigen::Vector2d(half, -half), at + Eigen::Vector2d(half, half),
                       at + Eigen::Vector2d(-half, half)});
    scene.add_polygon({at, at + Eigen::Vector2d(half / 2, 3), at + Eigen::Vector2d(5, half / 3)}, -1);
  }
  Job job({}, 1);
  EXPECT_TRUE(detector.detect(scene.photograph({.blur_px = .7}), job).targets.empty());
}

TEST(SquareTargets, StrangePictures) {
  const TargetDetector detector(set_of("apriltag:36h11"));
  Job job({}, 2);
  EXPECT_EQ(test::expect_error([&] { detector.detect(Image(), job); }).code(), ErrorCode::invalid_argument);
  for (const auto& [w, h] : {std::pair{1, 1}, {7, 7}, {8, 8}, {1, 500}, {500, 1}, {9, 40}})
    for (const int channels : {1, 3, 4})
      for (const PixelType type : {PixelType::u8, PixelType::u16, PixelType::f32})
        EXPECT_TRUE(detector.detect(Image(w, h, channels, type), job).targets.empty());
  Image holes(100, 100, 1, PixelType::f32);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x) holes.row<float>(y)[x] = (x + y) % 3 ? std::nanf("") : 1e30f;
  EXPECT_TRUE(detector.detect(holes, job).targets.empty());
}

TEST(SquareTargets, RealMarkers) {
  LUMIHULL_NEED_REAL_DATA(folder, "case");
  const TargetDetector detector(set_of("aruco:6x6_250"));
  Job job({}, 2);
  std::size_t found = 0;
  for (const char* name : {"01.png", "05.png", "13.png", "21.png"}) {
    const Detections d = detector.detect(read_image(folder / name), job);
    found += d.targets.size();
    EXPECT_TRUE(d.refused.empty()) << name;
  }
  EXPECT_EQ(found, 79u);  // of 20 markers each; one is cut by the border of 13.png
}

TEST(DrawDetections, ShowsWhatWasFound) {
  const TargetSet set = set_of("aruco:6x6_250");
  const Image photo = several({{7, {80, 100}}, {7, {200, 100}}, {9, {320, 100}}});
  Job job({}, 1);
  const Detections found = TargetDetector(set).detect(photo, job);
  const Image drawn = draw_detections(photo, set, found);
  ASSERT_EQ(drawn.width(), 400);
  ASSERT_EQ(drawn.channels(), 3);
  int yellow = 0, orange = 0;
  for (int y = 0; y < drawn.height(); ++y)
    for (int x = 0; x < drawn.width(); ++x) {
      const std::uint8_t* p = drawn.row<std::uint8_t>(y) + 3 * x;
      yellow += p[0] == 255 && p[1] == 214 && p[2] == 0;
      orange += p[0] == 255 && p[1] == 130 && p[2] == 0;
    }
  EXPECT_GT(yellow, 100) << "the sides of the one that was accepted";
  EXPECT_GT(orange, 10) << "boxes around those that were refused";
}

TEST(DrawDetections, StrangeDetections) {
  const TargetSet set = set_of("aruco:6x6_250");
  const Image photo(60, 40, 1);
  Detections found;
  found.refused.push_back({RefusedTarget::Reason::no_code, {1e300, std::nan("")}, std::nan(""), 3});
  Detection d;
  d.pixel_from_target.setZero();
  d.features.push_back({.index = 0, .pixel = {std::nan(""), 5}});
  d.features.push_back({.index = 3, .pixel = {1e9, -1e9}});
  found.targets.push_back(d);
  EXPECT_EQ(draw_detections(photo, set, found).width(), 60);
  found.targets[0].features[1].index = 4;
  EXPECT_EQ(test::expect_error([&] { draw_detections(photo, set, found); }).code(), ErrorCode::invalid_argument);
  found.targets[0].design = 5;
  EXPECT_EQ(test::expect_error([&] { draw_detections(photo, set, found); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { draw_detections(Image(), set, {}); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::calib
