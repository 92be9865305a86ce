#pragma once

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/color_key.h>

#include <array>
#include <span>

#include "coarse_hull.h"

namespace lumihull::hull {

/// What lies in the enclosure's shadow: darker than the enclosure and more saturated, for what light reaches a shadow
/// has met a wall before. Dark paint that mirrors the room is mostly less so.
class Shadows {
 public:
  /// background: the enclosure's usual colour; a grey or black one has no such shadows.
  explicit Shadows(const calib::Rgb& background);

  /// Learns how saturated the background is that the views show beside the hull: the darker, the more. Without, nothing
  /// is surely shadow. photos: the views' pictures, thinned, 8 bits, 3 channels.
  void learn(std::span<const CoarseView> views, std::span<const Image> photos, const CoarseHull& hull, Job& job);

  /// Whether a colour may be a shadow's: clearly more saturated than the enclosure.
  bool may_be(const std::uint8_t* rgb) const {
    const int light = rgb[0] + rgb[1] + rgb[2];
    if (light > brightest_ || light < kDarkest) return false;
    return saturation(rgb) >= (light < kDim ? sure_[std::size_t(light / kBin)] : kLeast) * float(light);
  }
  /// Whether it surely is: as saturated as nine tenths of the background that is so dark, or darker where none is.
  bool is_sure(const std::uint8_t* rgb) const {
    const int light = rgb[0] + rgb[1] + rgb[2];
    if (light > brightest_ || light < kDarkest) return false;
    return saturation(rgb) >= sure_[std::size_t(light / kBin)] * float(light);
  }

  /// Sets object pixels that may be shadow to 0. mask, photo: 8 bits, of one size.
  void take(Image& mask, const Image& photo) const;

 private:
  // Of red + green + blue. Below the first a colour has no hue to speak of, below the second noise makes it uncertain.
  static constexpr int kDarkest = 12, kDim = 24;
  static constexpr int kBin = 8, kBins = 768 / kBin;
  static constexpr float kLeast = 1.2f;  ///< saturation over the enclosure's

  /// Over the enclosure's, times red + green + blue.
  float saturation(const std::uint8_t* rgb) const {
    return hue_[0] * float(rgb[0]) + hue_[1] * float(rgb[1]) + hue_[2] * float(rgb[2]);
  }

  int brightest_ = -1;  ///< red + green + blue of the enclosure; -1: there are no shadows
  std::array<float, 3> hue_{};
  std::array<float, kBins> sure_;  ///< saturation of what is surely shadow, by brightness
};

}  // namespace lumihull::hull
