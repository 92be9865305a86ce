// The paper's four objects (table 1, figures 6, 7 and 10), and two questions about appearance.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/slf/pipeline.h>

#include "model.h"

namespace lumihull::experiments {
namespace {

namespace fs = std::filesystem;

struct PaperObject {
  const char *name, *object;
  double size_m;  ///< longest side
  int photos;
  double radius_m, focal_mm;
};

constexpr PaperObject kObjects[] = {{"snowmobile", "snowmobile", 2.8, 600, 2.7, 10},
                                    {"deer_head", "deer", 1.0, 105, 1.5, 18},
                                    {"bust", "bust", 0.7, 212, 1.5, 18},
                                    {"small_statue", "statue", 0.2, 242, 0.8, 18}};

rig::SimulateOptions options_of(const PaperObject& o, const Size& size) {
  rig::SimulateOptions s;
  s.object = o.object;
  s.size_m = o.size_m;
  s.photos = size.photos(o.photos);
  s.radius_m = o.radius_m;
  s.focal_mm = o.focal_mm;
  s.width = size.width();
  s.circle_px = size.circle_px();
  s.density = size.density();
  s.lens_photos = 0;
  s.empty_photos = 6;
  s.test_views = 8;
  s.photo.blur_px = 0.6;
  s.photo.reduce = size.full ? 2 : 1;
  return s;
}

Json photograph_and_model(const PaperObject& o, const fs::path& folder, const Size& size, Job& job) {
  Json out = model_of(folder / "capture", options_of(o, size), job);
  out["object"] = {
      {"paper_photographs", o.photos}, {"paper_radius_m", o.radius_m}, {"size_m", o.size_m}, {"focal_mm", o.focal_mm}};
  const Image strip = overview(Capture::open(folder / "capture"), job);
  if (!strip.empty()) write_jpeg(folder / "overview.jpg", strip, 80);
  return out;
}

}  // namespace

std::vector<Experiment> object_experiments() {
  std::vector<Experiment> list;
  for (const PaperObject& o : kObjects)
    list.push_back({o.name, std::string(o.name) + " (table 1, figure 10)",
                    [&o](const fs::path& folder, const Size& size, Job& job) {
                      return photograph_and_model(o, folder, size, job);
                    }});
  return list;
}

Json measure_gloss(const fs::path& folder, const Size& size, Job& job) {
  rig::SimulateOptions s = options_of(kObjects[2], size);
  s.object = "pebble";
  s.size_m = 0.6;
  s.photos = size.full ? 212 : 60;
  s.test_views = 24;
  Json out = model_of(folder / "capture", s, job);
  const fs::path pictures = folder / "capture" / "evaluate" / "test_views";
  // Truth | light field | mean colour at three moments of the highlight's way.
  std::vector<Image> strips;
  for (const char* view : {"test_0004", "test_0012", "test_0020"}) {
    std::vector<Image> row;
    for (const char* method : {"light_field", "mean_texture"}) {
      const fs::path file = pictures / (std::string(view) + "." + method + ".png");
      std::error_code ignored;
      if (!fs::exists(file, ignored)) continue;
      const Image three = read_image(file, {.channels = 3});
      const int w = three.width() / 3;
      for (const int part : {0, 1}) {
        if (part == 0 && !row.empty()) continue;
        Image one(w, three.height(), 3);
        for (int y = 0; y < three.height(); ++y)
          std::copy_n(three.row<std::uint8_t>(y) + 3 * w * part, 3 * w, one.row<std::uint8_t>(y));
        row.push_back(std::move(one));
      }
    }
    if (!row.empty()) strips.push_back(side_by_side(row, 150));
  }
  if (!strips.empty()) write_jpeg(folder / "highlights.jpg", side_by_side(strips, 150), 85);
  return out;
}

Json measure_bleeding(const fs::path& folder, const Size& size, Job& job) {
  // The same photographs, with the enclosure's hue taken off and without: white paint shows it best.
  rig::SimulateOptions s = options_of(kObjects[2], size);
  s.uniform = true;
  s.test_views = 0;
  Json out;
  std::vector<Image> pictures;
  const Json plain = model_of(folder / "capture", s, job);
  for (const double share : {0.0, 1.0}) {
    Capture capture = Capture::open(folder / "capture");
    slf::set_option(capture, "lightfield", "despill", share);
    capture.save();
    slf::run_stage(capture, "lightfield", job);
    pictures.push_back(overview(capture, job));
    out[share > 0 ? "despilled" : "as_photographed"] = Json::object();
  }
  out["truth"] = plain.at("truth");
  write_jpeg(folder / "as_photographed.jpg", pictures[0], 80);
  write_jpeg(folder / "despilled.jpg", pictures[1], 80);
  return out;
}

}  // namespace lumihull::experiments
