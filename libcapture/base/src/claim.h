#pragma once

// Names for what is being written, beside the place where it will stand.

#include <filesystem>
#include <string>

namespace lumihull::internal {

enum class ClaimKind { file, folder };

/// A new empty file or folder that is the caller's alone: `prefix` and the least number that no running process holds.
///
/// Its holder keeps `descriptor` open, and with it a lock (flock). What a killed process left behind has no holder: it
/// is removed here, by the next one who wants the name. Where a file system knows no locks nothing is ever removed.
/// Errors: not_found (the folder that it is to stand in), io; they name `subject`.
struct Claim {
  std::filesystem::path path;
  int descriptor = -1;
};
Claim claim(const std::filesystem::path& prefix, ClaimKind kind, const std::filesystem::path& subject);

}  // namespace lumihull::internal
