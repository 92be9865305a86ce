// What a matt object, noisy in its photographs, looks like through the stages.

#include <lumihull/hull/simplify.h>
#include <lumihull/rig/rig_capture.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/pipeline.h>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

namespace fs = std::filesystem;

TEST(Matt, ItsLightFieldLosesNothingAgainstTheMeanTexture) {
  const test::TemporaryFolder folder;
  Job job;
  RigOptions o;
  o.object = "pebble";
  o.matt = true;
  o.photos = 24, o.empty_photos = 1, o.test_views = 8;
  o.width = 240;
  o.light = test::coarse_light();
  Capture capture = make_capture(folder / "c", o, job);
  const fs::path truth = folder / "c" / "truth";
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    capture.write_mask(i, read_image(truth / "masks" / (capture.shots[i].name + ".png")), MaskSource::imported);
  // Few enough triangles that the stage takes them as they are: both are judged on one mesh.
  hull::write_mesh(capture.hull_path(), hull::simplify(hull::read_mesh(truth / "mesh.ply"), {6000, 0}, job).mesh);
  slf::run_stage(capture, "texture", job);
  slf::run_stage(capture, "lightfield", job);

  const slf::TexturedMesh mean = slf::read_glb(folder / "c" / "textured.glb");
  const hull::RayScene scene(mean.mesh);
  const slf::LightFieldRenderer field(slf::read_light_field(folder / "c" / "light_field.glb"));
  double of_field = 0, of_mean = 0;
  const auto path = slf::read_camera_path(truth / "test_views.json");
  for (const slf::PathView& v : path) {
    const Image picture = read_image(truth / "test_views" / (v.name + ".png")),
                mask = read_image(truth / "test_views" / "masks" / (v.name + ".png"));
    const auto quality = [&](const slf::Rendering& rendering) {
      return slf::compare_pictures(slf::composited(rendering.rgba, {0, 0, 0}),
                                   slf::composited(picture, mask, {0, 0, 0}), mask)
          .psnr_inside;
    };
    of_field += quality(field.render(v.view, {.rays = 3}, job)) / double(path.size());
    of_mean += quality(slf::render_texture(mean, scene, v.view, {.rays = 3}, job)) / double(path.size());
  }
  EXPECT_GT(of_mean, 30);
  EXPECT_GT(of_field, of_mean - 0.05) << of_field << " dB, mean texture " << of_mean << " dB";
}

}  // namespace
}  // namespace lumihull::rig
