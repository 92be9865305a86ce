#pragma once

// Pictures and picture files for tests, made in memory.

#include <lumihull/base/image.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace lumihull::test {

inline std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

/// Smooth colours with a different pattern in each channel: JPEG keeps them well, and a swapped channel shows.
inline Image pattern(int width, int height, int channels, PixelType type = PixelType::u8) {
  Image image(width, height, channels, type);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c) {
        const double v = c == 0 ? double(x) / width : c == 1 ? double(y) / height : double(x + y) / (width + height);
        const int i = x * channels + c;
        if (type == PixelType::u8) image.row<std::uint8_t>(y)[i] = std::uint8_t(v * 255);
        if (type == PixelType::u16) image.row<std::uint16_t>(y)[i] = std::uint16_t(v * 65535);
        if (type == PixelType::f32) image.row<float>(y)[i] = float(v);
      }
  return image;
}

/// A little-endian EXIF block (from "II" on). Values longer than four bytes go behind the folders.
class ExifBuilder {
 public:
  void ascii(bool exif_folder, int tag, const std::string& text) {
    add(exif_folder, tag, 2, std::uint32_t(text.size() + 1), text + '\0');
  }
  void u16(bool exif_folder, int tag, int value) { add(exif_folder, tag, 3, 1, number(std::uint32_t(value), 2)); }
  void rational(bool exif_folder, int tag, std::uint32_t over, std::uint32_t under) {
    add(exif_folder, tag, 5, 1, number(over, 4) + number(under, 4));
  }
  std::string tiff() const;
  static std::string number(std::uint32_t value, int size) {
    std::string out;
    for (int i = 0; i < size; ++i) out += char(value >> 8 * i & 255);
    return out;
  }

 private:
  struct Entry {
    int tag, type;
    std::uint32_t count;
    std::string value;
  };
  void add(bool exif_folder, int tag, int type, std::uint32_t count, std::string value) {
    (exif_folder ? exif_ : main_).push_back({tag, type, count, std::move(value)});
  }
  std::vector<Entry> main_, exif_;
};

/// The JPEG with an APP1 segment "Exif" directly behind its start.
std::string jpeg_with_exif(const std::string& jpeg, const std::string& tiff);

/// A PNG by libpng itself: colour type and depth as in PNG's header, `rows` packed as they are stored.
struct PngVariant {
  int width = 0, height = 0, colour = 0, depth = 8;
  bool interlaced = false;
  std::vector<std::string> rows;
  std::vector<std::uint8_t> palette;       ///< RGB triples
  std::vector<std::uint8_t> transparency;  ///< alpha of the palette's first entries
};
std::string write_variant(const PngVariant& variant);

}  // namespace lumihull::test
