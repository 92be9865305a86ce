// Animated PNG: the frames' own compressed data, under other chunk names. Nothing is decoded.

#include "apng.h"

#include <lumihull/base/error.h>

#include <array>
#include <cstdint>
#include <string_view>

namespace lumihull::program {

namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);

std::uint32_t number(std::string_view bytes) {
  std::uint32_t x = 0;
  for (int i = 0; i < 4; ++i) x = x << 8 | std::uint8_t(bytes[std::size_t(i)]);
  return x;
}

void put(std::string& out, std::uint32_t x, int bytes = 4) {
  for (int i = bytes - 1; i >= 0; --i) out += char(x >> (8 * i) & 0xff);
}

/// CRC-32 as PNG wants it (ISO 3309), over a chunk's name and data.
std::uint32_t crc(std::string_view bytes) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t n = 0; n < 256; ++n) {
      std::uint32_t c = n;
      for (int k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320u ^ (c >> 1) : c >> 1;
      t[n] = c;
    }
    return t;
  }();
  std::uint32_t c = 0xffffffffu;
  for (const char byte : bytes) c = table[(c ^ std::uint8_t(byte)) & 0xff] ^ (c >> 8);
  return ~c;
}

void chunk(std::string& out, std::string_view name, std::string_view data) {
  std::string body(name);
  body += data;
  put(out, std::uint32_t(data.size()));
  out += body;
  put(out, crc(body));
}

struct Png {
  std::string_view header;               ///< IHDR's data
  std::vector<std::string_view> pixels;  ///< the data of each IDAT
};

Png parts(const std::string& file, std::size_t index) {
  const auto fail = [&] {
    throw Error(ErrorCode::bad_input, "expected a whole PNG file", "frame " + std::to_string(index + 1));
  };
  const std::string_view bytes = file;
  if (!bytes.starts_with(kSignature)) fail();
  Png png;
  for (std::size_t at = kSignature.size(); at + 12 <= bytes.size();) {
    const std::size_t length = number(bytes.substr(at));
    if (length > bytes.size() - at - 12) fail();
    const std::string_view name = bytes.substr(at + 4, 4), data = bytes.substr(at + 8, length);
    if (name == "IHDR") png.header = data;
    if (name == "IDAT") png.pixels.push_back(data);
    at += 12 + length;
  }
  if (png.header.size() != 13 || png.pixels.empty()) fail();
  return png;
}

}  // namespace

std::string animated_png(std::span<const std::string> frames, int delay_ms) {
  if (frames.empty() || delay_ms < 1 || delay_ms > 60000)
    throw Error(ErrorCode::invalid_argument, "expected at least one frame, and 1 to 60000 ms", "animation");
  std::string out(kSignature);
  std::uint32_t sequence = 0;
  std::string_view header;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Png png = parts(frames[i], i);
    if (i == 0) {
      header = png.header;
      chunk(out, "IHDR", header);
      std::string control;
      put(control, std::uint32_t(frames.size()));
      put(control, 0);  // plays for ever
      chunk(out, "acTL", control);
    } else if (png.header != header) {
      throw Error(ErrorCode::bad_input, "expected frames of one size and format", "frame " + std::to_string(i + 1));
    }
    std::string control;
    put(control, sequence++);
    control += header.substr(0, 8);    // width, height
    put(control, 0), put(control, 0);  // at the upper left corner
    put(control, std::uint32_t(delay_ms), 2), put(control, 1000, 2);
    put(control, 0, 1), put(control, 0, 1);  // stays; replaces
    chunk(out, "fcTL", control);
    for (const std::string_view data : png.pixels) {
      if (i == 0) {
        chunk(out, "IDAT", data);
        continue;
      }
      std::string numbered;
      put(numbered, sequence++);
      numbered += data;
      chunk(out, "fdAT", numbered);
    }
  }
  chunk(out, "IEND", {});
  return out;
}

}  // namespace lumihull::program
