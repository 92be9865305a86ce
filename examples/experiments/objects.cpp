// The paper's four objects (table 1, figures 6, 7 and 10), and two questions about appearance.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/capture_renderer.h>
#include <lumihull/slf/pipeline.h>

#include <algorithm>
#include <span>

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
  // The lamps' bright spots on the walls are seen in few views, and what the key does not know it keeps as object.
  s.empty_photos = 24;
  s.test_views = 8;
  s.photo.blur_px = 0.6;
  s.photo.reduce = size.full ? 2 : 1;
  return s;
}

Json photograph_and_model(const PaperObject& o, const fs::path& folder, const Size& size, Job& job) {
  Json out = model_of(folder / "capture", options_of(o, size), size, job);
  out["object"] = {
      {"paper_photographs", o.photos}, {"paper_radius_m", o.radius_m}, {"size_m", o.size_m}, {"focal_mm", o.focal_mm}};
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

namespace {

/// Truth, light field and mean colour at three moments of a highlight's way, from the comparison's pictures.
Image highlight_strip(const fs::path& pictures, std::span<const char* const> views) {
  std::vector<Image> rows;
  for (const char* view : views) {
    std::vector<Image> row;
    for (const char* method : {"light_field", "mean_texture"}) {
      const fs::path file = pictures / (std::string(view) + "." + method + ".png");
      std::error_code ignored;
      if (!fs::exists(file, ignored)) continue;
      const Image three = read_image(file, {.channels = 3});  // truth, rendering, difference
      const int w = three.width() / 3;
      for (const int part : {0, 1}) {
        if (part == 0 && !row.empty()) continue;
        Image one(w / 2, three.height(), 3);  // the middle: the object does not fill the picture
        for (int y = 0; y < three.height(); ++y)
          std::copy_n(three.row<std::uint8_t>(y) + 3 * (w * part + w / 4), 3 * (w / 2), one.row<std::uint8_t>(y));
        row.push_back(std::move(one));
      }
    }
    if (!row.empty()) rows.push_back(side_by_side(row, 160));
  }
  return rows.empty() ? Image() : side_by_side(rows, 160);
}

/// The bust without sheets and with known cameras: what is left is keying, hull and appearance.
rig::SimulateOptions alone(const Size& size) {
  rig::SimulateOptions s = options_of(kObjects[2], size);
  s.sheets = false;
  s.known_cameras = true;
  return s;
}

}  // namespace

Json measure_gloss(const fs::path& folder, const Size& size, Job& job) {
  Json out;
  for (const char* object : {"bust", "pebble"}) {
    rig::SimulateOptions s = alone(size);
    s.object = object;
    s.photos = size.full ? 212 : 40;
    if (!size.full) s.width = 720;
    s.test_views = size.full ? 24 : 12;
    out[object] = model_of(folder / object, s, size, job);
    constexpr const char* kViews[] = {"test_0003", "test_0006", "test_0009"};
    const Image strip = highlight_strip(folder / object / "evaluate" / "test_views", kViews);
    if (!strip.empty()) write_jpeg(folder / (std::string(object) + "_highlights.jpg"), strip, 85);
  }
  return out;
}

Json measure_bleeding(const fs::path& folder, const Size& size, Job& job) {
  // The same photographs with the enclosure's hue taken off and without; one paint all over shows it best.
  rig::SimulateOptions s = alone(size);
  s.uniform = true;
  s.test_views = 0;
  Json out = model_of(folder / "capture", s, size, job);
  std::vector<Image> pictures;
  for (const double share : {0.0, 1.0}) {
    Capture capture = Capture::open(folder / "capture");
    slf::set_option(capture, "lightfield", "despill", share);
    capture.save();
    slf::run_stage(capture, "lightfield", job);
    slf::CaptureRenderer renderer(capture, "light_field");
    slf::TurntableOptions turn;
    turn.frames = 6, turn.width = 300, turn.height = 400, turn.elevation_deg = 10;
    for (const std::size_t frame : {1u, 4u})
      pictures.push_back(renderer.render(renderer.turntable(turn).at(frame).view, {3, false}, job).rgba);
  }
  write_jpeg(folder / "bleeding.jpg", side_by_side(pictures, 300), 85);
  // How green the object is in these pictures: mean of G - (R + B) / 2 where it is.
  const auto green = [&](std::size_t first) {
    double sum = 0;
    std::size_t n = 0;
    for (std::size_t k = first; k < first + 2; ++k)
      for (int y = 0; y < pictures[k].height(); ++y)
        for (int x = 0; x < pictures[k].width(); ++x) {
          const std::uint8_t* p = pictures[k].row<std::uint8_t>(y) + 4 * x;
          if (p[3] == 255) sum += p[1] - 0.5 * (p[0] + p[2]), ++n;
        }
    return n ? sum / double(n) : 0;
  };
  out["green_excess"] = {{"as_photographed", green(0)}, {"despilled", green(2)}};
  return out;
}

}  // namespace lumihull::experiments
