#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/calib/color_key.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>

namespace lumihull::calib {

enum class SpillMode : std::uint8_t {
  limit,       ///< the channels that make up the enclosure's hue are lowered until no such hue is left
  desaturate,  ///< the paper's (section 5): colours whose hue is the enclosure's are moved to their grey
};

/// Takes the enclosure's light off the object, for an enclosure of any hue.
///
/// From the background samples: a = the unit direction of the mean colour's chroma (the mean minus its grey), and the
/// half-angle of hue around it that holds 95 % of the samples' chroma. A colour's spill is t = a · colour, zero for
/// greys. `limit` subtracts max(t, 0) w with w = max(a, 0) scaled to a · w = 1: for a pure green this is the usual
/// G' = min(G, (R + B) / 2), for a pure blue B' = min(B, (R + G) / 2). No channel ever rises.
class LUMIHULL_API Despill {
 public:
  /// Errors: invalid_argument (no samples).
  explicit Despill(std::span<const ColorCount> background);

  /// Chroma axis a; (0, 0, 0) for a grey enclosure, which bleeds no hue: then `apply` changes nothing.
  const Eigen::Vector3f& axis() const noexcept { return axis_; }
  bool neutral() const noexcept { return axis_.isZero(); }

  /// A colour with channels 0 … 1 (or any other common scale). strength: 0 … 1.
  Eigen::Vector3f operator()(const Eigen::Vector3f& color, SpillMode mode, float strength = 1) const;

  /// The same for every pixel; 3 or 4 channels, any pixel type; alpha is left alone.
  void apply(Image& photo, SpillMode mode, float strength = 1) const;

 private:
  Eigen::Vector3f axis_ = Eigen::Vector3f::Zero(), lower_ = Eigen::Vector3f::Zero();
  float cos_inner_ = 1, cos_outer_ = 1;
};

}  // namespace lumihull::calib
