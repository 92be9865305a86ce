// Square targets: found, read upright, and measured to the bound, on pictures of exact coverage.
#include <lumihull/base/parallel.h>
#include <lumihull/calib/detect_targets.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include "square_scene.h"
#include "support.h"
#include "targets/square_targets.h"

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

struct Study {
  int shown = 0, found = 0, wrong = 0;
  double square_sum = 0, mahalanobis = 0, worst = 0, predicted = 0;
  Eigen::Vector2d inward{0, 0};  // mean of the error's part towards the square's middle (x), and along (y)
  int corners = 0;
  double rms() const { return std::sqrt(square_sum / std::max(1, corners)); }
};

struct Setting {
  std::string family = "aruco:6x6_250";
  double side = 60, blur = 1, noise = 0, most_tilt = 60;
  int times = 20;
  Eigen::Vector2d shade{0, 0};
};

Study run(const Setting& setting) {
  const TargetSet set = set_of(setting.family);
  const TargetFamily& family = set.designs[0].family;
  const SquareDetector detector(set);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  Study study;
  for (int i = 0; i < setting.times; ++i) {
    const int size = int(2 * setting.side) + 60;
    SquareScene scene(size, size);
    const int id = family.ids()[random() % family.ids().size()];
    const Eigen::Vector2d middle(size / 2.0 + uniform(random), size / 2.0 + uniform(random));
    const double tilt = setting.most_tilt * std::numbers::pi / 180 * uniform(random);
    const auto view = test::view_of_square(family.grid(), setting.side, 1500, 6.28 * uniform(random), tilt,
                                           6.28 * uniform(random), middle, middle + Eigen::Vector2d(100, -50));
    scene.add(family, id, view);
    const Image photo = scene.photograph(
        {.blur_px = setting.blur, .noise = setting.noise, .shade = setting.shade, .seed = std::uint64_t(i)});
    Job job({}, 1);
    Detections found;
    detector.detect(photo, {}, job, found);
    ++study.shown;
    if (std::getenv("LUMIHULL_SHOW") && found.targets.empty()) {
      std::printf("  missed: side %.0f tilt %.0f, refused %zu", setting.side, tilt * 57.3, found.refused.size());
      for (auto& r : found.refused) std::printf(" (%d)", int(r.reason));
      std::printf("\n");
    }
    for (const Detection& d : found.targets) {
      if (d.id != id) {
        ++study.wrong;
        continue;
      }
      ++study.found;
      const int g = family.grid();
      const Eigen::Vector2d truth[4] = {view({0, 0}), view({g, 0}), view({g, g}), view({0, g})};
      const Eigen::Vector2d center = view({g / 2.0, g / 2.0});
      for (const Feature& f : d.features) {
        const Eigen::Vector2d e = f.pixel - truth[f.index];
        study.square_sum += e.squaredNorm();
        study.worst = std::max(study.worst, e.norm());
        study.mahalanobis += e.dot(f.covariance.inverse() * e);
        study.predicted += f.covariance.trace();
        const Eigen::Vector2d in = (center - truth[f.index]).normalized();
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

void show(const char* what, const Setting& s, const Study& t) {
  std::printf("%s side %4.0f blur %.1f noise %.3f: found %d/%d wrong %d rms %.4f (predicted %.4f) worst %.4f maha %.2f in %.4f along %.4f\n",
              what, s.side, s.blur, s.noise, t.found, t.shown, t.wrong, t.rms(), t.predicted, t.worst, t.mahalanobis,
              t.inward.x(), t.inward.y());
}

TEST(SquareTargets, Sweep) {
  for (const double side : {15., 20., 30., 60., 120.})
    for (const double blur : {.5, 1., 2.})
      for (const double noise : {0., 0.01}) {
        Setting s;
        s.side = side, s.blur = blur, s.noise = noise;
        show("", s, run(s));
      }
}

}  // namespace
}  // namespace lumihull::calib
