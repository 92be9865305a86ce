// Opens a capture, makes its model where that is not up to date, and renders eight views around the object.
#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/lumigraph.h>
#include <lumihull/slf/pipeline.h>

#include <cstdio>

int main(int argc, char** argv) try {
  using namespace lumihull;
  if (argc != 2) return 2;
  Job job;
  Capture capture = Capture::open(argv[1]);
  slf::run(capture, job);

  const hull::Mesh mesh = hull::read_mesh(capture.hull_path());
  const hull::RayScene scene(mesh);
  const slf::PhotoSet photos = slf::photos_of(capture, slf::training_shots(capture));
  slf::Lumigraph lumigraph(mesh, scene, photos);
  for (const auto& [name, view] : slf::turntable(mesh, photos.views, {.frames = 8, .width = 320, .height = 240})) {
    write_png(name + ".png", lumigraph.render(view, {}, job).rgba);
    std::puts((name + ".png").c_str());
  }
} catch (const lumihull::Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
