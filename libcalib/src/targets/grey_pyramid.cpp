// Bytes to look for circles on: one plane of the photograph, and its halves.
#include "grey_pyramid.h"

#include <lumihull/base/parallel.h>
#include <lumihull/calib/key_image.h>

#include <algorithm>
#include <cmath>

namespace lumihull::calib {

namespace {

constexpr int kSmallestSide = 16;
constexpr int kBand = 64;  // rows that a thread takes at a time; even, so that halves line up

// Rows [first, last) of the level of half the size.
void halve_rows(const GreyLevel& from, GreyLevel& to, int first, int last) {
  for (int y = first; y < last; ++y) {
    const std::uint8_t *a = from.row(2 * y), *b = from.row(2 * y + 1);
    std::uint8_t* out = to.pixels.row<std::uint8_t>(y);
    for (int x = 0; x < to.width; ++x)
      out[x] = std::uint8_t((a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1] + 2) >> 2);
  }
}

GreyLevel half_of(const GreyLevel& level) {
  GreyLevel half;
  half.width = level.width / 2;
  half.height = level.height / 2;
  half.pixels = Image::uninitialized(half.width, half.height, 1);
  return half;
}

bool may_be_halved(const GreyLevel& level) {
  return level.width / 2 >= kSmallestSide && level.height / 2 >= kSmallestSide;
}

// Makes rows [first, last) of the first level by `row(y, out)` (or finds them there) and halves them while they are in
// the cache; then the smaller levels.
template <class Row>
GreyPyramid build(GreyLevel base, Job& job, const Row& row) {
  GreyPyramid pyramid;
  pyramid.push_back(std::move(base));
  GreyLevel half;
  const bool halved = may_be_halved(pyramid[0]);
  if (halved) half = half_of(pyramid[0]);
  parallel_chunks(job, std::size_t(pyramid[0].height), kBand, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y) row(int(y), pyramid[0]);
    if (halved) halve_rows(pyramid[0], half, int(first) / 2, std::min(int(last) / 2, half.height));
  });
  if (halved) pyramid.push_back(std::move(half));
  while (pyramid.size() > 1 && may_be_halved(pyramid.back())) {
    GreyLevel next = half_of(pyramid.back());
    parallel_chunks(job, std::size_t(next.height), kBand, [&](std::size_t first, std::size_t last) {
      halve_rows(pyramid.back(), next, int(first), int(last));
    });
    pyramid.push_back(std::move(next));
  }
  return pyramid;
}

GreyLevel base_level(const Image& photo, bool borrow) {
  GreyLevel level;
  level.width = photo.width();
  level.height = photo.height();
  if (borrow)
    level.borrowed = photo.row<std::uint8_t>(0);
  else
    level.pixels = Image::uninitialized(level.width, level.height, 1);
  return level;
}


}  // namespace

const Image& eight_bit(const Image& photo, Image& storage) {
  const int channels = photo.channels();
  if (photo.type() == PixelType::u8 && (channels == 1 || channels == 3)) return photo;
  if (channels >= 3) {
    storage = keyable(photo);
    return storage;
  }
  storage = Image::uninitialized(photo.width(), photo.height(), 1);
  for (int y = 0; y < photo.height(); ++y) {
    std::uint8_t* out = storage.row<std::uint8_t>(y);
    for (int x = 0; x < photo.width(); ++x) {
      const int i = x * channels;
      if (photo.type() == PixelType::u8) out[x] = photo.row<std::uint8_t>(y)[i];
      if (photo.type() == PixelType::u16) out[x] = std::uint8_t((photo.row<std::uint16_t>(y)[i] + 128u) / 257u);
      if (photo.type() == PixelType::f32) {
        const float v = photo.row<float>(y)[i];
        out[x] = v > 0 ? std::uint8_t(std::min(v, 1.0f) * 255.0f + 0.5f) : std::uint8_t(0);
      }
    }
  }
  return storage;
}

GreyPyramid grey_pyramid(const Image& photo, const std::array<float, 3>& weights, Job& job) {
  const bool grey = photo.channels() == 1;
  if (grey) return build(base_level(photo, true), job, [](int, GreyLevel&) {});
  const float sum = std::abs(weights[0]) + std::abs(weights[1]) + std::abs(weights[2]);
  int w[3], offset = 128;
  for (int c = 0; c < 3; ++c) {
    w[c] = int(std::lround(256 * weights[std::size_t(c)] / sum));
    if (w[c] < 0) offset -= 255 * w[c];
  }
  const int r = w[0], g = w[1], b = w[2];
  return build(base_level(photo, false), job, [&photo, r, g, b, offset](int y, GreyLevel& level) {
    const std::uint8_t* in = photo.row<std::uint8_t>(y);
    std::uint8_t* out = level.pixels.row<std::uint8_t>(y);
    const int width = level.width;
    for (int x = 0; x < width; ++x)
      out[x] = std::uint8_t(std::min((r * in[3 * x] + g * in[3 * x + 1] + b * in[3 * x + 2] + offset) >> 8, 255));
  });
}

GreyPyramid negative(const GreyPyramid& pyramid, Job& job) {
  GreyPyramid negatives;
  for (const GreyLevel& level : pyramid) {
    GreyLevel& to = negatives.emplace_back();
    to.width = level.width, to.height = level.height;
    to.pixels = Image::uninitialized(to.width, to.height, 1);
    parallel_chunks(job, std::size_t(to.height), kBand, [&](std::size_t first, std::size_t last) {
      for (std::size_t y = first; y < last; ++y) {
        const std::uint8_t* in = level.row(int(y));
        std::uint8_t* out = to.pixels.row<std::uint8_t>(int(y));
        for (int x = 0; x < to.width; ++x) out[x] = std::uint8_t(255 - in[x]);
      }
    });
  }
  return negatives;
}

GreyPyramid key_pyramid(const Image& photo, const ColorKey& ink, Job& job) {
  return build(base_level(photo, false), job, [&](int y, GreyLevel& level) {
    std::vector<std::uint64_t> bits((std::size_t(level.width) + 63) / 64);
    ink.decide(photo.row<std::uint8_t>(y), std::size_t(level.width), bits.data());
    std::uint8_t* out = level.pixels.row<std::uint8_t>(y);
    for (int x = 0; x < level.width; ++x) out[x] = std::uint8_t((bits[std::size_t(x) >> 6] >> (x & 63) & 1) - 1);
  });
}

std::array<float, 8> grey_noise(const GreyLevel& level) {
  constexpr int kBins = 8;
  std::array<std::array<std::uint32_t, 256>, kBins> histogram{};
  const int step_y = std::max(1, level.height / 128), step_x = std::max(1, level.width / 512);
  for (int y = step_y / 2; y < level.height; y += step_y) {
    const std::uint8_t* row = level.row(y);
    for (int x = 1; x + 1 < level.width; x += step_x) {
      const int d = std::abs(row[x - 1] - 2 * row[x] + row[x + 1]);
      ++histogram[row[x] >> 5][std::size_t(std::min(d, 255))];
    }
  }
  std::array<float, kBins> sigma{};
  for (int b = 0; b < kBins; ++b) {
    std::uint32_t total = 0, below = 0;
    for (const std::uint32_t n : histogram[std::size_t(b)]) total += n;
    if (total < 50) continue;
    for (int d = 0; d < 256; ++d) {
      const std::uint32_t n = histogram[std::size_t(b)][std::size_t(d)];
      if (2 * (below + n) > total) {
        // The median within its step of one grey value; |second difference| of noise s has the median 0.6745 √6 s.
        const float median = float(d) - 0.5f + (0.5f * float(total) - float(below)) / float(n);
        sigma[std::size_t(b)] = std::max(0.0f, median) / 1.652f;
        break;
      }
      below += n;
    }
  }
  // Edges take part where a range has no smooth places: noise grows towards the dark as sRGB's slope does, not faster.
  for (int b = kBins - 2; b >= 0; --b)
    if (sigma[std::size_t(b) + 1] > 0)
      sigma[std::size_t(b)] = std::min(sigma[std::size_t(b)], 2 * sigma[std::size_t(b) + 1]);
  return sigma;
}

}  // namespace lumihull::calib
