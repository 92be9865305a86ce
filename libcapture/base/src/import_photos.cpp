// Plain photographs: cameras from EXIF, no poses.

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "import_common.h"

namespace lumihull {

HeaderCamera camera_of_header(const ImageInfo& info) {
  HeaderCamera out;
  Camera& camera = out.camera;
  camera.width = info.width;
  camera.height = info.height;
  camera.u0 = info.width / 2.0;
  camera.v0 = info.height / 2.0;
  out.f_known = info.focal_length_35mm_mm.has_value();
  camera.f = out.f_known ? *info.focal_length_35mm_mm / std::hypot(36.0, 24.0) * std::hypot(info.width, info.height)
                         : 1.2 * std::max(info.width, info.height);
  return out;
}

Capture import_photos(std::span<const std::filesystem::path> files, const ImportOptions& options, Job& job) {
  using namespace internal;
  check_output(options.output);
  std::vector<std::filesystem::path> photos(files.begin(), files.end());
  const std::vector<ImageInfo> infos = read_infos(photos, job);

  Imported imported;
  std::map<std::tuple<int, int, std::string, std::string, double, double>, int> known;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const ImageInfo& info = infos[i];
    const auto key = std::make_tuple(info.width, info.height, info.make, info.model, info.focal_length_mm.value_or(0),
                                     info.focal_length_35mm_mm.value_or(0));
    const auto [entry, is_new] = known.emplace(key, int(imported.cameras.size()));
    if (is_new) {
      const auto [camera, f_known] = camera_of_header(info);
      const std::string title = "camera " + std::to_string(entry->second);
      imported.notes.push_back(title + (f_known ? ": f from EXIF's 35 mm equivalent; calibrate it for anything exact"
                                                : ": f is a guess (1.2 times the longer side): its photographs' EXIF "
                                                  "does not give a 35 mm equivalent focal length"));
      imported.cameras.push_back(camera);
    }
    imported.photos.push_back({photos[i], entry->second, std::nullopt});
  }
  return build_capture(std::move(imported), infos, options, job);
}

}  // namespace lumihull
