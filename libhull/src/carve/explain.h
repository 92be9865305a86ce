#pragma once

#include <lumihull/base/error.h>
#include <lumihull/hull/carve.h>

#include <optional>
#include <span>
#include <string>

namespace lumihull::hull {

inline std::string name_of(std::span<const std::string> names, std::size_t i) {
  return i < names.size() ? names[i] : "view " + std::to_string(i);
}

/// The error for a hull of which nothing is left: names the views that carve everything away.
[[nodiscard]] Error vanished(const HullFunction& function, const Box& region, std::span<const std::string> names,
                             Job& job);

/// Where the hull of all views is nothing, or a scrap that few of them see: looks for the object that all but a few
/// views agree on, and returns the error that names those few; nullopt where there is no such object.
[[nodiscard]] std::optional<Error> contradicted(const HullFunction& function, std::span<const View> views,
                                                std::span<const Silhouette> silhouettes, const CarveOptions& options,
                                                Job& job);

}  // namespace lumihull::hull
