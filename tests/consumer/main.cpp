// Uses types that cross the library's border: their layout must be the same on both sides.
#include <lumihull/base/camera.h>
#include <lumihull/base/error.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>

#include <cmath>
#include <cstdio>

int main() {
  using namespace lumihull;
  const hull::Mesh mesh{{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  const hull::Hit hit = hull::RayScene(mesh).hit({{0, 0, 5}, {0, 0, -1}});
  View view;
  view.camera = {.width = 64, .height = 48, .f = 50, .u0 = 32, .v0 = 24};
  view.cam_from_world = look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0});
  const auto pixel = view.project({0, 0, 0});
  bool caught = false;
  try {
    hull::read_mesh("absent.ply");
  } catch (const Error& e) {  // the exception's type is known across the border
    caught = e.code() == ErrorCode::not_found;
  }
  const bool good = hit && hit.t == 5 && pixel && std::abs(pixel->x() - 32) < 1e-9 && caught;
  std::puts(good ? "C++: good" : "C++: wrong");
  return good ? 0 : 1;
}
