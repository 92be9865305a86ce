// A photograph as one number a pixel, in linear light.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/light_plane.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "plane_noise.h"

namespace lumihull::calib {
namespace {

// A channel that counts for less than this share says nothing about clipping.
constexpr float kClipShare = 0.05f;
// Added to a channel's share where it is clipped: far above what any sum of shares can be.
constexpr float kClipped = 8;

/// Share of each channel's values in the plane: tables[c][v] = w_c · linear(v).
template <int kValues>
std::vector<float> share_tables(const Eigen::Vector3f& weights, int channels) {
  std::vector<float> linear(kValues), tables(std::size_t(channels) * kValues);
  for (int v = 0; v < kValues; ++v) linear[std::size_t(v)] = linear_from_srgb(float(v) / float(kValues - 1));
  for (int c = 0; c < channels; ++c) {
    float* table = tables.data() + std::size_t(c) * kValues;
    for (int v = 0; v < kValues; ++v) table[v] = weights[c] * linear[std::size_t(v)];
    if (std::abs(weights[c]) >= kClipShare) table[kValues - 1] += kClipped;
  }
  return tables;
}

/// kRead channels of `stride` are looked up; clipped pixels get the value `clip`.
template <class T, int kValues, int kRead, int kStride>
void look_up(const T* in, const float* tables, float clip, int width, float* out) {
  for (int x = 0; x < width; ++x) {
    float v = tables[in[kStride * x]];
    for (int c = 1; c < kRead; ++c) v += tables[c * kValues + in[kStride * x + c]];
    out[x] = v > 0.5f * kClipped ? clip : v;
  }
}

template <class T, int kValues>
void look_up_row(const Image& photo, int y, const float* tables, float clip, float* out) {
  const T* in = photo.row<T>(y);
  if (photo.channels() == 1) return look_up<T, kValues, 1, 1>(in, tables, clip, photo.width(), out);
  if (photo.channels() == 3) return look_up<T, kValues, 3, 3>(in, tables, clip, photo.width(), out);
  look_up<T, kValues, 3, 4>(in, tables, clip, photo.width(), out);
}

void convert_row(const Image& photo, int y, const Eigen::Vector3f& weights, float clip, float* out) {
  const float* in = photo.row<float>(y);
  const int channels = photo.channels(), read = channels == 1 ? 1 : 3;
  for (int x = 0; x < photo.width(); ++x, in += channels) {
    float v = 0;
    bool clipped = false;
    for (int c = 0; c < read; ++c) {
      const float s = std::isfinite(in[c]) ? std::clamp(in[c], 0.0f, 1.0f) : 0;
      v += weights[c] * linear_from_srgb(s);
      clipped |= s >= 1 && std::abs(weights[c]) >= kClipShare;
    }
    out[x] = clipped ? clip : v;
  }
}

}  // namespace

Eigen::Vector3f contrast_weights(const Eigen::Vector3f& ink, const Eigen::Vector3f& paper) {
  const Eigen::Vector3f difference = paper - ink;
  const float sum = difference.cwiseAbs().sum();
  if (!difference.allFinite() || !(sum > 0)) return {.25f, .5f, .25f};
  return difference / sum;
}

LightPlane light_plane(const Image& photo, const Eigen::Vector3f& weights, Job& job) {
  if (photo.empty()) throw Error(ErrorCode::invalid_argument, "the picture is empty", "light plane");
  if (!weights.allFinite() || !(weights.cwiseAbs().sum() > 0))
    throw Error(ErrorCode::invalid_argument, "weights must be finite and not all zero", "light plane");
  const int channels = photo.channels() == 1 ? 1 : 3;
  const Eigen::Vector3f w =
      channels == 1 ? Eigen::Vector3f(1, 0, 0) : Eigen::Vector3f(weights / weights.cwiseAbs().sum());

  LightPlane plane;
  plane.values = Image::uninitialized(photo.width(), photo.height(), 1, PixelType::f32);
  // Nothing that isn't clipped reaches the sum of the positive weights.
  plane.saturation = w.cwiseMax(0).sum();
  if (!(plane.saturation > 0)) plane.saturation = 1;
  const std::vector<float> tables = photo.type() == PixelType::u8    ? share_tables<256>(w, channels)
                                    : photo.type() == PixelType::u16 ? share_tables<65536>(w, channels)
                                                                     : std::vector<float>();
  constexpr std::size_t kRows = 64;
  parallel_chunks(job, std::size_t(photo.height()), kRows, [&](std::size_t first, std::size_t last) {
    for (int y = int(first); y < int(last); ++y) {
      float* out = plane.values.row<float>(y);
      if (photo.type() == PixelType::u8)
        look_up_row<std::uint8_t, 256>(photo, y, tables.data(), plane.saturation, out);
      else if (photo.type() == PixelType::u16)
        look_up_row<std::uint16_t, 65536>(photo, y, tables.data(), plane.saturation, out);
      else
        convert_row(photo, y, w, plane.saturation, out);
    }
  });
  const double step = photo.type() == PixelType::u8 ? 1.0 / 255 : photo.type() == PixelType::u16 ? 1.0 / 65535 : 0;
  plane.noise = estimate_noise(plane.values, plane.saturation, step, w.norm());
  return plane;
}

LightPlane light_plane(const Image& photo, const Eigen::Vector3f& weights) {
  Job job({}, 1);
  return light_plane(photo, weights, job);
}

}  // namespace lumihull::calib
