#include <lumihull/base/error.h>
#include <lumihull/calib/color_key.h>
#include <lumihull/calib/despill.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/simplify.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/results.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "stage.h"

namespace lumihull::slf {

namespace {

constexpr std::int64_t kTriangles = 20000;

std::filesystem::path key_path(const Capture& capture) { return capture.folder() / "key.json"; }

void inputs(const Capture& capture, InputDigest& digest) {
  add_surface_inputs(capture, digest);
  if (effective<double>(capture, "lightfield", "despill") > 0) digest.add_file("key", key_path(capture));
}

/// The photographs that the light field is made from, as the options want them.
PhotoSet photographs(const Capture& capture, Job& job) {
  PhotoSet photos = photos_of(capture, training_shots(capture));
  const auto strength = effective<double>(capture, "lightfield", "despill");
  if (!(strength > 0)) return photos;
  if (!file_exists(key_path(capture)))
    throw Error(ErrorCode::not_found, "despill takes the enclosure's hue from here; run `lumihull key` first",
                key_path(capture).string());
  const calib::ColorKey key = calib::ColorKey::load(key_path(capture), job);
  return despilled(std::move(photos), calib::Despill(key.background()), float(strength));
}

bool present(const Capture& capture) { return file_exists(light_field_path(capture)); }

std::vector<std::string> run(Capture& capture, Job& job) {
  const auto integer = [&](std::string_view name) { return int(effective<std::int64_t>(capture, "lightfield", name)); };
  hull::Mesh mesh = read_hull(capture);
  const auto triangles = effective<std::int64_t>(capture, "lightfield", "triangles");
  if (triangles > 0 && mesh.triangles.size() > std::size_t(triangles))
    mesh = hull::simplify(mesh, {std::size_t(triangles), 0}, job).mesh;

  LightFieldOptions options;
  const auto factorization = effective<std::string>(capture, "lightfield", "factorization");
  options.method = factorization == "pca"   ? Factorization::pca
                   : factorization == "nmf" ? Factorization::nmf
                                            : Factorization::joint;
  options.terms = integer("terms");
  options.max_nodes = integer("nodes");
  options.max_side = integer("map_side");
  options.texel_px = effective<double>(capture, "lightfield", "map_px");
  options.reflections = effective<bool>(capture, "lightfield", "reflections");
  options.even_exposure = effective<bool>(capture, "lightfield", "even_exposure");
  LightFieldFileOptions file_options;
  file_options.texture_quality = integer("texture_quality");
  file_options.map_quality = integer("map_quality");

  LightFieldReport report;
  const LightField field = fit_light_field(mesh, photographs(capture, job), options, job, &report);
  const std::uint64_t bytes = write_light_field(light_field_path(capture), field, file_options);
  std::vector<std::string> said;
  char line[200];
  std::snprintf(line, sizeof line, "%zu triangles, %zu terms of %d x %d, %zu nodes; light_field.glb of %.2f MB",
                field.base.mesh.triangles.size(), field.terms.size(), field.base.texture.width(),
                field.base.texture.height(), field.nodes.size(), double(bytes) / 1e6);
  said.emplace_back(line);
  std::snprintf(line, sizeof line,
                "%.1f million samples, met to %.1f of 255 (mean colour alone: %.1f); %.1f %% of the surface unseen",
                double(report.samples) / 1e6, 255 * report.rms, 255 * report.rms_of_mean, 100 * report.unseen_share);
  said.emplace_back(line);
  if (options.reflections) {
    std::snprintf(line, sizeof line,
                  "mirroring explains %.1f %% of what changes with the direction at left-out photographs: %s",
                  100 * report.reflection_share, field.reflection ? "kept" : "left out");
    said.emplace_back(line);
  }
  if (!report.gains.empty()) {
    float least = report.gains[0].minCoeff(), most = report.gains[0].maxCoeff();
    for (const auto& g : report.gains) least = std::min(least, g.minCoeff()), most = std::max(most, g.maxCoeff());
    std::snprintf(line, sizeof line,
                  "exposures evened out: photographs were %.2f to %.2f times as bright as their mean", double(least),
                  double(most));
    said.emplace_back(line);
  }
  return said;
}

}  // namespace

std::filesystem::path light_field_path(const Capture& capture) { return capture.folder() / "light_field.glb"; }

const StageDefinition& lightfield_stage() {
  static const LightFieldOptions defaults;
  static const LightFieldFileOptions file_defaults;
  static const StageDefinition stage{
      "lightfield",
      5,
      {
          {"factorization",
           "joint (all vertices together), pca or nmf (each vertex's ring of triangles by itself)",
           std::string("joint"),
           0,
           0,
           {"joint", "pca", "nmf"}},
          {"terms", "products beyond the mean colour", std::int64_t(defaults.terms), 0, kMaxTerms},
          {"triangles", "simplify the hull to at most so many; 0: as it is", kTriangles, 0, 1e9},
          {"map_px", "size of a texel of the surface maps in pixels of the photographs", defaults.texel_px, 0.1, 100},
          {"map_side", "largest width and height of the surface maps, px", std::int64_t(defaults.max_side), 64, 16384},
          {"nodes", "places where view maps have values, at most", std::int64_t(defaults.max_nodes), 4, kMaxNodes},
          {"reflections", "look for what all places mirror alike (joint)", defaults.reflections},
          {"even_exposure", "even out exposure and white balance between the photographs", defaults.even_exposure},
          {"despill", "share of the enclosure's hue that is taken off the photographs, 0 to 1; needs key.json", 0.0, 0,
           1},
          {"texture_quality", "of the mean colour's JPEG, 1 to 100; 0: PNG, without loss",
           std::int64_t(file_defaults.texture_quality), 0, 100},
          {"map_quality", "of the surface maps' JPEGs, 1 to 100; 0: PNG, without loss",
           std::int64_t(file_defaults.map_quality), 0, 100},
      },
      always_needed,
      inputs,
      present,
      run};
  return stage;
}

}  // namespace lumihull::slf
