#include "printed_scene.h"

#include <lumihull/base/image.h>
#include <lumihull/rig/flat_print.h>

#include <cmath>
#include <numbers>
#include <optional>

namespace lumihull::test {

PrintedScene print_scene(const std::filesystem::path& folder, const std::string& word, int photos) {
  PrintedScene scene;
  scene.set = calib::TargetSet::from_word(word);
  scene.camera = {.width = 640, .height = 480, .f = 760, .u0 = 325, .v0 = 236, .k1 = 0.05, .k2 = -0.02};
  std::vector<rig::FlatPrint> prints;
  for (int i = 0; i < 6; ++i) {
    prints.push_back(rig::print_of(scene.set.designs[0], i + 1));
    // Face up: the print's z goes into the table.
    const Eigen::Quaterniond turned = Eigen::AngleAxisd(0.4 * i, Eigen::Vector3d::UnitZ()) *
                                      Eigen::Quaterniond(0, 1, 0, 0);
    prints.back().world_from_print = {turned, {0.16 * (i % 3 - 1), 0.16 * (i / 3 - 0.5), 0.002 * i}};
  }
  for (int i = 0; i < photos; ++i) {
    const double turn = 2 * std::numbers::pi * i / photos, height = i % 3 == 0 ? 0.62 : 0.42, reach = i % 3 == 0 ? 0.2 : 0.45;
    View view{scene.camera, look_at({reach * std::cos(turn), reach * std::sin(turn), height},
                                    {0.02 * (i % 2), 0, 0}, {0, 0, 1})};
    scene.cam_from_world.push_back(view.cam_from_world);
    scene.photos.push_back(folder / ("p" + std::to_string(i) + ".png"));
    write_png(scene.photos.back(), rig::photograph_prints(view, prints, {.35f, .33f, .3f},
                                                          {.blur_px = .7, .noise_read = .004}, std::uint64_t(i)));
  }
  return scene;
}

double PrintedScene::center_error_m(const std::vector<std::optional<Pose>>& poses) const {
  double squares = 0;
  int n = 0;
  for (std::size_t a = 0; a < poses.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      if (!poses[a] || !poses[b]) continue;
      const double truth = (cam_from_world[a].center() - cam_from_world[b].center()).norm();
      squares += std::pow((poses[a]->center() - poses[b]->center()).norm() - truth, 2);
      ++n;
    }
  return n > 0 ? std::sqrt(squares / n) : -1;
}

}  // namespace lumihull::test
