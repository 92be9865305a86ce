#pragma once

#include <lumihull/base/job.h>
#include <lumihull/slf/photos.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "prepared_photo.h"

namespace lumihull::slf {

/// Decoded photographs within a limit of memory; the longest unused go first.
class PhotoCache {
 public:
  PhotoCache(PhotoSet photos, const EdgeOptions& edge, std::size_t max_bytes);

  const PhotoSet& photos() const { return photos_; }

  /// Some photographs at once; the missing ones are read in parallel. What is handed out stays valid while it is held.
  std::vector<std::shared_ptr<const PreparedPhoto>> get(std::span<const std::uint32_t> wanted, Job& job);

 private:
  struct Entry {
    std::shared_ptr<const PreparedPhoto> photo;
    std::uint64_t last_use = 0;
  };

  PhotoSet photos_;
  EdgeOptions edge_;
  std::size_t max_bytes_;
  std::mutex mutex_;  // guards what follows
  std::vector<Entry> entries_;
  std::uint64_t clock_ = 0;
};

}  // namespace lumihull::slf
