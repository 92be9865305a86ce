#include "bright_spots.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>

namespace lumihull::slf {

void smooth(Plane& p, int r) {
  const auto run = [&](int length, int lines, std::size_t step, std::size_t line_step) {
    std::vector<float> sums(std::size_t(length) + 1);
    for (int line = 0; line < lines; ++line)
      for (int pass = 0; pass < 3; ++pass) {
        float* at = &p.values[std::size_t(line) * line_step];
        for (int i = 0; i < length; ++i) sums[std::size_t(i) + 1] = sums[std::size_t(i)] + at[std::size_t(i) * step];
        for (int i = 0; i < length; ++i) {
          const int low = std::max(0, i - r), high = std::min(length, i + r + 1);
          at[std::size_t(i) * step] = (sums[std::size_t(high)] - sums[std::size_t(low)]) / float(high - low);
        }
      }
  };
  run(p.width, p.height, 1, std::size_t(p.width));
  run(p.height, p.width, std::size_t(p.width), 1);
}

std::vector<BrightSpot> bright_spots(const Plane& plane, float least, float prominence) {
  // Pixels from the highest down; each joins the basins around it. Where two meet, that is the pass between them.
  constexpr std::uint32_t kNone = ~std::uint32_t(0);
  const auto width = std::size_t(plane.width);
  std::vector<std::uint32_t> order;
  // A spot reaches down to half of its height.
  for (std::size_t i = 0; i < plane.values.size(); ++i)
    if (plane.values[i] >= 0.5f * least) order.push_back(std::uint32_t(i));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return plane.values[a] > plane.values[b]; });
  std::vector<std::uint32_t> basin_of(plane.values.size(), kNone), top, into;
  const auto root = [&](std::uint32_t b) {
    while (into[b] != b) b = into[b] = into[into[b]];
    return b;
  };
  for (const std::uint32_t i : order) {
    const int x = int(i % width), y = int(i / width);
    std::array<std::uint32_t, 8> near;
    std::size_t n = 0;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        if ((!dx && !dy) || x + dx < 0 || y + dy < 0 || x + dx >= plane.width || y + dy >= plane.height) continue;
        const std::uint32_t b = basin_of[std::size_t(y + dy) * width + std::size_t(x + dx)];
        if (b != kNone) near[n++] = root(b);
      }
    if (n == 0) {
      basin_of[i] = std::uint32_t(top.size());
      top.push_back(i), into.push_back(basin_of[i]);
      continue;
    }
    // Basins are numbered from the highest down.
    const std::uint32_t highest = *std::min_element(near.begin(), near.begin() + std::ptrdiff_t(n));
    basin_of[i] = highest;
    for (std::size_t k = 0; k < n; ++k) {
      const float height = plane.values[top[near[k]]];
      if (near[k] != highest && (height < least || height - plane.values[i] < prominence * height))
        into[near[k]] = highest;
    }
  }
  std::vector<BrightSpot> spots;
  std::vector<std::size_t> spot_of(top.size());
  for (std::uint32_t b = 0; b < top.size(); ++b) {
    if (into[b] != b || plane.values[top[b]] < least) continue;
    spot_of[b] = spots.size();
    const Eigen::Vector2d peak(double(top[b] % width) + 0.5, double(top[b] / width) + 0.5);
    spots.push_back({Eigen::Vector2d::Zero(), peak, plane.values[top[b]]});
  }
  std::vector<double> weights(spots.size());
  for (const std::uint32_t i : order) {
    const std::uint32_t b = root(basin_of[i]);
    if (plane.values[top[b]] < least) continue;
    BrightSpot& spot = spots[spot_of[b]];
    const double w = plane.values[i] - 0.5f * spot.height;
    if (w <= 0) continue;
    spot.pixel += w * Eigen::Vector2d(double(i % width) + 0.5, double(i / width) + 0.5);
    weights[spot_of[b]] += w;
  }
  for (std::size_t s = 0; s < spots.size(); ++s) spots[s].pixel /= weights[s];
  return spots;
}

}  // namespace lumihull::slf
