#include <lumihull/base/error.h>
#include <lumihull/rig/flat_print.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "light/srgb_table.h"
#include "objects/noise.h"
#include "photograph/bayer.h"
#include "photograph/blurred_coverage.h"

namespace lumihull::rig {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

constexpr int kMaxSamples = 256;
constexpr double kMaxBlur = 100;

[[noreturn]] void refuse(const std::string& what, const std::string& subject) {
  throw Error(ErrorCode::invalid_argument, what, subject);
}

void check(const PrintPhotoOptions& o) {
  if (o.edge_samples < 1 || o.edge_samples > kMaxSamples) refuse("must be 1 to 256", "edge_samples");
  if (!(o.blur_px >= 0 && o.blur_px <= kMaxBlur)) refuse("must be 0 to 100", "blur_px");
  if (!(std::isfinite(o.exposure) && o.exposure >= 0)) refuse("must be finite, at least 0", "exposure");
  if (!o.shading.allFinite()) refuse("must be finite", "shading");
  if (!(std::isfinite(o.noise_read) && o.noise_read >= 0)) refuse("must be finite, at least 0", "noise_read");
  if (!(std::isfinite(o.noise_shot) && o.noise_shot >= 0)) refuse("must be finite, at least 0", "noise_shot");
  if (o.jpeg_quality < 0 || o.jpeg_quality > 100) refuse("must be 0 (no JPEG) to 100", "jpeg_quality");
}

void check(const FlatPrint& print, std::size_t i) {
  const std::string name = "print " + std::to_string(i);
  if (!(print.low.allFinite() && print.high.allFinite() && (print.high - print.low).minCoeff() > 0))
    refuse("the sheet's high must be above its low", name);
  if (!print.paper.allFinite()) refuse("paper is not finite", name);
  if (!(print.world_from_print.rotation.coeffs().allFinite() && print.world_from_print.translation.allFinite()))
    refuse("world_from_print is not finite", name);
  if (!(print.stretch.allFinite() && print.stretch.minCoeff() > 0)) refuse("stretch must be finite, above 0", name);
  for (const FlatShape& s : print.shapes) {
    if (!s.color.allFinite()) refuse("a shape's colour is not finite", name);
    if (s.radius > 0 ? !(s.center.allFinite() && std::isfinite(s.radius)) : s.polygon.size() < 3)
      refuse("a shape is neither a disc with a finite centre nor a polygon of at least 3 points", name);
    for (const Vector2d& p : s.polygon)
      if (!p.allFinite()) refuse("a polygon's point is not finite", name);
  }
}

/// Exposure and uneven light.
void light(Image& image, const PrintPhotoOptions& o) {
  if (o.exposure == 1 && o.shading.isZero()) return;
  for (int y = 0; y < image.height(); ++y) {
    float* row = image.row<float>(y);
    const float down = 1 + o.shading.y() * ((float(y) + .5f) / float(image.height()) - .5f);
    for (int x = 0; x < image.width(); ++x) {
      const float across = o.shading.x() * ((float(x) + .5f) / float(image.width()) - .5f);
      const float factor = float(o.exposure) * std::max(0.f, down + across);
      for (int c = 0; c < 3; ++c) row[3 * x + c] *= factor;
    }
  }
}

void add_noise(Image& image, const PrintPhotoOptions& o, std::uint64_t seed) {
  if (o.noise_read == 0 && o.noise_shot == 0) return;
  const float read = float(o.noise_read * o.noise_read), shot = float(o.noise_shot);
  const std::size_t values = std::size_t(image.width()) * 3;
  const std::uint64_t start = mix(seed);
  for (int y = 0; y < image.height(); ++y) {
    float* row = image.row<float>(y);
    for (std::size_t i = 0; i < values; ++i)
      row[i] += std::sqrt(read + shot * std::max(0.f, row[i])) *
                gaussian(mix(start + (std::uint64_t(y) * values + i) * 0xd1342543de82ef95ull));
  }
}

Image to_srgb(const Image& light) {
  Image picture = Image::uninitialized(light.width(), light.height(), 3);
  const std::vector<std::uint8_t>& table = srgb_table();
  const std::size_t values = std::size_t(light.width()) * 3;
  for (int y = 0; y < light.height(); ++y) {
    const float* in = light.row<float>(y);
    std::uint8_t* out = picture.row<std::uint8_t>(y);
    for (std::size_t i = 0; i < values; ++i) out[i] = table[std::size_t(std::clamp(in[i], 0.f, 1.f) * 65535.f + .5f)];
  }
  return picture;
}

}  // namespace

Image photograph_prints(const View& view, std::span<const FlatPrint> prints, const Vector3f& background,
                        const PrintPhotoOptions& options, std::uint64_t seed, bool linear) {
  view.camera.validate();
  check(options);
  if (!background.allFinite()) refuse("must be finite", "background");
  for (std::size_t i = 0; i < prints.size(); ++i) check(prints[i], i);

  Image image = blurred_coverage({&view, 1}, prints, background, options.edge_samples, options.blur_px);
  light(image, options);
  add_noise(image, options, seed);
  if (options.bayer) image = through_bayer(image, !linear);
  if (linear) return image;
  Image picture = to_srgb(image);
  if (options.jpeg_quality == 0) return picture;
  const std::string jpeg = encode_jpeg(picture, options.jpeg_quality);
  return decode_image(std::as_bytes(std::span(jpeg)), "photograph of prints");
}

}  // namespace lumihull::rig
