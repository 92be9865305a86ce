#include "picture_hints.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace lumihull::capture::internal {

namespace {

constexpr double kStrongest = 0.003;  ///< share of the pixels that are taken for edges
constexpr int kLeastGradient = 24;    ///< grey values over two pixels: below it is noise
constexpr int kFarthest = 24;         ///< px, of an edge to either side
constexpr std::size_t kLeastEdges = 50;

/// Median width of the strongest edges along one direction: contrast over the steepest slope, both along the row
/// (Marziliano et al. 2002, with the slope in place of the distance of the extrema, which noise shortens).
/// at(line, i): grey value.
template <class At>
double edge_width(int lines, int length, At at) {
  std::array<std::size_t, 256> histogram{};
  for (int y = 0; y < lines; ++y)
    for (int x = 1; x + 1 < length; ++x) ++histogram[std::size_t(std::abs(at(y, x + 1) - at(y, x - 1)))];
  const auto wanted = std::size_t(kStrongest * lines * length);
  int threshold = 255;
  for (std::size_t sum = 0; threshold > kLeastGradient; --threshold)
    if ((sum += histogram[std::size_t(threshold)]) > wanted) break;
  std::vector<float> widths;
  for (int y = 0; y < lines; ++y)
    for (int x = 2; x + 2 < length; ++x) {
      const int gradient = at(y, x + 1) - at(y, x - 1), sign = gradient < 0 ? -1 : 1;
      if (std::abs(gradient) < threshold || std::abs(gradient) < std::abs(at(y, x) - at(y, x - 2)) ||
          std::abs(gradient) < std::abs(at(y, x + 2) - at(y, x)))
        continue;
      int from = x, to = x;
      while (from > 0 && x - from < kFarthest && sign * (at(y, from) - at(y, from - 1)) > 0) --from;
      while (to + 1 < length && to - x < kFarthest && sign * (at(y, to + 1) - at(y, to)) > 0) ++to;
      widths.push_back(float(std::abs(at(y, to) - at(y, from))) / (0.5f * float(std::abs(gradient))));
    }
  if (widths.size() < kLeastEdges) return 0;
  const auto middle = widths.begin() + std::ptrdiff_t(widths.size() / 2);
  std::nth_element(widths.begin(), middle, widths.end());
  return *middle;
}

}  // namespace

PictureHints picture_hints(const Image& picture) {
  const int w = picture.width(), h = picture.height();
  std::vector<std::uint8_t> grey(std::size_t(w) * std::size_t(h));
  std::array<std::size_t, 256> histogram{};
  std::size_t clipped = 0;
  for (int y = 0; y < h; ++y) {
    const std::uint8_t* p = picture.row<std::uint8_t>(y);
    for (int x = 0; x < w; ++x, p += 3) {
      clipped += std::max({p[0], p[1], p[2]}) >= 254;
      const auto value = std::uint8_t((54 * p[0] + 183 * p[1] + 19 * p[2]) / 256);
      grey[std::size_t(y) * std::size_t(w) + std::size_t(x)] = value;
      ++histogram[value];
    }
  }
  PictureHints out;
  out.clipped = double(clipped) / double(grey.size());
  std::size_t above = 0;
  int level = 255;
  for (; level > 0; --level)
    if ((above += histogram[std::size_t(level)]) * 100 > grey.size()) break;
  out.brightest = level;
  const auto at = [&](int y, int x) { return int(grey[std::size_t(y) * std::size_t(w) + std::size_t(x)]); };
  out.edge_width = std::max(edge_width(h, w, at), edge_width(w, h, [&](int x, int y) { return at(y, x); }));
  return out;
}

}  // namespace lumihull::capture::internal
