#pragma once

// What the files of a shot are called.

#include <lumihull/capture/robot.h>

#include <cstdio>
#include <string>

#include "ingest/picture_end.h"

namespace lumihull::capture {

/// "shot-000012".
inline std::string shot_name(ShotId id) {
  char text[32];
  std::snprintf(text, sizeof text, "shot-%06u", unsigned(id));
  return text;
}

/// An extension that a camera's or a stranger's file name gives: up to five letters and digits, else "bin".
inline std::string plain_extension(const std::filesystem::path& name) {
  const std::string extension = small_extension(name);
  const bool plain = !extension.empty() && extension.size() <= 5 &&
                     extension.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789") == std::string::npos;
  return plain ? extension : "bin";
}

}  // namespace lumihull::capture
