// Fuzz target: text and binary files that describe cameras and captures. The first byte chooses the format.

#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string_view>

#include "capture_json.h"
#include "colmap_model.h"
#include "import_common.h"
#include "nerf_json.h"

namespace {

using namespace lumihull;
using namespace lumihull::internal;

void use(const ColmapModel& model) {
  for (const auto& [id, camera] : model.cameras) {
    camera.ray({0, 0});
    camera.ray({double(camera.width), double(camera.height)});
  }
  check_colmap_model(model, "fuzz");
}

/// Captures have a folder: an empty one serves all inputs, for nothing is written.
Capture empty_capture() {
  static const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("lumihull-fuzz-" + std::to_string(::getpid()));
  Capture capture = Capture::create(folder);
  std::error_code ignored;
  std::filesystem::remove(folder, ignored);
  return capture;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    ColmapModel model;
    switch (data[0] % 9) {
      case 0:
        parse_projections(text, "fuzz");
        break;
      case 1:
        parse_middlebury(text, "fuzz");
        break;
      case 2:
        parse_nerf(text, "fuzz");
        break;
      case 3:
        parse_colmap_cameras_text(text, "fuzz", model), use(model);
        break;
      case 4:
        parse_colmap_images_text(text, "fuzz", model), use(model);
        break;
      case 5:
        parse_colmap_cameras_binary(text, "fuzz", model), use(model);
        break;
      case 6:
        parse_colmap_images_binary(text, "fuzz", model), use(model);
        break;
      case 7: {
        Capture capture = empty_capture();
        parse_capture_json(text, "fuzz", capture);
        // What was read can be written and read again.
        Capture again = empty_capture();
        parse_capture_json(print_capture_json(capture, "again"), "again", again);
        if (again.shots.size() != capture.shots.size()) std::abort();
        break;
      }
      case 8: {
        Capture capture = empty_capture();
        Shot shot;
        for (const char* name : {"a", "b"}) {
          shot.name = shot.file = name;
          capture.shots.push_back(shot);
        }
        parse_cameras_json(text, "fuzz", capture);
        break;
      }
    }
  } catch (const Error& e) {
    if (e.code() == ErrorCode::internal || e.subject() == "again") std::abort();
  }
  return 0;
}
