#include <lumihull/base/error.h>
#include <lumihull/slf/metrics.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace lumihull::slf {
namespace {

constexpr int kRadius = 5;  // of SSIM's window

void require_pair(const Image& a, const Image& b, int channels) {
  const auto is = [&](const Image& i) { return i.type() == PixelType::u8 && i.channels() == channels && !i.empty(); };
  if (!is(a) || !is(b))
    throw Error(ErrorCode::invalid_argument, "expected 8-bit pictures of " + std::to_string(channels) + " channels");
  if (a.width() != b.width() || a.height() != b.height())
    throw Error(ErrorCode::invalid_argument, "expected pictures of one size: " + std::to_string(a.width()) + " x " +
                                                 std::to_string(a.height()) + " and " + std::to_string(b.width()) +
                                                 " x " + std::to_string(b.height()));
}

void require_mask(const Image& mask, const Image& picture) {
  if (mask.type() != PixelType::u8 || mask.channels() != 1 || mask.width() != picture.width() ||
      mask.height() != picture.height())
    throw Error(ErrorCode::invalid_argument, "expected an 8-bit mask of the picture's size");
}

std::array<double, 2 * kRadius + 1> window() {
  std::array<double, 2 * kRadius + 1> w;
  double sum = 0;
  for (int i = -kRadius; i <= kRadius; ++i) sum += w[i + kRadius] = std::exp(-0.5 * i * i / (1.5 * 1.5));
  for (double& x : w) x /= sum;
  return w;
}

struct Mean {
  double sum = 0;
  std::uint64_t count = 0;
  double value() const { return count ? sum / double(count) : std::numeric_limits<double>::quiet_NaN(); }
};

struct SsimMeans {
  Mean whole, inside;
};

/// Walks down the picture with a ring of 11 rows, each holding the five horizontally smoothed moments of a channel.
SsimMeans ssim_means(const Image& a, const Image& b, const Image* mask) {
  const int width = a.width(), height = a.height();
  if (width <= 2 * kRadius || height <= 2 * kRadius)
    throw Error(ErrorCode::invalid_argument, "expected pictures of at least 11 x 11 pixels");
  const auto w = window();
  constexpr double kC1 = (0.01 * 255) * (0.01 * 255), kC2 = (0.03 * 255) * (0.03 * 255);
  const int columns = width - 2 * kRadius, taps = 2 * kRadius + 1;

  SsimMeans means;
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<double> ring(std::size_t(taps) * columns * 5), moments(std::size_t(columns) * 5);
    std::vector<double> source(std::size_t(width) * 5);
    for (int y = 0; y < height; ++y) {
      const std::uint8_t *pa = a.row<std::uint8_t>(y), *pb = b.row<std::uint8_t>(y);
      for (int x = 0; x < width; ++x) {
        const double va = pa[3 * x + channel], vb = pb[3 * x + channel];
        double* s = &source[std::size_t(x) * 5];
        s[0] = va, s[1] = vb, s[2] = va * va, s[3] = vb * vb, s[4] = va * vb;
      }
      double* smooth = &ring[std::size_t(y % taps) * columns * 5];
      for (int i = 0; i < columns * 5; ++i) {
        double sum = 0;
        for (int t = 0; t < taps; ++t) sum += w[t] * source[i + 5 * t];
        smooth[i] = sum;
      }
      if (y < 2 * kRadius) continue;

      std::fill(moments.begin(), moments.end(), 0.0);
      for (int t = 0; t < taps; ++t) {
        const double* r = &ring[std::size_t((y - 2 * kRadius + t) % taps) * columns * 5];
        for (int i = 0; i < columns * 5; ++i) moments[i] += w[t] * r[i];
      }
      const std::uint8_t* m = mask ? mask->row<std::uint8_t>(y - kRadius) + kRadius : nullptr;
      for (int x = 0; x < columns; ++x) {
        const double* s = &moments[std::size_t(x) * 5];
        const double va = s[2] - s[0] * s[0], vb = s[3] - s[1] * s[1], vab = s[4] - s[0] * s[1];
        const double value =
            (2 * s[0] * s[1] + kC1) * (2 * vab + kC2) / ((s[0] * s[0] + s[1] * s[1] + kC1) * (va + vb + kC2));
        means.whole.sum += value, ++means.whole.count;
        if (m && m[x] >= 128) means.inside.sum += value, ++means.inside.count;
      }
    }
  }
  return means;
}

std::uint8_t mix(int value, int background, int alpha) {
  return std::uint8_t((value * alpha + background * (255 - alpha) + 127) / 255);
}

}  // namespace

double psnr(const Image& picture, const Image& reference, const Image* mask) {
  require_pair(picture, reference, 3);
  if (mask) require_mask(*mask, picture);
  std::uint64_t sum = 0, count = 0;  // exact: at most 4e8 pixels x 3 x 255²
  for (int y = 0; y < picture.height(); ++y) {
    const std::uint8_t *a = picture.row<std::uint8_t>(y), *b = reference.row<std::uint8_t>(y);
    const std::uint8_t* m = mask ? mask->row<std::uint8_t>(y) : nullptr;
    for (int x = 0; x < picture.width(); ++x) {
      if (m && m[x] < 128) continue;
      for (int c = 0; c < 3; ++c) {
        const int d = int(a[3 * x + c]) - b[3 * x + c];
        sum += std::uint64_t(d * d);
      }
      count += 3;
    }
  }
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  if (sum == 0) return kPsnrIdentical;
  return std::min(kPsnrIdentical, 10 * std::log10(255.0 * 255.0 * double(count) / double(sum)));
}

double ssim(const Image& picture, const Image& reference, const Image* mask) {
  require_pair(picture, reference, 3);
  if (mask) require_mask(*mask, picture);
  const SsimMeans means = ssim_means(picture, reference, mask);
  return mask ? means.inside.value() : means.whole.value();
}

PictureQuality compare_pictures(const Image& picture, const Image& reference, const Image& mask) {
  require_pair(picture, reference, 3);
  require_mask(mask, picture);
  const SsimMeans means = ssim_means(picture, reference, &mask);
  return {psnr(picture, reference), means.whole.value(), psnr(picture, reference, &mask), means.inside.value()};
}

double silhouette_iou(const Image& a, const Image& b) {
  require_pair(a, b, 1);
  std::uint64_t both = 0, either = 0;
  for (int y = 0; y < a.height(); ++y) {
    const std::uint8_t *pa = a.row<std::uint8_t>(y), *pb = b.row<std::uint8_t>(y);
    for (int x = 0; x < a.width(); ++x) {
      both += (pa[x] >= 128) & (pb[x] >= 128);
      either += (pa[x] >= 128) | (pb[x] >= 128);
    }
  }
  return either ? double(both) / double(either) : 1.0;
}

Image composited(const Image& rgb, const Image& alpha, const std::array<std::uint8_t, 3>& background) {
  require_pair(rgb, rgb, 3);
  require_mask(alpha, rgb);
  Image out(rgb.width(), rgb.height(), 3);
  for (int y = 0; y < rgb.height(); ++y) {
    const std::uint8_t *s = rgb.row<std::uint8_t>(y), *a = alpha.row<std::uint8_t>(y);
    std::uint8_t* d = out.row<std::uint8_t>(y);
    for (int x = 0; x < rgb.width(); ++x)
      for (int c = 0; c < 3; ++c) d[3 * x + c] = mix(s[3 * x + c], background[c], a[x]);
  }
  return out;
}

Image composited(const Image& rgba, const std::array<std::uint8_t, 3>& background) {
  require_pair(rgba, rgba, 4);
  Image out(rgba.width(), rgba.height(), 3);
  for (int y = 0; y < rgba.height(); ++y) {
    const std::uint8_t* s = rgba.row<std::uint8_t>(y);
    std::uint8_t* d = out.row<std::uint8_t>(y);
    for (int x = 0; x < rgba.width(); ++x)
      for (int c = 0; c < 3; ++c) d[3 * x + c] = mix(s[4 * x + c], background[c], s[4 * x + 3]);
  }
  return out;
}

}  // namespace lumihull::slf
