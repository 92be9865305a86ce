#include "truth.h"

#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>

#include <nlohmann/json.hpp>

namespace lumihull::rig {

using Json = nlohmann::ordered_json;

namespace {

Json numbers(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }
Json numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json camera_fields(const Camera& c) {
  return {{"width", c.width}, {"height", c.height}, {"f", c.f},   {"s", c.s},   {"skew", c.skew}, {"u0", c.u0},
          {"v0", c.v0},       {"k1", c.k1},         {"k2", c.k2}, {"k3", c.k3}, {"p1", c.p1},     {"p2", c.p2}};
}

Json document(const char* format) { return {{"format", format}, {"version", 1}}; }

void write(const std::filesystem::path& file, const Json& json) { write_file(file, json.dump(1) + "\n"); }

}  // namespace

void write_camera_truth(const std::filesystem::path& file, const Scene& scene, const Camera& camera,
                        const NamedShots& shots) {
  Json json = document("lumihull-rig-truth");
  json["unit"] = "m";
  json["camera"] = camera_fields(camera);
  const auto [low, high] = bounding_box(scene.objects[0].mesh);
  json["object"] = {{"name", scene.objects[0].name}, {"low", numbers(low)}, {"high", numbers(high)}};
  json["lamps"] = Json::array();
  for (const Lamp& lamp : scene.lamps)
    json["lamps"].push_back(
        {{"position", numbers(lamp.position)}, {"radius", lamp.radius}, {"intensity", numbers(lamp.intensity)}});
  json["views"] = Json::array();
  for (std::size_t i = 0; i < shots.names.size(); ++i) {
    const auto m = shots.cam_from_world[i].matrix();
    Json rows = Json::array();
    for (int r = 0; r < 3; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
    json["views"].push_back({{"name", shots.names[i]}, {"cam_from_world", rows}});
  }
  write(file, json);
}

void write_target_truth(const std::filesystem::path& file, const std::vector<PlacedTarget>& targets) {
  Json json = document("lumihull-rig-targets");
  json["targets"] = Json::array();
  for (const PlacedTarget& t : targets) {
    const Eigen::Quaterniond& q = t.world_from_target.rotation;
    json["targets"].push_back(
        {{"design", t.design},
         {"id", t.id},
         {"world_from_target",
          {{"q", {q.w(), q.x(), q.y(), q.z()}}, {"t", numbers(t.world_from_target.translation)}}}});
  }
  write(file, json);
}

void write_highlights(const std::filesystem::path& file, const HighlightFinder& finder, const Camera& camera,
                      const NamedShots& shots, double exposure, Job& job) {
  std::vector<std::vector<Highlight>> found(shots.names.size());
  job.begin("true highlights", found.size());
  parallel_for(
      job, found.size(),
      [&](std::size_t i) {
        found[i] = finder.find({camera, shots.cam_from_world[i]});
      },
      true);
  job.end();
  Json json = document("lumihull-highlights");
  json["shots"] = Json::array();
  for (std::size_t i = 0; i < found.size(); ++i) {
    Json list = Json::array();
    for (const Highlight& h : found[i])
      list.push_back({{"lamp", h.lamp},
                      {"point", numbers(h.point)},
                      {"pixel", {h.pixel.x(), h.pixel.y()}},
                      {"strength", h.strength * exposure}});
    json["shots"].push_back({{"name", shots.names[i]}, {"highlights", list}});
  }
  write(file, json);
}

void photograph_highlights(const std::filesystem::path& folder, const Photographer& photographer, const Camera& camera,
                           const NamedShots& shots, const PhotoOptions& options, Job& job) {
  namespace fs = std::filesystem;
  constexpr std::pair<const char*, Shown> kParts[] = {{"without_highlights", Shown::without_highlights},
                                                      {"highlights", Shown::highlights_alone}};
  for (const auto& [name, shown] : kParts) fs::create_directories(folder / name);
  job.begin("pictures of highlights", 2 * shots.names.size());
  parallel_for(
      job, 2 * shots.names.size(),
      [&](std::size_t i) {
        const auto& [name, shown] = kParts[i % 2];
        const fs::path file = folder / name / (shots.names[i / 2] + ".png");
        if (fs::exists(file)) return;
        PhotoOptions part = options;
        part.shown = shown;
        Job alone({}, 1);
        write_png(file, photographer.photograph({camera, shots.cam_from_world[i / 2]}, part, 0, alone).picture);
      },
      true);
  job.end();
}

void write_camera_path(const std::filesystem::path& file, const Camera& camera, const NamedShots& shots) {
  Json json = document("lumihull-camera-path");
  json["views"] = Json::array();
  for (std::size_t i = 0; i < shots.names.size(); ++i) {
    Json view{{"name", shots.names[i]}};
    view.update(camera_fields(camera));
    const Eigen::Quaterniond& q = shots.cam_from_world[i].rotation;
    view["cam_from_world"] = {{"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
                              {"translation", numbers(shots.cam_from_world[i].translation)}};
    json["views"].push_back(view);
  }
  write(file, json);
}

}  // namespace lumihull::rig
