#include <lumihull/base/error.h>
#include <lumihull/calib/despill.h>
#include <lumihull/slf/photos.h>

#include <algorithm>
#include <memory>
#include <utility>

namespace lumihull::slf {
namespace {

std::vector<std::size_t> positioned_shots(const Capture& capture, bool held_out) {
  std::vector<std::size_t> shots;
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    if (capture.positioned(i) && capture.held_out(i) == held_out) shots.push_back(i);
  return shots;
}

Image opaque(int width, int height) {
  Image mask(width, height, 1);
  std::fill_n(mask.data(), mask.bytes(), std::byte{255});
  return mask;
}

}  // namespace

void validate(const PhotoSet& photos) {
  if (photos.names.size() != photos.views.size() || !photos.read)
    throw Error(ErrorCode::invalid_argument, "expected a name and a view for each photograph, and a reader");
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const View& view = photos.views[i];
    try {
      view.camera.validate();
    } catch (const Error& e) {
      throw Error(ErrorCode::bad_input, e.message(), photos.names[i]);
    }
    if (!view.cam_from_world.rotation.coeffs().allFinite() || !view.cam_from_world.translation.allFinite())
      throw Error(ErrorCode::bad_input, "the pose is not finite", photos.names[i]);
  }
}

std::vector<std::size_t> training_shots(const Capture& capture) { return positioned_shots(capture, false); }
std::vector<std::size_t> held_out_shots(const Capture& capture) { return positioned_shots(capture, true); }

PhotoSet photos_of(const Capture& capture, std::span<const std::size_t> shots) {
  PhotoSet photos;
  for (const std::size_t shot : shots) {
    photos.names.push_back(capture.shots.at(shot).name);
    photos.views.push_back(capture.view(shot));
  }
  const auto source = std::make_shared<const Capture>(capture);
  photos.read = [source, shots = std::vector<std::size_t>(shots.begin(), shots.end())](std::size_t i) {
    const std::size_t shot = shots.at(i);
    Photo photo;
    photo.rgb = source->read_photo(shot, 3);
    if (photo.rgb.type() != PixelType::u8) photo.rgb = converted(photo.rgb, PixelType::u8, 3);
    const bool masked = source->mask_state(source->shots[shot]) != MaskSource::none;
    photo.alpha = masked ? source->read_mask(shot) : opaque(photo.rgb.width(), photo.rgb.height());
    return photo;
  };
  return photos;
}

PhotoSet despilled(PhotoSet photos, const calib::Despill& despill, float strength) {
  if (!(strength >= 0 && strength <= 1))
    throw Error(ErrorCode::invalid_argument, "strength: expected 0 to 1", "despill");
  photos.read = [read = std::move(photos.read), despill, strength](std::size_t i) {
    Photo photo = read(i);
    despill.apply(photo.rgb, calib::SpillMode::limit, strength);
    return photo;
  };
  return photos;
}

}  // namespace lumihull::slf
