// Carving beside brute force over the same fields and Open3D's VoxelGrid::CarveSilhouette, in one run.
//
//     bench_hull [views = 600] [side = 800] [resolutions = 150 256 512 1024]
//
// The peers are too slow for the whole: brute force is timed on a sample of slabs, Open3D on a few views, and scaled.

#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/hull/carve.h>
#include <lumihull/hull/mesh_check.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/hull/region.h>
#include <open3d/camera/PinholeCameraParameters.h>
#include <open3d/geometry/Image.h>
#include <open3d/geometry/VoxelGrid.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "../hull/synthetic.h"

namespace {

using namespace lumihull;

double wall() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double cpu() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Timer {
  double wall_start = wall(), cpu_start = cpu();
  double wall_s() const { return wall() - wall_start; }
  double cpu_s() const { return cpu() - cpu_start; }
};

/// Seconds of Open3D for one view at a resolution, and how many voxels it leaves after all the views it was given.
double open3d_seconds(const std::vector<View>& views, const std::vector<Image>& masks, const hull::Grid& grid,
                      std::size_t sample) {
  auto voxels = open3d::geometry::VoxelGrid::CreateDense(grid.region.min, {1, 1, 1}, grid.voxel, grid.region.size().x(),
                                                         grid.region.size().y(), grid.region.size().z());
  std::vector<open3d::geometry::Image> images(sample);
  std::vector<open3d::camera::PinholeCameraParameters> parameters(sample);
  for (std::size_t k = 0; k < sample; ++k) {
    const std::size_t i = k * views.size() / sample;
    const Camera& c = views[i].camera;
    images[k].Prepare(c.width, c.height, 1, 4);
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x)
        *images[k].PointerAt<float>(x, y) = masks[i].row<std::uint8_t>(y)[x] >= 128 ? 1.f : 0.f;
    // Its first pixel's centre is (0, 0).
    parameters[k].intrinsic_ =
        open3d::camera::PinholeCameraIntrinsic(c.width, c.height, c.s * c.f, c.f, c.u0 - 0.5, c.v0 - 0.5);
    parameters[k].extrinsic_.setIdentity();
    parameters[k].extrinsic_.topRows<3>() = views[i].cam_from_world.matrix();
  }
  const Timer timer;
  for (std::size_t k = 0; k < sample; ++k) voxels->CarveSilhouette(images[k], parameters[k], true);
  return timer.cpu_s() / double(sample);
}

/// Mean over some of the views of what the mesh's silhouettes and the true masks share: by coverage, sum of the lesser
/// over sum of the greater, and thresholded at one half.
struct Iou {
  double coverage = 0, thresholded = 0, lowest = 1;  ///< lowest: coverage, of a single view
};

Iou silhouette_iou(const hull::Mesh& mesh, const std::vector<View>& views, const std::vector<Image>& masks, Job& job) {
  constexpr std::size_t kViews = 12;
  const hull::RayScene scene(mesh);
  const test::Shape shape = [&](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
    return scene.occluded({origin.cast<float>(), direction.cast<float>()});
  };
  std::vector<Iou> of(std::min(kViews, views.size()));
  parallel_for(job, of.size(), [&](std::size_t k) {
    const std::size_t i = k * views.size() / of.size();
    const Image rendered = test::mask_of(shape, views[i]);
    double least = 0, most = 0, both = 0, either = 0;
    for (int y = 0; y < rendered.height(); ++y)
      for (int x = 0; x < rendered.width(); ++x) {
        const int a = rendered.row<std::uint8_t>(y)[x], b = masks[i].row<std::uint8_t>(y)[x];
        least += std::min(a, b), most += std::max(a, b);
        both += a >= 128 && b >= 128, either += a >= 128 || b >= 128;
      }
    of[k] = {least / most, both / either, least / most};
  });
  Iou mean;
  for (const Iou& one : of) {
    mean.coverage += one.coverage / double(of.size());
    mean.thresholded += one.thresholded / double(of.size());
    mean.lowest = std::min(mean.lowest, one.lowest);
  }
  return mean;
}

}  // namespace

int main(int argc, char** argv) {
  const int n = argc > 1 ? std::atoi(argv[1]) : 600, side = argc > 2 ? std::atoi(argv[2]) : 800;
  std::vector<int> resolutions;
  for (int i = 3; i < argc; ++i) resolutions.push_back(std::atoi(argv[i]));
  if (resolutions.empty()) resolutions = {150, 256, 512, 1024};
  const auto object = test::either({test::sphere({0, 0, 0}, 0.8), test::box({0.7, 0, 0}, {0.5, 0.25, 0.15}),
                                    test::capsule({0, 0, 0.5}, {0.2, 0.8, 1.1}, 0.12),
                                    test::capsule({-0.5, 0, 0}, {-0.9, -0.7, 0.4}, 0.08)});
  const std::vector<View> views = test::views_around(test::pinhole(side, side, 1.25 * side), n, 4);
  std::vector<Image> masks(views.size());
  Job job;
  parallel_for(job, views.size(), [&](std::size_t i) { masks[i] = test::mask_of(object, views[i]); });
  std::printf(
      "%d masks of %d x %d, %u threads. cpu: seconds of all threads, which other work on the machine disturbs least.\n",
      n, side, side, job.threads());

  for (const int resolution : resolutions) {
    reset_peak_memory();
    const std::uint64_t before = peak_memory_bytes();
    std::printf("\n%d voxels along the longest side\n", resolution);
    Timer timer;
    const std::vector<hull::Silhouette> silhouettes = hull::make_silhouettes(
        views, [&](std::size_t i) { return masks[i]; }, std::nullopt, resolution, {}, {}, job);
    std::size_t bytes = 0;
    for (const hull::Silhouette& s : silhouettes) bytes += s.bytes();
    std::printf("  distance fields     wall %8.2f s   cpu %8.2f s   %.1f MB\n", timer.wall_s(), timer.cpu_s(),
                double(bytes) / 1e6);
    timer = {};
    const hull::Box region = hull::find_region(views, silhouettes, {}, {}, job);
    std::printf("  region              wall %8.2f s   cpu %8.2f s\n", timer.wall_s(), timer.cpu_s());

    hull::CarveOptions options;
    options.resolution = resolution;
    options.region = region;
    timer = {};
    const hull::CarveResult result = hull::carve(views, silhouettes, options, job);
    const double ours_wall = timer.wall_s(), ours = timer.cpu_s();
    const hull::CarveStatistics& s = result.statistics;
    std::printf(
        "  carve               wall %8.2f s   cpu %8.2f s   (field %.2f, mesh %.2f s)   %.1f million view-samples\n",
        ours_wall, ours, s.field_seconds, s.mesh_seconds, double(s.views_evaluated) / 1e6);
    std::printf("  peak memory above the masks: %.0f MB; field %.1f MB; band %.2f voxels\n",
                double(peak_memory_bytes() - std::min(before, peak_memory_bytes())) / 1e6, double(s.field_bytes) / 1e6,
                s.least_band_voxels);
    const hull::MeshCheck check = hull::check_mesh(result.mesh, resolution <= 256);
    std::printf("  mesh: %zu triangles, %s, volume %.5f", result.mesh.triangles.size(),
                check.good() ? "good" : "NOT good", check.volume);
    if (check.self_intersections) std::printf(", %zu self-intersections", *check.self_intersections);
    std::printf("\n");

    const Iou iou = silhouette_iou(result.mesh, views, masks, job);
    std::printf("  silhouettes' IoU with the true masks: %.4f by coverage (lowest %.4f), %.4f thresholded\n",
                iou.coverage, iou.lowest, iou.thresholded);

    // Brute force: all views at every sample, on a sample of the slabs.
    const hull::HullFunction function(views, silhouettes);
    const hull::Field field = hull::sample_field(function, result.grid, job);
    const int slabs = std::max(1, 2'000'000 / (result.grid.size[0] * result.grid.size[1]) / 4);
    const int step = std::max(1, result.grid.size[2] / slabs);
    std::vector<std::size_t> differing(std::size_t(result.grid.size[2]));
    std::size_t samples = 0;
    for (int k = step / 2; k < result.grid.size[2]; k += step)
      samples += std::size_t(result.grid.size[0]) * result.grid.size[1];
    timer = {};
    parallel_for(job, differing.size(), [&](std::size_t k) {
      if (int(k) % step != step / 2) return;
      for (int j = 0; j < result.grid.size[1]; ++j)
        for (int i = 0; i < result.grid.size[0]; ++i)
          differing[k] += (function(result.grid.sample(i, j, int(k))) < 0) != field.inside(i, j, int(k));
    });
    std::size_t signs = 0;
    for (const std::size_t d : differing) signs += d;
    const double all = double(result.grid.size[0]) * result.grid.size[1] * result.grid.size[2];
    const double brute = timer.cpu_s() * all / double(samples);
    std::printf(
        "  brute force         cpu %8.1f s (on %.1f %% of the samples, scaled)   %.0f x ours   signs differing: %zu of "
        "%zu\n",
        brute, 100 * double(samples) / all, brute / ours, signs, samples);
    if (resolution <= 256) {
      const std::size_t sample = 2;
      const double open3d = open3d_seconds(views, masks, result.grid, sample) * double(views.size());
      std::printf("  Open3D              cpu %8.1f s (%zu views, scaled)   %.0f x ours\n", open3d, sample,
                  open3d / ours);
    }
    std::fflush(stdout);
  }
}
