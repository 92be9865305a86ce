// Appearance: how fast textures are built and new views rendered, and how much memory it takes. Synthetic: a bumpy
// ball; photographs are generated, so that the disk plays no part. There is no peer in the packages that does the same;
// embree's bare primary rays on the same mesh are the floor that both renderers stand on.
//
//     bench_slf [photographs = 600] [megapixels = 0.64]

#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/lumigraph.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/renderer.h>
#include <lumihull/slf/textured_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "bumpy_ball.h"

using namespace lumihull;

using bench::fastest, bench::seconds;

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 600;
  const double megapixels = argc > 2 ? std::atof(argv[2]) : 0.64;
  if (count < 1 || !(megapixels > 0.001 && megapixels < 50)) return std::fprintf(stderr, "bad arguments\n"), 2;

  Job job;
  const hull::Mesh mesh = bench::bumpy_ball(122);  // about 60,000 triangles
  const hull::RayScene scene(mesh);
  Camera camera;
  camera.width = int(std::sqrt(megapixels * 1e6 * 1.5)), camera.height = int(camera.width / 1.5);
  camera.f = 1.7 * camera.height, camera.u0 = 0.5 * camera.width, camera.v0 = 0.5 * camera.height;
  const bench::Paint bands = [](const Eigen::Vector3f& p, int k) {
    return 127.5f + 100 * std::sin(20 * p[k] + 5 * p[(k + 1) % 3]);
  };
  const slf::PhotoSet photos = bench::photographs(scene, camera, count, 0.95, bands);
  std::printf("%d photographs of %d x %d, %zu triangles, %u threads\n", count, camera.width, camera.height,
              mesh.triangles.size(), job.threads());

  const double making =
      seconds([&] { parallel_for(job, std::size_t(std::min(count, 40)), [&](std::size_t i) { photos.read(i); }); }) *
      count / std::min(count, 40);
  reset_peak_memory();
  slf::TexturedMesh textured;
  slf::TextureReport report;
  const double building = seconds([&] { textured = slf::mean_texture(mesh, photos, {}, job, &report); });
  std::printf("texture %d x %d, %zu charts: %.1f s (%.1f s of it to generate the photographs), peak %.0f MB\n",
              textured.texture.width(), textured.texture.height(), report.charts, building, making,
              double(peak_memory_bytes()) / 1e6);

  slf::TurntableOptions path;
  path.frames = 3, path.start_deg = 11;
  const auto frames = slf::turntable(mesh, photos.views, path);
  const View view = frames[0].view;
  const slf::Photo truth = bench::photograph(scene, view, bands);
  const Image reference = slf::composited(truth.rgb, truth.alpha, {0, 0, 0});
  const auto quality = [&](const slf::Rendering& r) {
    return slf::psnr(slf::composited(r.rgba, {0, 0, 0}), reference, &truth.alpha);
  };
  for (const int rays : {1, 2, 3}) {
    const slf::RenderOptions options{rays, false};
    slf::Rendering rendering;
    const double bare = fastest(3, [&] { rendering = slf::render_shaded(mesh, scene, view, options, job); });
    const double texture = fastest(3, [&] { rendering = slf::render_texture(textured, scene, view, options, job); });
    const double texture_psnr = quality(rendering);
    reset_peak_memory();
    slf::Lumigraph lumigraph(mesh, scene, photos);
    const double cold = seconds([&] { rendering = lumigraph.render(view, options, job); });
    const double warm = fastest(3, [&] { rendering = lumigraph.render(view, options, job); });
    std::printf(
        "1280 x 720, %d x %d rays: shaded %.1f frames/s; texture %.1f, %.1f dB inside; lumigraph %.2f (first %.2f s), "
        "%.1f dB inside, peak %.0f MB\n",
        rays, rays, 1 / bare, 1 / texture, texture_psnr, 1 / warm, cold, quality(rendering),
        double(peak_memory_bytes()) / 1e6);
  }
}
