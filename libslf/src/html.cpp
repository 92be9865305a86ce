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

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 3; ++k) v = (v << 8) | (k < n ? std::uint8_t(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= n ? kDigits[(v >> (18 - 6 * k)) & 63] : '=';
  }
  return out;
}

}  // namespace

std::string figure(const Image& picture, const std::string& caption) {
  const std::string jpeg = encode_jpeg(picture.channels() == 4 ? composited(picture, kBehind) : picture, kJpegQuality);
  return "<figure><img loading=\"lazy\" width=\"" + std::to_string(picture.width()) + "\" height=\"" +
         std::to_string(picture.height()) + "\" alt=\"" + html_escaped(caption) + "\" src=\"data:image/jpeg;base64," +
         base64(jpeg) + "\"><figcaption>" + html_escaped(caption) + "</figcaption></figure>\n";
}

std::string formatted(const char* format, double value) {
  if (!std::isfinite(value)) return "–";
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string megabytes(std::uint64_t bytes) { return formatted("%.1f MB", double(bytes) / 1e6); }

Image fitted(const Image& picture, int side) {
  const int factor_w = (picture.width() + side - 1) / side, factor_h = (picture.height() + side - 1) / side;
  if (std::max(factor_w, factor_h) <= 1) return picture;
  const double scale = double(side) / std::max(picture.width(), picture.height());
  const int w = std::max(1, int(picture.width() * scale)), h = std::max(1, int(picture.height() * scale));
  const int channels = picture.channels();
  Image out(w, h, channels);
  for (int y = 0; y < h; ++y) {
    const int y0 = int(std::int64_t(y) * picture.height() / h), y1 = int(std::int64_t(y + 1) * picture.height() / h);
    for (int x = 0; x < w; ++x) {
      const int x0 = int(std::int64_t(x) * picture.width() / w), x1 = int(std::int64_t(x + 1) * picture.width() / w);
      for (int c = 0; c < channels; ++c) {
        std::int64_t sum = 0;
        for (int j = y0; j < y1; ++j)
          for (int i = x0; i < x1; ++i) sum += picture.row<std::uint8_t>(j)[i * channels + c];
        const std::int64_t n = std::int64_t(y1 - y0) * (x1 - x0);
        out.row<std::uint8_t>(y)[x * channels + c] = std::uint8_t((sum + n / 2) / n);
      }
    }
  }
  return out;
}

}  // namespace lumihull::slf
