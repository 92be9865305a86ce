#include "develop.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "bayer.h"
#include "light/srgb_table.h"
#include "objects/noise.h"

namespace lumihull::rig {

namespace {

constexpr std::size_t kRows = 16;  ///< rows in a chunk of work

/// Keys 1981, a = -1/2: weights of the samples at -1, 0, 1, 2 for a place t in [0, 1) behind sample 0.
std::array<float, 4> cubic_weights(float t) {
  const float t2 = t * t, t3 = t2 * t;
  return {-.5f * t3 + t2 - .5f * t, 1.5f * t3 - 2.5f * t2 + 1, -1.5f * t3 + 2 * t2 + .5f * t, .5f * t3 - .5f * t2};
}

struct Tap {
  std::array<int, 4> at;
  std::array<float, 4> weight;
};

std::vector<Tap> taps(int n, int source, int factor) {
  std::vector<Tap> result(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const float x = (float(i) + .5f) / float(factor) - .5f;
    const int x0 = int(std::floor(x));
    Tap& tap = result[std::size_t(i)];
    tap.weight = cubic_weights(x - float(x0));
    for (int k = 0; k < 4; ++k) tap.at[std::size_t(k)] = std::clamp(x0 - 1 + k, 0, source - 1);
  }
  return result;
}

}  // namespace

Image develop(const Image& light, const PhotoOptions& options, std::uint64_t seed, Job& job) {
  Image exposed(light.width(), light.height(), 3, PixelType::f32);
  const std::vector<std::uint8_t>& table = srgb_table();
  const std::size_t values = std::size_t(light.width()) * 3;
  const float gain = float(options.exposure);
  // Variance of the linear value: shot noise x / full_well, read noise (read / full_well)².
  const float shot = options.full_well > 0 ? float(1 / options.full_well) : 0;
  const float read = options.full_well > 0 ? float(options.read_noise / options.full_well) : 0;
  parallel_chunks(job, std::size_t(light.height()), kRows, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y) {
      const float* in = light.row<float>(int(y));
      float* out = exposed.row<float>(int(y));
      for (std::size_t i = 0; i < values; ++i) {
        float x = std::max(0.f, in[i] * gain);
        if (shot > 0)
          x += std::sqrt(x * shot + read * read) * gaussian(mix(seed + (y * values + i) * 0xd1342543de82ef95ull));
        out[i] = x;
      }
    }
  });
  if (options.bayer) exposed = through_bayer(exposed, true);
  Image picture = Image::uninitialized(light.width(), light.height(), 3);
  parallel_chunks(job, std::size_t(light.height()), kRows, [&](std::size_t first, std::size_t last) {
    for (int y = int(first); y < int(last); ++y) {
      const float* in = exposed.row<float>(y);
      std::uint8_t* out = picture.row<std::uint8_t>(y);
      for (std::size_t i = 0; i < values; ++i) out[i] = table[std::size_t(std::clamp(in[i], 0.f, 1.f) * 65535.f + .5f)];
    }
  });
  return picture;
}

Image enlarge(const Image& image, int factor, int width, int height, Job& job) {
  const int channels = image.channels();
  Image result(width, height, channels, PixelType::f32);
  const std::vector<Tap> across = taps(width, image.width(), factor), down = taps(height, image.height(), factor);
  parallel_chunks(job, std::size_t(height), kRows, [&](std::size_t first, std::size_t last) {
    std::vector<float> column(std::size_t(image.width()) * std::size_t(channels));
    for (std::size_t y = first; y < last; ++y) {
      const Tap& v = down[y];
      const float* r0 = image.row<float>(v.at[0]);
      const float* r1 = image.row<float>(v.at[1]);
      const float* r2 = image.row<float>(v.at[2]);
      const float* r3 = image.row<float>(v.at[3]);
      for (std::size_t i = 0; i < column.size(); ++i)
        column[i] = v.weight[0] * r0[i] + v.weight[1] * r1[i] + v.weight[2] * r2[i] + v.weight[3] * r3[i];
      float* out = result.row<float>(int(y));
      for (const Tap& h : across)
        for (int c = 0; c < channels; ++c) {
          float sum = 0;
          for (std::size_t k = 0; k < 4; ++k) sum += h.weight[k] * column[std::size_t(h.at[k] * channels + c)];
          *out++ = sum;
        }
    }
  });
  return result;
}

}  // namespace lumihull::rig
