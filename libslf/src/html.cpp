#include "html.h"

#include <lumihull/slf/metrics.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace lumihull::slf {
namespace {

constexpr std::array<std::uint8_t, 3> kBehind{102, 102, 119};  // in light and in dark surroundings
constexpr int kJpegQuality = 85;

}  // namespace

std::string figure(const Image& picture, const std::string& caption) {
  const std::string jpeg = encode_jpeg(picture.channels() == 4 ? composited(picture, kBehind) : picture, kJpegQuality);
  return "<figure><img loading=\"lazy\" width=\"" + std::to_string(picture.width()) + "\" height=\"" +
         std::to_string(picture.height()) + "\" alt=\"" + html_escaped(caption) + "\" src=\"data:image/jpeg;base64," +
         lumihull::internal::base64(jpeg) + "\"><figcaption>" + html_escaped(caption) + "</figcaption></figure>\n";
}

std::string formatted(const char* format, double value) {
  if (!std::isfinite(value)) return "–";
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string megabytes(std::uint64_t bytes) { return formatted("%.1f MB", double(bytes) / 1e6); }

}  // namespace lumihull::slf
