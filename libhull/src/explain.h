#pragma once

#include <lumihull/base/error.h>
#include <lumihull/hull/carve.h>

#include <span>
#include <string>

namespace lumihull::hull {

inline std::string name_of(std::span<const std::string> names, std::size_t i) {
  return i < names.size() ? names[i] : "view " + std::to_string(i);
}

/// The error for a hull of which nothing is left: names the views that carve everything away.
[[nodiscard]] Error vanished(const HullFunction& function, const Box& region, std::span<const std::string> names,
                             Job& job);

}  // namespace lumihull::hull
