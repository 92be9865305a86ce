// A folder of masks into a capture that exists.

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <array>
#include <map>

#include "import_common.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  constexpr std::array<std::string_view, 10> kKnown = {".png", ".jpg",  ".jpeg", ".tif", ".tiff",
                                                       ".bmp", ".webp", ".pgm",  ".tga", ".gif"};
  return std::find(kKnown.begin(), kKnown.end(), extension) != kKnown.end();
}

Image read_mask_file(const fs::path& file, const Camera& camera) {
  const Image picture = read_image(file);
  const Image p = converted(picture, PixelType::u8, picture.channels());
  if (p.width() != camera.width || p.height() != camera.height)
    throw Error(ErrorCode::bad_input,
                "the mask has " + std::to_string(p.width()) + " x " + std::to_string(p.height()) +
                    " pixels, its photograph " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                    (p.width() == camera.height && p.height() == camera.width
                         ? ": masks have the sensor's rows and columns, not turned as the camera was held"
                         : ""),
                file.string());
  if (p.channels() == 1) return p;
  Image mask = Image::uninitialized(p.width(), p.height(), 1);
  for (int y = 0; y < p.height(); ++y) {
    const std::uint8_t* from = p.row<std::uint8_t>(y);
    std::uint8_t* to = mask.row<std::uint8_t>(y);
    for (int x = 0; x < p.width(); ++x, from += p.channels()) {
      if (p.channels() == 3) {
        const auto [low, high] = std::minmax({from[0], from[1], from[2]});
        // JPEG shifts grey by a level or two.
        if (high - low > 8)
          throw Error(ErrorCode::bad_input, "a colour picture, not a mask: expected grey values or an alpha channel",
                      file.string());
        to[x] = from[1];
      } else {
        to[x] = from[3];
      }
    }
  }
  return mask;
}

}  // namespace

int import_masks(Capture& capture, const fs::path& folder, Job& job) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw Error(ErrorCode::not_found, "no such folder", folder.string());
  std::map<std::string, std::size_t> shots;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    const fs::path photo(capture.shots[i].file);
    shots.emplace(photo.filename().string(), i);
    shots.emplace(photo.stem().string(), i);
  }
  for (std::size_t i = 0; i < capture.shots.size(); ++i) shots[capture.shots[i].name] = i;

  std::map<std::size_t, fs::path> found;  // by shot, so that the order is the capture's
  std::vector<std::string> strangers;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!is_picture(entry.path())) continue;
    const auto shot = shots.find(entry.path().stem().string());
    if (shot == shots.end()) {
      strangers.push_back(entry.path().filename().string());
      continue;
    }
    if (const auto [at, is_new] = found.emplace(shot->second, entry.path()); !is_new)
      throw Error(ErrorCode::bad_input,
                  "two masks for photograph " + capture.shots[shot->second].name + ": " +
                      std::min(at->second, entry.path()).filename().string() + " and " +
                      std::max(at->second, entry.path()).filename().string(),
                  folder.string());
  }
  if (error) throw Error(ErrorCode::io, "can't list the folder: " + error.message(), folder.string());
  if (found.empty())
    throw Error(
        ErrorCode::not_found,
        "no picture is named after a photograph of the capture" +
            (strangers.empty() ? std::string() : " (" + *std::min_element(strangers.begin(), strangers.end()) + ", …)"),
        folder.string());

  const std::vector<std::pair<std::size_t, fs::path>> masks(found.begin(), found.end());
  const auto read = [&](std::size_t i) {
    const auto camera = std::size_t(capture.shots[masks[i].first].camera);
    return read_mask_file(masks[i].second, capture.cameras.at(camera));
  };
  job.begin("importing masks", 2 * masks.size());
  parallel_for(
      job, masks.size(), [&](std::size_t i) { read(i); }, true);
  parallel_for(
      job, masks.size(), [&](std::size_t i) { capture.write_mask(masks[i].first, read(i), MaskSource::imported); },
      true);
  job.end();
  if (!strangers.empty())
    capture.notes.push_back(std::to_string(strangers.size()) + " pictures of " + folder.filename().string() +
                            " belong to no photograph, e.g. " + *std::min_element(strangers.begin(), strangers.end()));
  capture.save();
  return int(masks.size());
}

}  // namespace lumihull
