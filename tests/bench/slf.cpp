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

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numbers>

using namespace lumihull;

namespace {

double seconds(const std::function<void()>& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double fastest(int times, const std::function<void()>& body) {
  double best = seconds(body);
  for (int i = 1; i < times; ++i) best = std::min(best, seconds(body));
  return best;
}

hull::Mesh bumpy_ball(int steps) {
  hull::Mesh mesh;
  const int columns = 2 * steps;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j < columns; ++j) {
      const double a = std::numbers::pi * i / steps, b = 2 * std::numbers::pi * j / columns;
      const double r = 1 + 0.05 * std::sin(9 * b) * std::sin(a) * std::sin(7 * a);
      mesh.vertices.push_back(
          Eigen::Vector3d(r * std::sin(a) * std::cos(b), r * std::sin(a) * std::sin(b), r * std::cos(a)).cast<float>());
    }
  const auto at = [&](int i, int j) { return std::uint32_t(i * columns + j % columns); };
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < columns; ++j) {
      if (i + 1 < steps) mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      if (i > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

/// Coloured bands by the place on the surface; one ray a pixel.
slf::Photo photograph(const hull::RayScene& scene, const View& view) {
  const Camera& c = view.camera;
  slf::Photo photo{Image(c.width, c.height, 3), Image(c.width, c.height, 1)};
  const Eigen::Vector3f eye = view.center().cast<float>();
  const Eigen::Matrix3d rotation = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  std::vector<hull::Ray> rays;
  std::vector<hull::Hit> hits(std::size_t(c.width));
  for (int y = 0; y < c.height; ++y) {
    rays.clear();
    for (int x = 0; x < c.width; ++x) rays.push_back({eye, (rotation * *c.ray({x + 0.5, y + 0.5})).cast<float>()});
    scene.hit(rays, hits);
    for (int x = 0; x < c.width; ++x) {
      if (!hits[std::size_t(x)]) continue;
      const Eigen::Vector3f p = eye + hits[std::size_t(x)].t * rays[std::size_t(x)].direction;
      photo.alpha.row<std::uint8_t>(y)[x] = 255;
      for (int k = 0; k < 3; ++k)
        photo.rgb.row<std::uint8_t>(y)[3 * x + k] =
            std::uint8_t(127.5f + 100 * std::sin(20 * p[k] + 5 * p[(k + 1) % 3]));
    }
  }
  return photo;
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 600;
  const double megapixels = argc > 2 ? std::atof(argv[2]) : 0.64;
  if (count < 1 || !(megapixels > 0.001 && megapixels < 50)) return std::fprintf(stderr, "bad arguments\n"), 2;

  Job job;
  const hull::Mesh mesh = bumpy_ball(122);  // about 60,000 triangles
  const hull::RayScene scene(mesh);
  Camera camera;
  camera.width = int(std::sqrt(megapixels * 1e6 * 1.5)), camera.height = int(camera.width / 1.5);
  camera.f = 1.7 * camera.height, camera.u0 = 0.5 * camera.width, camera.v0 = 0.5 * camera.height;
  slf::PhotoSet photos;
  for (int i = 0; i < count; ++i) {  // a spiral over the sphere of directions
    const double z = 0.95 - 1.9 * (i + 0.5) / count, a = i * 2.399963, r = std::sqrt(1 - z * z);
    photos.names.push_back(std::to_string(i));
    photos.views.push_back({camera, look_at(4 * Eigen::Vector3d(r * std::cos(a), r * std::sin(a), z),
                                            Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ())});
  }
  photos.read = [&](std::size_t i) { return photograph(scene, photos.views[i]); };
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
  const slf::Photo truth = photograph(scene, view);
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
