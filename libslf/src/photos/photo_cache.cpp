#include "photo_cache.h"

#include <lumihull/base/parallel.h>

namespace lumihull::slf {

PhotoCache::PhotoCache(PhotoSet photos, const EdgeOptions& edge, std::size_t max_bytes)
    : photos_(std::move(photos)), edge_(edge), max_bytes_(max_bytes), entries_(photos_.size()) {}

std::vector<std::shared_ptr<const PreparedPhoto>> PhotoCache::get(std::span<const std::uint32_t> wanted, Job& job) {
  std::vector<std::shared_ptr<const PreparedPhoto>> result(wanted.size());
  {
    std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      Entry& entry = entries_[wanted[i]];
      result[i] = entry.photo;
      entry.last_use = ++clock_;
    }
  }
  parallel_for(job, wanted.size(), [&](std::size_t i) {
    const std::uint32_t id = wanted[i];
    if (!result[i])
      result[i] = std::make_shared<PreparedPhoto>(photos_.read(id), edge_, photos_.views[id].camera, photos_.names[id]);
  });

  std::lock_guard lock(mutex_);
  std::size_t used = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) entries_[wanted[i]].photo = result[i];
  for (const Entry& entry : entries_) used += entry.photo ? entry.photo->bytes() : 0;
  while (used > max_bytes_) {
    Entry* oldest = nullptr;
    for (Entry& entry : entries_)
      if (entry.photo && (!oldest || entry.last_use < oldest->last_use)) oldest = &entry;
    if (!oldest) break;
    used -= oldest->photo->bytes();
    oldest->photo.reset();
  }
  return result;
}

}  // namespace lumihull::slf
