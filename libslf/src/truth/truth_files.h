#pragma once

// What a folder of truth holds, read and checked.

#include <lumihull/base/camera.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::slf::truth {

/// Of cameras.json.
struct TrueCameras {
  std::map<std::string, View> views;  ///< by the shot's name; m
  std::vector<std::string> names;     ///< in the file's order
};

/// Of targets.json.
struct TrueTarget {
  int design = 0, id = 0;
  Pose world_from_target;
};

/// nullopt where there is no such file. Errors: bad_input naming file, JSON pointer and what was expected.
std::optional<TrueCameras> read_true_cameras(const std::filesystem::path& folder);
std::optional<std::vector<TrueTarget>> read_true_targets(const std::filesystem::path& folder);

}  // namespace lumihull::slf::truth
