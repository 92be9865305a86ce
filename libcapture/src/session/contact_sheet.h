#pragma once

// contact.html: how far a capture is, at a glance.

#include <lumihull/capture/journal.h>
#include <lumihull/capture/plan.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace lumihull::capture::internal {

class ContactSheet {
 public:
  explicit ContactSheet(const std::filesystem::path& folder);

  /// Makes the thumbnails that are not there yet, then the page. Errors: io.
  void write(const Plan& plan, const JournalState& state, const std::string& status, double seconds_left);

 private:
  struct Thumbnail {
    std::string file;  ///< in thumbs/; empty: the photograph can't be read
    double clipped = 0, brightest = 0, edge_width_px = 0;
  };
  void read_cache();
  void write_cache() const;
  const Thumbnail& thumbnail(const Take& take);
  /// to_look_at: gets a link where something seems wrong.
  std::string figure(const Plan& plan, const JournalState& state, std::size_t shot, double usual_edge_width_px,
                     std::vector<std::string>& to_look_at);

  std::filesystem::path folder_;
  std::map<std::string, Thumbnail> thumbnails_;  ///< by the photograph's digest
  bool changed_ = false;
};

}  // namespace lumihull::capture::internal
