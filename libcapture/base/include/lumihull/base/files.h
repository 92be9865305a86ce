#pragma once

#include <lumihull/base/api.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace lumihull {

/// Reads a whole file. Errors: not_found, io, bad_input (larger than max_bytes).
LUMIHULL_API std::string read_file(const std::filesystem::path& file, std::size_t max_bytes = std::size_t(1) << 30);

/// Replaces a file atomically: written beside it under a temporary name, fsync, rename, fsync of the folder. A kill
/// at any moment leaves the old file or the new one, and at most a NAME.part-N beside it, which the next write of that
/// file removes. Errors: not_found (no such folder), io (with the operating system's reason).
LUMIHULL_API void write_file(const std::filesystem::path& file, std::string_view bytes);

/// The same for content that is produced piece by piece. Without `commit` nothing is left behind.
class LUMIHULL_API AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path file);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  void write(std::string_view bytes);
  void commit();
  /// The same, but never replaces anything: false, and nothing is left behind, where the name is in use by now.
  bool commit_new();

 private:
  std::filesystem::path file_, temporary_;
  int descriptor_ = -1;
};

/// SHA-256 as 64 hexadecimal digits.
LUMIHULL_API std::string sha256(std::string_view bytes);
LUMIHULL_API std::string sha256_of_file(const std::filesystem::path& file);

/// The high-water mark of this process's resident memory since the last reset (or its start), in bytes; 0 where the
/// system does not tell.
LUMIHULL_API std::uint64_t peak_memory_bytes();
LUMIHULL_API void reset_peak_memory();

}  // namespace lumihull
