#include "gaussian_blur.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace lumihull::rig {

std::vector<float> gaussian_samples(double sigma, int reach) {
  std::vector<double> g;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) g.push_back(std::exp(-.5 * i * i / (sigma * sigma))), sum += g.back();
  std::vector<float> result;
  for (const double v : g) result.push_back(float(v / sum));
  return result;
}

void add_scaled(float* out, float g, const float* in, std::size_t n) {
  Eigen::Map<Eigen::ArrayXf>(out, Eigen::Index(n)) += g * Eigen::Map<const Eigen::ArrayXf>(in, Eigen::Index(n));
}

void gaussian_blur(Image& image, double sigma) {
  const int reach = std::max(1, int(std::ceil(kGaussianReach * sigma)));
  const std::vector<float> kernel = gaussian_samples(sigma, reach);
  const int w = image.width(), h = image.height(), channels = image.channels();
  const std::size_t n = std::size_t(channels);
  std::vector<float> padded(std::size_t(w + 2 * reach) * n);
  for (int y = 0; y < h; ++y) {
    float* row = image.row<float>(y);
    for (int x = -reach; x < w + reach; ++x)
      std::copy_n(row + std::ptrdiff_t(channels) * std::clamp(x, 0, w - 1), channels,
                  &padded[std::size_t(x + reach) * n]);
    std::fill_n(row, std::size_t(w) * n, 0.f);
    for (std::size_t k = 0; k < kernel.size(); ++k) add_scaled(row, kernel[k], &padded[k * n], n * std::size_t(w));
  }
  // Down the columns: strips that stay in the cache.
  constexpr int kStrip = 96;
  std::vector<float> strip(std::size_t(h) * kStrip);
  for (int x0 = 0; x0 < channels * w; x0 += kStrip) {
    const int m = std::min(kStrip, channels * w - x0);
    for (int y = 0; y < h; ++y) std::copy_n(image.row<float>(y) + x0, m, &strip[std::size_t(y) * kStrip]);
    for (int y = 0; y < h; ++y) {
      float* out = image.row<float>(y) + x0;
      std::fill_n(out, m, 0.f);
      for (int k = -reach; k <= reach; ++k)
        add_scaled(out, kernel[std::size_t(k + reach)], &strip[std::size_t(std::clamp(y + k, 0, h - 1)) * kStrip],
                   std::size_t(m));
    }
  }
}

}  // namespace lumihull::rig
