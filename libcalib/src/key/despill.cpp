#include <lumihull/base/error.h>
#include <lumihull/calib/despill.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace lumihull::calib {
namespace {

/// What is left of a colour without its grey.
Eigen::Vector3f chroma(const Eigen::Vector3f& c) { return c.array() - c.mean(); }

}  // namespace

Despill::Despill(std::span<const ColorCount> background) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double n = 0;
  for (const ColorCount& c : background) {
    sum += double(c.count) * Eigen::Vector3d(c.color[0], c.color[1], c.color[2]);
    n += c.count;
  }
  if (n == 0) throw Error(ErrorCode::invalid_argument, "expected background samples", "despill");
  const Eigen::Vector3f mean = (sum / n).cast<float>(), hue = chroma(mean);
  // Below five percent of saturation the hue is the noise's.
  if (hue.norm() < 0.05f * std::max(mean.norm(), 20.0f)) return;
  axis_ = hue.normalized();
  lower_ = axis_.cwiseMax(0.0f);
  lower_ /= axis_.dot(lower_);

  // Cosines of hue, weighted by count: the angle that holds 95 % of the samples that have a hue.
  std::vector<std::pair<float, double>> cosines;
  double weight = 0;
  for (const ColorCount& c : background) {
    const Eigen::Vector3f d = chroma(Eigen::Vector3f(c.color[0], c.color[1], c.color[2]));
    if (d.norm() < 8) continue;
    cosines.emplace_back(axis_.dot(d.normalized()), c.count);
    weight += c.count;
  }
  std::sort(cosines.begin(), cosines.end());
  double left = 0.05 * weight;
  float angle = 0.1f;
  for (const auto& [cosine, count] : cosines) {
    left -= count;
    if (left > 0) continue;
    angle = std::clamp(std::acos(std::clamp(cosine, -1.0f, 1.0f)), 0.1f, 0.7f);
    break;
  }
  cos_inner_ = std::cos(angle);
  cos_outer_ = std::cos(2 * angle);
}

Eigen::Vector3f Despill::operator()(const Eigen::Vector3f& color, SpillMode mode, float strength) const {
  if (neutral()) return color;
  // a · colour with a's sum of zero put in: exactly zero for a grey.
  const float spill = axis_.x() * (color.x() - color.y()) + axis_.z() * (color.z() - color.y());
  if (!(spill > 0)) return color;
  if (mode == SpillMode::limit) return (color - strength * spill * lower_).cwiseMax(color.cwiseMin(0.0f));
  const Eigen::Vector3f d = chroma(color);
  const float length = d.norm();
  if (!(length > 0)) return color;
  const float share = std::clamp((spill / length - cos_outer_) / (cos_inner_ - cos_outer_), 0.0f, 1.0f);
  // Rec. 709 weights, so that lightness stays.
  const float grey = 0.2126f * color.x() + 0.7152f * color.y() + 0.0722f * color.z();
  return color + strength * share * (Eigen::Vector3f::Constant(grey) - color);
}

void Despill::apply(Image& photo, SpillMode mode, float strength) const {
  if (photo.channels() < 3)
    throw Error(ErrorCode::invalid_argument, "expected a colour photograph (3 or 4 channels)", "despill");
  if (!(strength >= 0 && strength <= 1))
    throw Error(ErrorCode::invalid_argument, "strength: expected 0 to 1", "despill");
  if (neutral()) return;
  const auto run = [&](auto zero, auto store) {
    using T = decltype(zero);
    for (int y = 0; y < photo.height(); ++y) {
      T* p = photo.row<T>(y);
      for (int x = 0; x < photo.width(); ++x, p += photo.channels()) {
        const Eigen::Vector3f c = (*this)(Eigen::Vector3f(float(p[0]), float(p[1]), float(p[2])), mode, strength);
        for (int i = 0; i < 3; ++i) p[i] = store(c[i]);
      }
    }
  };
  if (photo.type() == PixelType::u8)
    run(std::uint8_t(0), [](float v) { return std::uint8_t(std::clamp(v, 0.0f, 255.0f) + 0.5f); });
  if (photo.type() == PixelType::u16)
    run(std::uint16_t(0), [](float v) { return std::uint16_t(std::clamp(v, 0.0f, 65535.0f) + 0.5f); });
  if (photo.type() == PixelType::f32) run(0.0f, [](float v) { return v; });
}

}  // namespace lumihull::calib
