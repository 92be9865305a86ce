#include "blurred_coverage.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gaussian_blur.h"
#include "sheets/flat_coverage.h"

// Pixels are samples of edges, which hold detail at all frequencies; a Gaussian applied to them would blur what has
// been aliased already, and move circles of 6 px by up to .008 px. So the first .8 px of blur are applied to parts of
// pixels, and only then the picture is sampled; what is left of the blur acts on pixels that hold nothing beyond their
// frequency.

namespace lumihull::rig {

namespace {

constexpr int kParts = 3;
constexpr double kFineSigma = .8;  ///< px
constexpr double kAllFine = 1.25;  ///< px; from here on the rest is wide enough to be sampled at pixels (sigma > .9)

/// Weights of the parts at -before … for a pixel whose first part is part 0: Gaussian and pixel's square.
struct PartKernel {
  int before = 0;
  std::vector<float> weight;
  PartKernel(double sigma, int parts) {
    before = std::max(1, int(std::ceil(kGaussianReach * sigma * parts)));
    const std::vector<float> g = gaussian_samples(sigma * parts, before);
    weight.assign(g.size() + std::size_t(parts) - 1, 0);
    for (std::size_t i = 0; i < g.size(); ++i)
      for (int p = 0; p < parts; ++p) weight[i + std::size_t(p)] += g[i] / float(parts);
  }
};

/// The mean of several views' coverage.
class MeanCoverage {
 public:
  MeanCoverage(std::span<const View> views, std::span<const FlatPrint> prints, const Eigen::Vector3f& background,
               int lines, int parts) {
    for (const View& view : views) coverages_.emplace_back(view, prints, background, lines, parts);
    row_.resize(std::size_t(3 * FlatCoverage::kTile) * std::size_t(parts * parts) * std::size_t(views[0].camera.width));
  }

  /// As FlatCoverage's; `values` is how many it fills.
  void tile_row(int first_row, float* out, std::size_t values) {
    if (coverages_.size() == 1) return coverages_[0].tile_row(first_row, out);
    std::fill_n(out, values, 0.f);
    for (FlatCoverage& coverage : coverages_) {
      coverage.tile_row(first_row, row_.data());
      add_scaled(out, 1 / float(coverages_.size()), row_.data(), values);
    }
  }

 private:
  std::vector<FlatCoverage> coverages_;
  std::vector<float> row_;
};

/// Coverage by parts, blurred and sampled at the pixels.
Image sampled(MeanCoverage& coverage, int width, int height, double sigma, int parts) {
  constexpr int kTile = FlatCoverage::kTile;
  const PartKernel kernel(sigma, parts);
  const int taps = int(kernel.weight.size());
  const std::size_t values = std::size_t(3) * std::size_t(width) * std::size_t(parts);
  const int fine_rows = height * parts;

  // A ring of rows of parts: what the kernel spans, and a row of tiles.
  const int ring = taps + 2 * kTile * parts;
  std::vector<float> rows(std::size_t(ring) * values), tile(std::size_t(kTile * parts) * values), down(values);
  int ready = 0;  // rows of parts that are rendered

  // One row's parts by channel and by what is left when divided by `parts`, with the border repeated.
  const int pad = (kernel.before + parts - 1) / parts;  // px
  const int after = (taps - kernel.before + parts - 1) / parts;
  const std::size_t phase_length = std::size_t(width + pad + after);
  std::vector<float> phases(phase_length * std::size_t(3 * parts)), across(std::size_t(width) * 3);

  Image image = Image::uninitialized(width, height, 3, PixelType::f32);
  for (int y = 0; y < height; ++y) {
    const int first = y * parts - kernel.before, last = std::min(first + taps, fine_rows);
    while (ready < last) {
      const int row = ready / parts;
      const int n = std::min(kTile, height - row) * parts;
      coverage.tile_row(row, tile.data(), std::size_t(n) * values);
      for (int i = 0; i < n; ++i)
        std::copy_n(&tile[std::size_t(i) * values], values, &rows[std::size_t((ready + i) % ring) * values]);
      ready += n;
    }
    std::fill(down.begin(), down.end(), 0.f);
    for (int k = 0; k < taps; ++k) {
      const float* in = &rows[std::size_t(std::clamp(first + k, 0, fine_rows - 1) % ring) * values];
      add_scaled(down.data(), kernel.weight[std::size_t(k)], in, values);
    }
    for (int p = 0; p < parts; ++p)
      for (int c = 0; c < 3; ++c) {
        float* out = &phases[std::size_t(3 * p + c) * phase_length];
        for (int x = -pad; x < width + after; ++x)
          out[x + pad] = down[std::size_t(3 * std::clamp(x * parts + p, 0, width * parts - 1) + c)];
      }
    std::fill(across.begin(), across.end(), 0.f);
    for (int k = 0; k < taps; ++k) {
      const int part = k - kernel.before + pad * parts;  // of the padded row, for pixel 0; >= 0
      const float g = kernel.weight[std::size_t(k)];
      for (int c = 0; c < 3; ++c) {
        const float* in = &phases[std::size_t(3 * (part % parts) + c) * phase_length + std::size_t(part / parts)];
        add_scaled(&across[std::size_t(c) * std::size_t(width)], g, in, std::size_t(width));
      }
    }
    float* out = image.row<float>(y);
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) out[3 * x + c] = across[std::size_t(c) * std::size_t(width) + std::size_t(x)];
  }
  return image;
}

}  // namespace

Image blurred_coverage(std::span<const View> views, std::span<const FlatPrint> prints,
                       const Eigen::Vector3f& background, int lines, double sigma) {
  const int width = views[0].camera.width, height = views[0].camera.height;
  // Gaussians much narrower than a part are not seen by its samples.
  const int parts = sigma > 0 ? std::clamp(int(std::ceil(.75 / sigma)), kParts, 8) : 1;
  MeanCoverage coverage(views, prints, background, lines, parts);
  if (sigma > 0) {
    const double fine = sigma < kAllFine ? sigma : kFineSigma;
    Image image = sampled(coverage, width, height, fine, parts);
    if (fine < sigma) gaussian_blur(image, std::sqrt(sigma * sigma - fine * fine));
    return image;
  }
  Image image = Image::uninitialized(width, height, 3, PixelType::f32);
  for (int y = 0; y < height; y += FlatCoverage::kTile)
    coverage.tile_row(y, image.row<float>(y),
                      std::size_t(3) * std::size_t(width) * std::size_t(std::min(FlatCoverage::kTile, height - y)));
  return image;
}

}  // namespace lumihull::rig
