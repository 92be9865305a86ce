// The noise of a plane, from the plane itself.
#include "plane_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace lumihull::calib {
namespace {

constexpr int kCells = 4;            // of a patch, each way
constexpr int kPatches = 20'000;     // at most
constexpr int kBins = 24;            // of values
constexpr int kLeastInBin = 30;      // patches
constexpr double kLeast = 1e-10;     // variance: nothing is free of noise
constexpr double kLeastSpan = 0.03;  // of values, below which no dependence on the value is asked for

// Of χ² with 13 degrees of freedom (16 sums less a plane), over its mean: the 20 % quantile, the 99 % quantile, and the
// mean of what is below that.
constexpr double kLowQuantile = 0.664, kHighQuantile = 2.130, kMeanBelow = 0.986;

struct Patch {
  float mean = 0, variance = 0;
};

/// Variance of a pixel from 16 sums of kCell x kCell pixels less their plane; false where a pixel is clipped.
template <int kCell>
bool measure(const Image& values, int x0, int y0, float saturation, Patch& patch) {
  std::array<float, 16> sums{};
  float highest = 0;
  for (int y = 0; y < kCells * kCell; ++y) {
    const float* row = values.row<float>(y0 + y) + x0;
    for (int x = 0; x < kCells * kCell; ++x) {
      sums[std::size_t(y / kCell * kCells + x / kCell)] += row[x];
      highest = std::max(highest, row[x]);
    }
  }
  double sum = 0, sum_x = 0, sum_y = 0;
  for (int i = 0; i < 16; ++i) {
    sum += sums[std::size_t(i)];
    sum_x += sums[std::size_t(i)] * (i % 4 - 1.5);
    sum_y += sums[std::size_t(i)] * (i / 4 - 1.5);
  }
  double squares = 0;
  for (int i = 0; i < 16; ++i) {
    const double r = sums[std::size_t(i)] - sum / 16 - (sum_x * (i % 4 - 1.5) + sum_y * (i / 4 - 1.5)) / 20;
    squares += r * r;
  }
  patch = {float(sum / (16 * kCell * kCell)), float(squares / (kCell * kCell * 13))};
  return highest < saturation && std::isfinite(patch.variance);
}

/// d linear / d sRGB.
double slope(double linear) {
  if (linear <= 0.0031308) return 1 / 12.92;
  return 2.4 / 1.055 * std::pow(linear, 1.4 / 2.4);
}

/// Mean variance of the patches that pure noise explains.
double clipped_mean(std::vector<float>& variances) {
  const auto low = variances.begin() + std::ptrdiff_t(variances.size() / 5);
  std::nth_element(variances.begin(), low, variances.end());
  double level = *low / kLowQuantile;
  for (int round = 0; round < 8 && level > 0; ++round) {
    double sum = 0;
    std::size_t count = 0;
    for (const float v : variances)
      if (v < kHighQuantile * level) sum += v, ++count;
    if (count == 0) break;
    level = sum / double(count) / kMeanBelow;
  }
  return level;
}

/// Least variance at a value: what rounding adds.
struct Rounding {
  double step = 0, weights_norm = 0;
  double operator()(double v) const {
    const double rounding = step * slope(std::clamp(v, 0.0, 1.0)) * weights_norm;
    return std::max(kLeast, rounding * rounding / 12);
  }
};

/// From patches of cells of kCell x kCell pixels.
template <int kCell>
PlaneNoise estimate(const Image& values, float saturation, const Rounding& floor_at) {
  PlaneNoise noise;
  constexpr int kSide = kCells * kCell;
  const int columns = values.width() / kSide, rows = values.height() / kSide;
  // Every so many patches, moved along from row to row so that no column of the picture is left out.
  const std::int64_t total = std::int64_t(columns) * rows, stride = std::max<std::int64_t>(1, total / kPatches) | 1;
  std::vector<Patch> patches;
  patches.reserve(std::size_t(total / stride + 1));
  for (std::int64_t i = 0; i < total; i += stride) {
    Patch patch;
    if (measure<kCell>(values, int(i % columns) * kSide, int(i / columns) * kSide, saturation, patch))
      patches.push_back(patch);
  }
  if (patches.empty()) {
    noise.read = std::max(noise.read, floor_at(0.5));
    return noise;
  }
  const auto [low, high] = std::minmax_element(patches.begin(), patches.end(),
                                               [](const Patch& a, const Patch& b) { return a.mean < b.mean; });
  const double least = low->mean, span = high->mean - least;

  // Bins of equal width in the root of the value, as noise grows in the dark first.
  std::array<std::vector<float>, kBins> variances;
  std::array<double, kBins> means{};
  const std::size_t enough = std::min<std::size_t>(kLeastInBin, patches.size());
  for (const Patch& p : patches) {
    const double place = span > kLeastSpan ? std::sqrt((p.mean - least) / span) * kBins : 0;
    const std::size_t bin = std::size_t(std::clamp(place, 0.0, kBins - 1.0));
    variances[bin].push_back(p.variance);
    means[bin] += p.mean;
  }
  if (std::none_of(variances.begin(), variances.end(), [&](const auto& v) { return v.size() >= enough; })) {
    for (std::size_t b = 1; b < kBins; ++b) {  // few patches, all different: one bin
      variances[0].insert(variances[0].end(), variances[b].begin(), variances[b].end());
      variances[b].clear();
      means[0] += means[b];
    }
  }
  // Weighted least squares of variance = read + gain · value: a bin's variance is known to a fixed share of itself. It
  // can't fall with the value: where a darker bin has more of it, that is texture.
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0, brighter = 1e300;
  for (std::size_t b = kBins; b-- > 0;) {
    if (variances[b].size() < enough) continue;
    const double x = std::max(0.0, means[b] / double(variances[b].size()));
    const double y = brighter = std::min(brighter, std::max(clipped_mean(variances[b]), floor_at(x)));
    const double weight = double(std::min<std::size_t>(variances[b].size(), 1000)) / (y * y);
    w += weight, wx += weight * x, wy += weight * y, wxx += weight * x * x, wxy += weight * x * y;
  }
  const double x_mean = wx / w, y_mean = wy / w, spread = wxx / w - x_mean * x_mean;
  noise.gain = spread > 1e-5 ? std::max(0.0, (wxy / w - x_mean * y_mean) / spread) : 0;
  noise.read = y_mean - noise.gain * x_mean;
  if (noise.read < 0) {
    noise.read = 0;
    noise.gain = wxy / wxx;
  }
  noise.read = std::max(noise.read, floor_at(0));
  return noise;
}

}  // namespace

PlaneNoise estimate_noise(const Image& values, float saturation, double step, double weights_norm) {
  const Rounding rounding{step, weights_norm};
  PlaneNoise noise = estimate<2>(values, saturation, rounding);
  // Correlation between neighbours can't make sums of four pixels that much noisier: nothing of that size is flat.
  constexpr double kTexture = 16, kMostCorrelated = 3;
  const PlaneNoise small = estimate<1>(values, saturation, rounding);
  const double ratio = noise.variance(0.5) / small.variance(0.5);
  if (ratio > kTexture) return small;
  // Through a colour filter sums of four pixels have 2.2 times, sums of sixteen 3.2 times a pixel's variance: the next
  // step is about the root of this one.
  const double growth = std::sqrt(std::clamp(ratio, 1.0, kMostCorrelated));
  if (growth > 1.05) noise.read *= growth, noise.gain *= growth;
  return noise;
}

}  // namespace lumihull::calib
