// From the printed sheet to the ids: sheets as an independent program rasterises them, photographed at a tilt through a
// lens, blurred and with noise, are found, read and measured by the whole detector.

#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/target_sheet.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>
#include <random>

#include "rasterised.h"
#include "support.h"

namespace lumihull::calib {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Page;

constexpr double kPaper = 0.7, kInk = 0.03, kTable = 0.12;  // linear light
constexpr float kNoise = .007f;
constexpr double kMostTilt = 45 * std::numbers::pi / 180;

/// A photograph of a page: millimetres of the page seen from a camera through its lens.
struct PageShot {
  Camera camera;
  Pose cam_from_page;  // m
  Image photo;
};

/// A page in linear light. A raster's greys are shares of ink.
class PageLight {
 public:
  explicit PageLight(const Page& page) : page_(page) {
    float of_grey[256];
    for (int grey = 0; grey < 256; ++grey) of_grey[grey] = float(kInk + (kPaper - kInk) * grey / 255);
    for (const char grey : page.pixels) light_.push_back(of_grey[static_cast<unsigned char>(grey)]);
  }
  /// At a place of the page, mm; bilinear between the raster's pixels.
  float at(double x_mm, double y_mm) const {
    const double x = page_.px(x_mm) - 0.5, y = page_.px(y_mm) - 0.5;
    if (!(x >= 0 && y >= 0 && x < page_.width - 1 && y < page_.height - 1)) return float(kTable);
    const int x0 = int(x), y0 = int(y);
    const float* p = light_.data() + y0 * page_.width + x0;
    const float fx = float(x - x0), fy = float(y - y0), *q = p + page_.width;
    return (1 - fy) * (p[0] + fx * (p[1] - p[0])) + fy * (q[0] + fx * (q[1] - q[0]));
  }

 private:
  const Page& page_;
  std::vector<float> light_;
};

std::vector<std::uint8_t> srgb_table() {
  std::vector<std::uint8_t> table;
  for (int i = 0; i < 8192; ++i) table.push_back(std::uint8_t(255 * srgb_from_linear((float(i) + .5f) / 8192) + .5f));
  return table;
}

void blur(std::vector<float>& values, int width, int height, double sigma) {
  const int reach = int(std::ceil(3.5 * sigma));
  std::vector<float> weights;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) sum += weights.emplace_back(float(std::exp(-0.5 * i * i / (sigma * sigma))));
  for (float& w : weights) w /= sum;
  std::vector<float> other(values.size());
  for (const int step : {1, width}) {
    const int last = step == 1 ? width - 1 : height - 1;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const int at = step == 1 ? x : y;
        float v = 0;
        for (int i = -reach; i <= reach; ++i)
          v += weights[std::size_t(i + reach)] *
               values[std::size_t(y * width + x + (std::clamp(at + i, 0, last) - at) * step)];
        other[std::size_t(y * width + x)] = v;
      }
    values.swap(other);
  }
}

/// scale: px of the photograph per mm in the page's middle.
PageShot photograph(const Page& page, double scale, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&](double low, double high) { return low + (high - low) * double(random() >> 11) * 0x1p-53; };
  const Vector2d size(25.4 / page.dpi * page.width, 25.4 / page.dpi * page.height);

  PageShot shot;
  Camera& camera = shot.camera;
  const double diagonal = scale * size.norm();
  camera.f = between(1.2, 2.5) * diagonal;
  camera.width = camera.height = int(1.3 * diagonal);
  camera.u0 = camera.v0 = 0.5 * camera.width;
  camera.k1 = between(-.15, .15), camera.k2 = between(-.05, .05), camera.p1 = between(-.002, .002);
  const double tilt = between(0, kMostTilt), axis = between(0, 7), turn = between(0, 7);
  shot.cam_from_page.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Vector3d(std::cos(axis), std::sin(axis), 0)) *
                         Eigen::AngleAxisd(turn, Vector3d::UnitZ()));
  const Vector3d middle(5e-4 * size.x(), 5e-4 * size.y(), 0);
  shot.cam_from_page.translation = Vector3d(0, 0, 1e-3 * camera.f / scale) - shot.cam_from_page.rotation * middle;

  // Cut to what shows the page.
  Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (int i = 0; i <= 8; ++i)
    for (int k = 0; k <= 8; ++k) {
      const auto px = camera.project(shot.cam_from_page * Vector3d(size.x() * i / 8e3, size.y() * k / 8e3, 0));
      low = low.cwiseMin(px.value()), high = high.cwiseMax(*px);
    }
  const Vector2d corner(std::floor(low.x() - 5), std::floor(low.y() - 5));
  camera.u0 -= corner.x(), camera.v0 -= corner.y();
  camera.width = int(high.x() - corner.x()) + 6, camera.height = int(high.y() - corner.y()) + 6;

  // Where the pixels' corners see the page's plane; between a pixel's corners that is as good as linear.
  const int columns = camera.width + 1;
  std::vector<Vector2d> places;
  const Pose page_from_cam = shot.cam_from_page.inverse();
  for (int y = 0; y <= camera.height; ++y)
    for (int x = 0; x <= camera.width; ++x) {
      const Vector3d ray = page_from_cam.rotation * camera.ray(Vector2d(x, y)).value();
      const Vector3d place = page_from_cam.translation - page_from_cam.translation.z() / ray.z() * ray;
      places.emplace_back(1e3 * place.head<2>());
    }
  constexpr int kSamples = 2;
  const PageLight light(page);
  std::vector<float> values(std::size_t(camera.width) * std::size_t(camera.height));
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vector2d* p = places.data() + y * columns + x;
      const Vector2d right = p[1] - p[0], down = p[columns] - p[0];
      float sum = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const Vector2d at = p[0] + (i % kSamples + .5) / kSamples * right + (i / kSamples + .5) / kSamples * down;
        sum += light.at(at.x(), at.y());
      }
      values[std::size_t(y * camera.width + x)] = sum / (kSamples * kSamples);
    }
  blur(values, camera.width, camera.height, between(.4, .8));
  static const std::vector<std::uint8_t> srgb = srgb_table();
  shot.photo = Image(camera.width, camera.height, 1, PixelType::u8);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      // Four even numbers, of 16 bits each, add up to about a normal one.
      float normal = -2;
      for (std::uint64_t bits = random(), i = 0; i < 4; ++i) normal += float(bits >> 16 * i & 0xffff) / 65536;
      const float v = values[std::size_t(y * camera.width + x)] + kNoise * std::sqrt(3.f) * normal;
      shot.photo.row<std::uint8_t>(y)[x] = srgb[std::size_t(std::clamp(8192 * v, 0.f, 8191.f))];
    }
  return shot;
}

/// Where a feature of a target is seen, px: of a circle, the ellipse's centre.
Vector2d seen_at(const PageShot& shot, const TargetDesign& design, const BoardTarget& target, int feature) {
  const Vector2d p = design.feature(feature);
  const Pose cam_from_target = shot.cam_from_page * target.board_from_target;
  Circle3 circle;
  circle.center = cam_from_target * Vector3d(p.x(), p.y(), 0);
  circle.u = cam_from_target.rotation * Vector3d::UnitX();
  circle.v = cam_from_target.rotation * Vector3d::UnitY();
  if (design.family.kind() == TargetKind::circles) circle.radius = design.circle_radius_m();
  return projected_circle_center(shot.camera, circle).value();
}

/// Prints ids, four on a sheet, photographs each sheet once, and looks for all of the family's ids.
/// most_off: RMS of a target's features about where they are, px.
void expect_all_found(const std::string& family, const std::vector<int>& ids, double scale, double most_off) {
  const test::TemporaryFolder folder;
  Job job({}, 1);
  TargetDesign design;
  design.family = TargetFamily::by_name(family);
  design.size_m = 0;
  design.ink = {0, 0, 0}, design.paper = {255, 255, 255};
  write_target_sheets(folder / "sheets", design, ids, {SheetFormat::pdf}, {.per_sheet = 4}, job);
  const TargetSet printed = TargetSet::load(folder / "sheets.json");
  // Two pixels of the raster for one of the photograph.
  const std::vector<Page> pages = test::rasterised(folder / "sheets.pdf", int(std::ceil(2 * 25.4 * scale)));
  ASSERT_EQ(pages.size(), printed.boards.size());
  TargetSet any;
  any.designs = printed.designs;
  const TargetDetector detector(any);
  for (std::size_t i = 0; i < pages.size(); ++i) {
    const std::vector<BoardTarget>& targets = printed.boards[i].targets;
    SCOPED_TRACE(family + " " + std::to_string(targets[0].id));
    const PageShot shot = photograph(pages[i], scale, 1000 * std::uint64_t(targets[0].id) + std::uint64_t(i));
    const Detections found = detector.detect(shot.photo, job);
    std::vector<int> expected, read;
    for (const BoardTarget& t : targets) expected.push_back(t.id);
    for (const Detection& d : found.targets) read.push_back(d.id);
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(read, expected);
    for (const Detection& d : found.targets) {
      const auto target = std::find_if(targets.begin(), targets.end(), [&](const auto& t) { return t.id == d.id; });
      if (target == targets.end()) continue;
      double squares = 0;
      for (const Feature& f : d.features)
        squares += (f.pixel - seen_at(shot, printed.designs[0], *target, f.index)).squaredNorm();
      EXPECT_LT(std::sqrt(squares / double(d.features.size())), most_off) << "id " << d.id;
    }
  }
}

/// A part of a family: so that no test takes long.
struct Portion {
  const char* family;
  int first, count;  ///< of the family's list of ids
  double scale;      ///< px per mm: circles of 8 or 9 px

  friend void PrintTo(const Portion& p, std::ostream* out) { *out << p.family << " from " << p.first; }
};

class PrintedCircles : public testing::TestWithParam<Portion> {};

TEST_P(PrintedCircles, AreAllFound) {
  if (!test::has_pdftoppm()) GTEST_SKIP() << "needs pdftoppm: install poppler-utils";
  const Portion& p = GetParam();
  const TargetFamily family = TargetFamily::by_name(p.family);
  const auto ids = family.ids().subspan(std::size_t(p.first), std::size_t(p.count));
  expect_all_found(p.family, {ids.begin(), ids.end()}, p.scale, 0.05);
}

std::vector<Portion> portions() {
  std::vector<Portion> all{{"paper4x4", 0, 400, 9 / 11.5}, {"matrix5x5", 0, 256, 9 / 9.}};
  for (int first = 0; first < 4096; first += 512) all.push_back({"matrix6x6", first, 512, 8 / 7.5});
  return all;
}

std::string portion_name(const testing::TestParamInfo<Portion>& portion) {
  return std::string(portion.param.family) + "_" + std::to_string(portion.param.first);
}

INSTANTIATE_TEST_SUITE_P(, PrintedCircles, testing::ValuesIn(portions()), portion_name);

TEST(PrintedSquares, OfEveryFamilyAreFound) {
  if (!test::has_pdftoppm()) GTEST_SKIP() << "needs pdftoppm: install poppler-utils";
  for (const std::string& name : TargetFamily::names()) {
    const TargetFamily family = TargetFamily::by_name(name);
    if (family.kind() != TargetKind::square) continue;
    std::vector<int> ids;
    for (std::size_t i = 0; i < family.ids().size(); ++i)
      if (i < 8 || i + 8 >= family.ids().size()) ids.push_back(family.ids()[i]);
    // About 60 px wide. The rasteriser draws mixed pixels lighter than their share of ink: edges lie a tenth of its
    // pixels farther in, which moves no circle's centre but every corner.
    expect_all_found(name, ids, 60 / 82., 0.1);
  }
}

}  // namespace
}  // namespace lumihull::calib
