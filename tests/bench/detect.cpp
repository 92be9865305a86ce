// Detection of circle targets: 12 megapixels with 40 targets, time by stage; and rates by size, tilt and blur.
// detect [time | rates FAMILY RENDERS | clutter PICTURES FIRST PHOTOGRAPH… | ids FAMILY RENDERS FIRST]
#include <lumihull/base/job.h>
#include <lumihull/calib/detect_targets.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "../calib/targets/decoys.h"
#include "../calib/targets/target_scene.h"
#include "targets/circle_blobs.h"
#include "targets/circle_lattice.h"
#include "targets/circle_targets.h"
#include "targets/grey_pyramid.h"

using namespace lumihull;
using namespace lumihull::calib;
using Eigen::Vector2d;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

double wall_ms() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double cpu_ms() { return 1e3 * double(std::clock()) / CLOCKS_PER_SEC; }

// The least of several runs of a step, wall and processor.
template <class Step>
void time_step(const char* name, int runs, const Step& step) {
  double wall = 1e300, cpu = 1e300;
  for (int i = 0; i < runs; ++i) {
    const double w = wall_ms(), c = cpu_ms();
    step();
    wall = std::min(wall, wall_ms() - w), cpu = std::min(cpu, cpu_ms() - c);
  }
  std::printf("  %-34s %8.1f ms wall %8.1f ms cpu\n", name, wall, cpu);
}

// 4000 x 3000 px, 8 x 5 targets of 12 to 24 px circles about a green room, tilted by up to 50 degrees.
Image wall_of_targets(const TargetDesign& design, std::vector<test::PlacedTarget>& targets) {
  Camera camera = test::part_of_camera(4000, 3000, 3500, {2000, 1500});
  for (int i = 0; i < 40; ++i) {
    test::Lie lie;
    lie.pixel = {300 + 485.0 * (i % 8), 350 + 570.0 * (i / 8)};
    lie.minor_px = 12 + (i * 7) % 13;
    lie.tilt = ((i * 5) % 11) * 5 * kDegree;
    lie.azimuth = i, lie.roll = 2 * i;
    targets.push_back({0, design.family.ids()[std::size_t(i * 5)], test::pose_of(camera, design, lie)});
  }
  rig::PrintPhotoOptions options;
  options.blur_px = 0.8, options.noise_read = 0.004, options.noise_shot = 1e-4, options.shading = {.4f, .2f};
  options.edge_samples = 8;
  return test::photograph(camera, {design}, targets, {.1f, .35f, .1f}, options, 1);
}

void times() {
  const TargetDesign design = test::design_of("matrix5x5");
  std::vector<test::PlacedTarget> targets;
  const Image photo = wall_of_targets(design, targets);
  Job job({}, 2);
  TargetSet set;
  set.designs = {design};
  const TargetDetector detector(set);
  DetectOptions plain;
  plain.refine = false;
  const TargetDetector unrefined(set, plain);

  std::printf("4000 x 3000 px, 40 targets of 25 circles, two threads\n");
  const Eigen::Vector3f weights(.25f, .5f, .25f);
  GreyPyramid grey;
  std::vector<Blob> blobs;
  std::vector<CircleLattice> lattices;
  LightPlane plane;
  time_step("bytes and their halves", 7, [&] { grey = grey_pyramid(photo, {.25f, .5f, .25f}, job); });
  time_step("dark ellipses", 7, [&] { blobs = find_blobs(grey, nullptr, {}, job); });
  time_step("lattices", 7, [&] { lattices = find_lattices(blobs, 4, 5); });
  time_step("plane of linear light", 7, [&] { plane = light_plane(photo, weights, job); });
  std::vector<Window> windows;
  const int first = 0;
  time_step("first reading", 7, [&] {
    windows.clear();
    for (const CircleLattice& l : lattices)
      for (Window& w : find_windows(plane, blobs, l, set, {&first, 1}, 1)) windows.push_back(std::move(w));
  });
  time_step("measuring, reading (one thread)", 3, [&] {
    for (const Window& w : windows) (void)read_window(plane, blobs, w, set, {});
  });
  time_step("the same by the dual conic alone", 3, [&] {
    for (const Window& w : windows) (void)read_window(plane, blobs, w, set, plain);
  });
  std::printf("  %zu ellipses, %zu lattices, %zu windows\n", blobs.size(), lattices.size(), windows.size());
  std::size_t found = 0, circles = 0;
  time_step("detect", 5, [&] {
    const Detections d = detector.detect(photo, job);
    found = d.targets.size(), circles = 0;
    for (const Detection& t : d.targets) circles += t.features.size();
  });
  time_step("detect, refine = false", 5, [&] { (void)unrefined.detect(photo, job); });
  std::printf("  %zu of 40 targets, %zu of 1000 circles\n", found, circles);
}

void rates(const std::string& family, int renders) {
  TargetSet set;
  set.designs = {test::design_of(family)};
  DetectOptions options;
  options.refine = false;
  const TargetDetector detector(set, options);
  Job job({}, 1);
  std::printf("%s: found, %% of %d renders; noise 1 %%, shading\nminor px  tilt   blur 0.5    1.0    1.5    2.0\n",
              family.c_str(), renders);
  int wrong = 0;
  for (const double size : {4., 5., 6., 8., 12., 20., 40.})
    for (const double tilt : {0., 30., 45., 60., 70.}) {
      std::printf("%6.0f %7.0f       ", size, tilt);
      for (const double blur : {.5, 1., 1.5, 2.}) {
        int found = 0;
        for (int i = 0; i < renders; ++i) {
          rig::PrintPhotoOptions o;
          o.blur_px = blur, o.noise_read = .01, o.edge_samples = 4, o.shading = {.3f, -.2f};
          const auto one = test::one_target(set.designs[0], size, tilt * kDegree, o, std::uint64_t(1000 + i));
          for (const Detection& t : detector.detect(one.photo, job).targets) {
            found += t.id == one.target.id;
            wrong += t.id != one.target.id;
          }
        }
        std::printf("%6.1f ", 100.0 * found / renders);
        std::fflush(stdout);
      }
      std::printf("\n");
    }
  std::printf("wrong ids: %d\n", wrong);
}

// Pictures without targets, and parts of photographs (files named on the command line) at random scales.
void clutters(int pictures, int first, const std::vector<std::string>& files) {
  TargetSet set;
  for (const char* family : {"paper4x4", "matrix5x5", "matrix6x6"}) set.designs.push_back(test::design_of(family));
  const TargetDetector detector(set);
  Job job({}, 2);
  int found = 0, refused[6] = {};
  const auto look = [&](const Image& picture, const std::string& name) {
    const Detections d = detector.detect(picture, job);
    for (const RefusedTarget& r : d.refused) ++refused[std::size_t(r.reason)];
    for (const Detection& t : d.targets)
      std::printf("  FALSE: %s: %s id %d, corrected %d, erased %d, rms %.3f\n", name.c_str(),
                  set.designs[std::size_t(t.design)].family.name().c_str(), t.id, t.corrected, t.erased, t.rms_px);
    found += int(d.targets.size());
  };
  const double begin = cpu_ms();
  for (int i = first; i < first + pictures; ++i) look(test::decoy(std::uint64_t(i)), "clutter " + std::to_string(i));
  for (const std::string& file : files)
    look(read_image(file, {.apply_orientation = false, .channels = 3, .max_file_bytes = 1u << 30}), file);
  std::printf(
      "%d pictures of clutter, %zu photographs: %d false targets; refused: %d no code, %d homography, %d too few\n",
      pictures, files.size(), found, refused[0], refused[1], refused[3]);
  std::printf("%.1f ms cpu a picture, drawing included\n",
              (cpu_ms() - begin) / std::max<double>(1, pictures + double(files.size())));
}

// Renders over the goal's range: rate of detection and wrong ids.
void ids(const std::string& family, int renders, int first) {
  TargetSet set;
  set.designs = {test::design_of(family)};
  DetectOptions options;
  options.refine = false;
  const TargetDetector detector(set, options);
  Job job({}, 1);
  int found = 0, wrong = 0, corrected = 0;
  for (int i = first; i < first + renders; ++i) {
    std::mt19937_64 random{std::uint64_t(i)};
    const auto uniform = [&](double low, double high) { return low + (high - low) * double(random() >> 11) * 0x1p-53; };
    rig::PrintPhotoOptions o;
    o.edge_samples = 4;
    const double size = 5 * std::pow(4.0, uniform(0, 1)), tilt = uniform(0, 60);
    o.blur_px = uniform(.4, std::min(2.0, .2 * size)), o.noise_read = uniform(0, .03);
    o.shading = {float(uniform(-.6, .6)), float(uniform(-.6, .6))};
    const auto one = test::one_target(set.designs[0], size, tilt * kDegree, o, std::uint64_t(i));
    for (const Detection& t : detector.detect(one.photo, job).targets) {
      found += t.id == one.target.id;
      corrected += t.corrected;
      if (t.id == one.target.id) continue;
      ++wrong;
      std::printf("  WRONG: render %d: id %d for %d, corrected %d, erased %d\n", i, t.id, one.target.id, t.corrected,
                  t.erased);
    }
  }
  std::printf("%s: %d renders: found %.3f %%, wrong ids %d, corrected cells %d\n", family.c_str(), renders,
              100.0 * found / renders, wrong, corrected);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "time";
  if (what == "time") times();
  if (what == "rates") rates(argc > 2 ? argv[2] : "matrix5x5", argc > 3 ? std::atoi(argv[3]) : 50);
  if (what == "clutter")
    clutters(argc > 2 ? std::atoi(argv[2]) : 1000, argc > 3 ? std::atoi(argv[3]) : 0,
             std::vector<std::string>(argv + std::min(argc, 4), argv + argc));
  if (what == "ids")
    ids(argc > 2 ? argv[2] : "matrix5x5", argc > 3 ? std::atoi(argv[3]) : 1000, argc > 4 ? std::atoi(argv[4]) : 0);
  return 0;
}
