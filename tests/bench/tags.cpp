// Corners of square targets beside OpenCV's ArUco and libapriltag: the same pictures of AprilTag 36h11, by the virtual rig,
// in the same run. Who finds how many, and the RMS distance (px, x and y together) of corners from the truth.
//
// bench_tags [PICTURES A SETTING = 40] [linear]
//
// linear: the others are given light instead of sRGB values. On sRGB values a blurred edge's middle lies on its dark side,
// and a square looks smaller by up to a blur's sigma on each side.
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/rig/flat_print.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <opencv2/aruco.hpp>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace lumihull;
using calib::TargetSet;

constexpr double kWrongPlace = 5;  // px: a corner that is farther off counts as not found

struct Tag {
  int id;
  std::vector<Eigen::Vector2d> corners;
};
using Finder = std::vector<Tag> (*)(const Image& rgb, const Image& grey);

std::vector<Tag> opencv(const Image& grey, cv::aruco::CornerRefineMethod method) {
  const cv::Mat picture(grey.height(), grey.width(), CV_8UC1, const_cast<std::byte*>(grey.data()));
  static const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = method;
  parameters->minMarkerPerimeterRate = 40.0 / std::max(grey.width(), grey.height());
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(picture, dictionary, corners, ids, parameters);
  std::vector<Tag> tags;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    tags.push_back({ids[i], {}});
    for (const auto& c : corners[i]) tags.back().corners.push_back({c.x + 0.5, c.y + 0.5});
  }
  return tags;
}

std::vector<Tag> apriltag(const Image& grey, float decimate, bool refine) {
  static apriltag_family_t* family = tag36h11_create();
  static apriltag_detector_t* detector = [] {
    apriltag_detector_t* d = apriltag_detector_create();
    apriltag_detector_add_family_bits(d, family, 2);
    return d;
  }();
  detector->nthreads = 1, detector->quad_decimate = decimate, detector->refine_edges = refine;
  image_u8_t picture = {grey.width(), grey.height(), grey.width(),
                        reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(grey.data()))};
  zarray_t* found = apriltag_detector_detect(detector, &picture);
  std::vector<Tag> tags;
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* d = nullptr;
    zarray_get(found, i, &d);
    tags.push_back({d->id, {}});
    for (const auto& p : d->p) tags.back().corners.push_back({p[0], p[1]});
  }
  apriltag_detections_destroy(found);
  return tags;
}

const calib::TargetDetector& our_detector() {
  static const calib::TargetDetector detector(TargetSet::from_word("apriltag:36h11:40mm"));
  return detector;
}

std::vector<Tag> ours(const Image& rgb) {
  Job job({}, 1);
  std::vector<Tag> tags;
  for (const auto& d : our_detector().detect(rgb, job).targets) {
    tags.push_back({d.id, {}});
    for (const auto& f : d.features) tags.back().corners.push_back(f.pixel);
  }
  return tags;
}

struct Contender {
  const char* name;
  Finder find;
  double squares = 0, seconds = 0;
  int corners = 0, found = 0;
};

std::vector<Contender> contenders() {
  using namespace cv::aruco;
  return {
      {"ours", [](const Image& rgb, const Image&) { return ours(rgb); }},
      {"ArUco, none", [](const Image&, const Image& g) { return opencv(g, CORNER_REFINE_NONE); }},
      {"ArUco, subpix", [](const Image&, const Image& g) { return opencv(g, CORNER_REFINE_SUBPIX); }},
      {"ArUco, contour", [](const Image&, const Image& g) { return opencv(g, CORNER_REFINE_CONTOUR); }},
      {"ArUco, apriltag", [](const Image&, const Image& g) { return opencv(g, CORNER_REFINE_APRILTAG); }},
      {"libapriltag 1", [](const Image&, const Image& g) { return apriltag(g, 1, true); }},
      {"libapriltag 2", [](const Image&, const Image& g) { return apriltag(g, 2, true); }},
      {"libapriltag 2 rough", [](const Image&, const Image& g) { return apriltag(g, 2, false); }},
  };
}

struct Scene {
  Image rgb, grey;
  int id;
  std::array<Eigen::Vector2d, 4> truth;
};

/// The picture as the others see it.
Image grey_of(const Image& rgb, bool linear) {
  Image grey = converted(rgb, PixelType::u8, 1);
  if (!linear) return grey;
  for (int y = 0; y < grey.height(); ++y)
    for (int x = 0; x < grey.width(); ++x) {
      std::uint8_t& v = grey.row<std::uint8_t>(y)[x];
      v = std::uint8_t(std::lround(255 * linear_from_srgb(float(v) / 255)));
    }
  return grey;
}

Scene scene_of(double side, double blur, double noise, std::uint64_t seed, bool linear) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const calib::TargetDesign& design = our_detector().set().designs[0];
  const int size = int(2 * side) + 80;
  View view;
  view.camera = {.width = size, .height = size, .f = 3.0 * size, .u0 = 0.5 * size, .v0 = 0.5 * size};
  const double tilt = uniform(random) * 60 * std::numbers::pi / 180, axis = 2 * std::numbers::pi * uniform(random);
  const Eigen::Quaterniond turn =
      Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(axis), std::sin(axis), 0)) *
      Eigen::AngleAxisd(2 * std::numbers::pi * uniform(random), Eigen::Vector3d::UnitZ());
  const double distance = view.camera.f * design.size_m / side;
  view.cam_from_world = {turn, {distance / view.camera.f * uniform(random), distance / view.camera.f * uniform(random), distance}};
  Scene scene;
  scene.id = design.family.ids()[random() % design.family.ids().size()];
  const rig::FlatPrint print = rig::print_of(design, scene.id);
  scene.rgb = rig::photograph_prints(view, std::span(&print, 1), {.4f, .4f, .4f}, {.blur_px = blur, .noise_read = noise}, seed);
  scene.grey = grey_of(scene.rgb, linear);
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d p = design.feature(i);
    scene.truth[std::size_t(i)] = *view.project({p.x(), p.y(), 0});
  }
  return scene;
}

/// A corner's distance is to the nearest true corner: conventions of order differ.
void judge(Contender& c, const Scene& scene) {
  const std::clock_t start = std::clock();
  const std::vector<Tag> tags = c.find(scene.rgb, scene.grey);
  c.seconds += double(std::clock() - start) / CLOCKS_PER_SEC;
  for (const Tag& tag : tags) {
    if (tag.id != scene.id) continue;
    double squares = 0, worst = 0;
    for (const auto& p : tag.corners) {
      double nearest = 1e300;
      for (const auto& t : scene.truth) nearest = std::min(nearest, (p - t).squaredNorm());
      squares += nearest, worst = std::max(worst, nearest);
    }
    if (worst > kWrongPlace * kWrongPlace || tag.corners.size() != 4) continue;
    c.squares += squares, c.corners += 4, ++c.found;
    return;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int pictures = argc > 1 ? std::atoi(argv[1]) : 40;
  const bool linear = argc > 2 && std::string(argv[2]) == "linear";
  std::printf("RMS of corners, px (found of %d), tilt 0 to 60 degrees, 8 bits%s\n%-22s", pictures,
              linear ? ", the others on light" : "", "side blur noise");
  for (const Contender& c : contenders()) std::printf("%20s", c.name);
  std::printf("\n");
  std::vector<Contender> total = contenders();
  for (const double side : {20., 40., 80., 160.})
    for (const double blur : {.5, 1., 2.})
      for (const double noise : {0., .01}) {
        std::vector<Contender> all = contenders();
        for (int i = 0; i < pictures; ++i) {
          const Scene scene = scene_of(side, blur, noise, std::uint64_t(i) + 1, linear);
          for (Contender& c : all) judge(c, scene);
        }
        std::printf("%4.0f %4.1f %5.2f       ", side, blur, noise);
        for (std::size_t k = 0; k < all.size(); ++k) {
          std::printf("     %8.4f (%3d)", std::sqrt(all[k].squares / std::max(1, all[k].corners)), all[k].found);
          total[k].seconds += all[k].seconds, total[k].found += all[k].found;
        }
        std::printf("\n");
        std::fflush(stdout);
      }
  std::printf("%-22s", "found in all");
  for (const Contender& c : total) std::printf("%20d", c.found);
  std::printf("\n%-22s", "CPU, s");
  for (const Contender& c : total) std::printf("%20.2f", c.seconds);

  // 12 megapixels: thirty targets of 150 px.
  const TargetSet set = our_detector().set();
  View view;
  view.camera = {.width = 4000, .height = 3000, .f = 4000, .u0 = 2000, .v0 = 1500};
  view.cam_from_world.translation = {0, 0, 4000 * .04 / 150};
  std::vector<rig::FlatPrint> prints;
  for (int i = 0; i < 30; ++i) {
    prints.push_back(rig::print_of(set.designs[0], i));
    prints.back().world_from_print.translation = {(i % 6 - 2.5) * .12, (i / 6 - 2.0) * .12, 0};
  }
  const Image rgb = rig::photograph_prints(view, prints, {.4f, .4f, .4f}, {.blur_px = .8, .noise_read = .01}, 1);
  const Image grey = grey_of(rgb, linear);
  std::printf("\n\n12 megapixels, 30 targets of 150 px: CPU, ms (found)\n");
  for (const Contender& c : contenders()) {
    const std::clock_t start = std::clock();
    const std::size_t found = c.find(rgb, grey).size();
    std::printf("%-22s%8.0f (%zu)\n", c.name, 1000.0 * double(std::clock() - start) / CLOCKS_PER_SEC, found);
  }
  return 0;
}
