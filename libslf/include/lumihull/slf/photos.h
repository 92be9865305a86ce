#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/image.h>

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::calib {
class Despill;
}

namespace lumihull::slf {

/// A photograph together with its silhouette.
struct Photo {
  Image rgb;    ///< 8-bit sRGB, 3 channels
  Image alpha;  ///< 8-bit, 1 channel, the photograph's size; 255 = object
};

/// The photographs that appearance is taken from. Pixels are read when they are needed and let go again: 600
/// photographs of 6.3 megapixels do not fit into memory.
struct PhotoSet {
  std::vector<std::string> names;
  std::vector<View> views;
  std::function<Photo(std::size_t)> read;  ///< called from several threads at once

  std::size_t size() const { return views.size(); }
};

/// Throws Error{invalid_argument} where names, views and reader do not fit together; Error{bad_input} naming the
/// photograph whose camera or pose is not valid.
LUMIHULL_API void validate(const PhotoSet& photos);

/// Shots that have a pose and are not held out: those that a model may be made from.
LUMIHULL_API std::vector<std::size_t> training_shots(const Capture& capture);
/// Shots that have a pose and are held out.
LUMIHULL_API std::vector<std::size_t> held_out_shots(const Capture& capture);

/// Photographs and masks of some shots of a capture (which is copied). A shot without a mask counts as wholly object.
/// Reading throws what Capture::read_photo and read_mask throw.
LUMIHULL_API PhotoSet photos_of(const Capture& capture, std::span<const std::size_t> shots);

/// The same photographs with the enclosure's light taken off (SpillMode::limit). What the object itself has of the
/// enclosure's hue goes, too. strength: 0 … 1. Errors: invalid_argument.
LUMIHULL_API PhotoSet despilled(PhotoSet photos, const calib::Despill& despill, float strength);

}  // namespace lumihull::slf
