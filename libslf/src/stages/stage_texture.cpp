#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/textured_mesh.h>

#include <cstdio>

#include "stage.h"

namespace lumihull::slf {

namespace {

bool present(const Capture& capture) { return file_exists(textured_path(capture)); }

std::vector<std::string> run(Capture& capture, Job& job) {
  const hull::Mesh mesh = hull::read_mesh(capture.hull_path());
  TextureOptions options;
  options.max_side = int(effective<std::int64_t>(capture, "texture", "max_side"));
  options.texel_px = effective<double>(capture, "texture", "texel_px");
  GlbOptions file_options;
  file_options.jpeg_quality = int(effective<std::int64_t>(capture, "texture", "jpeg_quality"));

  TextureReport report;
  const TexturedMesh textured = mean_texture(mesh, photos_of(capture, training_shots(capture)), options, job, &report);
  const std::uint64_t bytes = write_glb(textured_path(capture), textured, file_options);
  char line[160];
  std::snprintf(line, sizeof line, "texture of %d x %d, %.1f %% of the surface unseen; textured.glb of %.2f MB",
                textured.texture.width(), textured.texture.height(), 100 * report.filled_share, double(bytes) / 1e6);
  return {line};
}

}  // namespace

const StageDefinition& texture_stage() {
  static const TextureOptions defaults;
  static const StageDefinition stage{
      "texture",
      2,
      {
          {"max_side", "largest width and height of the texture, px", std::int64_t(defaults.max_side), 64, 16384},
          {"texel_px", "size of a texel in pixels of the photographs", defaults.texel_px, 0.1, 100},
          {"jpeg_quality", "of the texture in textured.glb, 1 to 100; 0: PNG, without loss",
           std::int64_t(GlbOptions{}.jpeg_quality), 0, 100},
      },
      always_needed,
      add_surface_inputs,
      present,
      run};
  return stage;
}

}  // namespace lumihull::slf
