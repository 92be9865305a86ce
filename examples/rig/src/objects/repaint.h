#pragma once

#include <lumihull/rig/object.h>

#include <array>
#include <cstdint>
#include <optional>

namespace lumihull::rig {

/// How an object is to look other than it is.
struct Repaint {
  bool matt = false;     ///< no gloss, of any of its materials
  bool uniform = false;  ///< the first material's first colour all over: no pattern, no grain, no texture
  std::optional<std::array<std::uint8_t, 3>> unlit =
      std::nullopt;     ///< this colour (8-bit sRGB) in photographs, whatever the light
  double exposure = 1;  ///< of those photographs
};
Object repainted(Object object, const Repaint& how);

}  // namespace lumihull::rig
