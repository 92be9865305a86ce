#include <lumihull/base/error.h>
#include <lumihull/calib/key_image.h>

#include <algorithm>
#include <cmath>

#include "bit_mask.h"
#include "soft_edges.h"

namespace lumihull::calib {

void KeyImageOptions::validate() const {
  if (smallest_object_px < 0 || largest_hole_px < 0)
    throw Error(ErrorCode::invalid_argument, "smallest object and largest hole: expected 0 or more pixels", "keying");
}

Image keyable(const Image& photo) {
  const int channels = photo.channels();
  if (channels < 3)
    throw Error(ErrorCode::invalid_argument,
                "expected a colour photograph (3 channels), not " + std::to_string(channels), "keying");
  if (photo.type() == PixelType::u8 && channels == 3) return photo;
  Image out(photo.width(), photo.height(), 3);
  const auto convert = [&](auto zero, auto rule) {
    using T = decltype(zero);
    for (int y = 0; y < photo.height(); ++y) {
      const T* in = photo.row<T>(y);
      std::uint8_t* to = out.row<std::uint8_t>(y);
      for (int x = 0; x < photo.width(); ++x, in += channels, to += 3)
        for (int c = 0; c < 3; ++c) to[c] = rule(in[c]);
    }
  };
  if (photo.type() == PixelType::u8) convert(std::uint8_t(0), [](std::uint8_t v) { return v; });
  if (photo.type() == PixelType::u16)
    convert(std::uint16_t(0), [](std::uint16_t v) { return std::uint8_t((v + 128u) / 257u); });
  if (photo.type() == PixelType::f32)
    convert(0.0f, [](float v) { return v > 0 ? std::uint8_t(std::min(v, 1.0f) * 255.0f + 0.5f) : std::uint8_t(0); });
  return out;
}

Image key_image(const ColorKey& key, const Image& photo, const KeyImageOptions& options) {
  options.validate();
  Image converted_photo;
  if (photo.type() != PixelType::u8 || photo.channels() != 3) converted_photo = keyable(photo);
  const Image& rgb = converted_photo.empty() ? photo : converted_photo;
  BitMask mask(rgb.width(), rgb.height());
  for (int y = 0; y < rgb.height(); ++y) key.decide(rgb.row<std::uint8_t>(y), std::size_t(rgb.width()), mask.row(y));
  clean(mask, options.smallest_object_px, options.largest_hole_px);
  Image out = mask.expanded();
  if (options.edges != EdgeMode::hard) soften(mask, rgb, options.edges, false, out);
  return out;
}

void soften_edges(Image& mask, const Image& photo, EdgeMode mode) {
  if (mode == EdgeMode::hard) return;
  assert(mask.type() == PixelType::u8 && mask.channels() == 1 && photo.type() == PixelType::u8 &&
         photo.channels() == 3);
  assert(mask.width() == photo.width() && mask.height() == photo.height());
  soften(BitMask(mask), photo, mode, true, mask);
}

void clean_mask(Image& mask, int smallest_object_px, int largest_hole_px) {
  assert(mask.type() == PixelType::u8 && mask.channels() == 1);
  const BitMask before(mask);
  BitMask after = before;
  clean(after, smallest_object_px, largest_hole_px);
  for (int y = 0; y < mask.height(); ++y) {
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    for (int w = 0; w < before.words; ++w) {
      if (before.row(y)[w] == after.row(y)[w]) continue;
      for (int x = 64 * w; x < std::min(64 * (w + 1), mask.width()); ++x)
        if (before.at(x, y) != after.at(x, y)) row[x] = after.at(x, y) ? 255 : 0;
    }
  }
}

}  // namespace lumihull::calib
