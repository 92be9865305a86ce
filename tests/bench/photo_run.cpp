// The paper's session through the detector: 600 photographs of 6.3 megapixels with eight targets each, from JPEG files.
// Time by stage, targets found, peak memory. Twenty different photographs are made and used in turn.
//
//     bench_photo_run FOLDER [--photos 600] [--family matrix5x5] [--threads 0]
//
// FOLDER keeps the twenty files; they are made where they are not there.

#include <lumihull/base/error.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/rig/flat_print.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "../calib/targets/target_shot.h"

using namespace lumihull;
namespace fs = std::filesystem;

namespace {

constexpr int kDistinct = 20, kColumns = 4, kRows = 2;  // targets stand in a loose grid

/// The paper's camera: 6.3 megapixels, 18 mm lens.
Camera paper_camera() {
  Camera c;
  c.width = 3072, c.height = 2048;
  c.f = 3072 * 18 / 22.7;
  c.u0 = 1536, c.v0 = 1024;
  c.k1 = .03, c.k2 = -.005;
  return c;
}

int id_of(const calib::TargetDesign& design, int photo, int target) {
  const auto ids = design.family.ids();
  return ids[std::size_t(photo * 31 + target * 7) % ids.size()];
}

Image photograph(const calib::TargetDesign& design, int photo) {
  test::Dice dice(std::uint64_t(photo) + 1);
  std::vector<rig::FlatPrint> prints;
  const Camera camera = paper_camera();
  for (int i = 0; i < kColumns * kRows; ++i) {
    rig::FlatPrint print = rig::print_of(design, id_of(design, photo, i));
    const double cell = 3072. / kColumns, size_px = dice.between(.3, .75) * cell;  // of the sheet's side, straight
    const Eigen::Vector2d at((i % kColumns + .5 + dice.between(-.08, .08)) * cell,
                             (i / kColumns + .5 + dice.between(-.08, .08)) * 2048. / kRows);
    const Eigen::Vector3d ray = camera.ray(at).value();
    const double axis = dice.between(0, 2 * M_PI);
    print.world_from_print.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(dice.between(0, .9), Eigen::Vector3d(std::cos(axis), std::sin(axis), 0)) *
                           Eigen::AngleAxisd(dice.between(0, 2 * M_PI), Eigen::Vector3d::UnitZ()));
    print.world_from_print.translation = ray * camera.f * (print.high.x() - print.low.x()) / size_px;
    prints.push_back(print);
  }
  rig::PrintPhotoOptions options;
  options.blur_px = .8, options.shading = {.3f, -.2f}, options.noise_read = .004, options.noise_shot = 3e-5;
  return rig::photograph_prints({camera, Pose{}}, prints, {.1f, .35f, .1f}, options, std::uint64_t(photo));
}

double wall() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
double thread_cpu() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

void run(const fs::path& folder, std::size_t photos, const std::string& family, unsigned threads) {
  calib::TargetDesign design;
  design.family = calib::TargetFamily::by_name(family);
  calib::TargetSet set;
  set.designs = {design};
  Job job({}, threads);
  fs::create_directories(folder);
  std::vector<fs::path> files;
  for (int i = 0; i < kDistinct; ++i) files.push_back(folder / (std::to_string(i) + ".jpg"));
  parallel_for(job, kDistinct, [&](std::size_t i) {
    if (!fs::exists(files[i])) write_jpeg(files[i], photograph(design, int(i)), 95);
  });

  const calib::TargetDetector detector(set);
  std::vector<double> decode(photos), detect(photos);
  std::vector<int> found(photos), wrong(photos);
  const double start = wall();
  parallel_for(job, photos, [&](std::size_t i) {
    Job own({}, 1);
    const double t0 = thread_cpu();
    const Image photo = read_image(files[i % kDistinct]);
    const double t1 = thread_cpu();
    for (const calib::Detection& t : detector.detect(photo, own).targets) {
      bool known = false;
      for (int k = 0; k < kColumns * kRows; ++k) known |= id_of(design, int(i % kDistinct), k) == t.id;
      ++(known ? found : wrong)[i];
    }
    decode[i] = t1 - t0, detect[i] = thread_cpu() - t1;
  });
  const double took = wall() - start;
  double sum_decode = 0, sum_detect = 0;
  int sum_found = 0, sum_wrong = 0;
  for (std::size_t i = 0; i < photos; ++i)
    sum_decode += decode[i], sum_detect += detect[i], sum_found += found[i], sum_wrong += wrong[i];
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  const double n = double(photos);
  std::printf(
      "%zu photographs, %u threads: %.1f s; CPU a photograph: %.0f ms decoding, %.0f ms detecting; %d of %zu targets, "
      "%d wrong; peak memory %.0f MB\n",
      photos, job.threads(), took, 1e3 * sum_decode / n, 1e3 * sum_detect / n, sum_found, photos * kColumns * kRows,
      sum_wrong, double(usage.ru_maxrss) / 1024);
}

}  // namespace

int main(int argc, char** argv) {
  fs::path folder;
  std::size_t photos = 600;
  std::string family = "matrix5x5";
  unsigned threads = 0;
  CLI::App app("600 photographs with eight targets each through the detector");
  app.add_option("folder", folder, "where the photographs are kept")->required();
  app.add_option("--photos", photos, "how many are read")->capture_default_str();
  app.add_option("--family", family, "of the targets")->capture_default_str();
  app.add_option("--threads", threads, "0: one for each core")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(folder, photos, family, threads);
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "%s\n", e.what()), 1;
  }
}
