#pragma once

#include <lumihull/slf/photos.h>

#include <array>
#include <cstdint>

namespace lumihull::slf {

inline constexpr std::uint8_t kWholePixel = 250;  // alpha from which a pixel counts as the object's alone

/// Tells pixels of a silhouette's rim that are nothing but a mixture of object and background.
class Rim {
 public:
  /// Sizes and types as PreparedPhoto has checked them; must outlive the object.
  explicit Rim(const Photo& photo);

  /// Whether the pixel, of which the object covers the share α, is α · object + (1 - α) · background in linear light,
  /// with the colour of the nearest whole pixel, at most `reach` pixels away, and a colour of the clear background
  /// around, as far as bytes and masks are to be trusted. False where one of the two is not there.
  bool is_mixture(int x, int y, float reach) const;

 private:
  bool is_clear(int x, int y) const;

  const Photo& photo_;
  std::array<float, 256> light_;  // linear, of each byte
};

}  // namespace lumihull::slf
