// COLMAP models into a capture.

#include <lumihull/base/files.h>

#include <map>

#include "colmap_model.h"
#include "import_common.h"

namespace lumihull {

namespace fs = std::filesystem;

namespace {

internal::ColmapModel read_model(const fs::path& folder) {
  using namespace internal;
  const auto both = [&](const char* extension) {
    std::error_code ignored;
    return fs::exists(folder / (std::string("cameras") + extension), ignored) &&
           fs::exists(folder / (std::string("images") + extension), ignored);
  };
  constexpr std::size_t kMaxBytes = std::size_t(4) << 30;
  ColmapModel model;
  if (both(".bin")) {
    const fs::path cameras = folder / "cameras.bin", images = folder / "images.bin";
    parse_colmap_cameras_binary(read_file(cameras, kMaxBytes), cameras.string(), model);
    parse_colmap_images_binary(read_file(images, kMaxBytes), images.string(), model);
    check_colmap_model(model, images.string());
  } else if (both(".txt")) {
    const fs::path cameras = folder / "cameras.txt", images = folder / "images.txt";
    parse_colmap_cameras_text(read_file(cameras, kMaxBytes), cameras.string(), model);
    parse_colmap_images_text(read_file(images, kMaxBytes), images.string(), model);
    check_colmap_model(model, images.string());
  } else {
    throw Error(ErrorCode::not_found,
                "no COLMAP model: expected cameras.bin and images.bin, or cameras.txt and images.txt", folder.string());
  }
  return model;
}

}  // namespace

Capture import_colmap(const fs::path& model_folder, const fs::path& photo_folder, const RefitImportOptions& options,
                      Job& job) {
  using namespace internal;
  check_output(options.output);
  const ColmapModel model = read_model(model_folder);

  Imported imported;
  std::map<std::int64_t, int> index;
  for (const ColmapImage& image : model.images) {
    job.check();
    const auto [at, is_new] = index.emplace(image.camera, int(imported.cameras.size()));
    if (is_new) {
      const ForwardCamera& theirs = model.cameras.at(image.camera);
      const std::string name = "camera " + std::to_string(image.camera) + " of " + model_folder.string();
      const Refit refit = refit_camera(theirs, options.max_refit_error_px, name);
      if (theirs.lens != ForwardCamera::Lens::none) imported.notes.push_back(refit_note(at->second, refit));
      imported.cameras.push_back(refit.camera);
    }
    imported.photos.push_back({photo_folder / image.name, at->second, image.cam_from_world});
  }
  std::vector<fs::path> files;
  for (const ImportedPhoto& photo : imported.photos) files.push_back(photo.file);
  const std::vector<ImageInfo> infos = read_infos(files, job);
  return build_capture(std::move(imported), infos, options, job);
}

}  // namespace lumihull
