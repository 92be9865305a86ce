// Photographs of the empty enclosure into a capture that exists.

#include <lumihull/base/files.h>

#include <set>

#include "import_common.h"

namespace lumihull {

namespace fs = std::filesystem;

int import_enclosure(Capture& capture, std::span<const fs::path> files, bool reference, Job& job) {
  if (files.empty()) throw Error(ErrorCode::invalid_argument, "no photographs of the empty enclosure were named");
  internal::read_infos({files.begin(), files.end()}, job);  // all must be pictures before the first is copied
  std::set<std::string> taken;
  for (const Shot& shot : capture.enclosure) taken.insert(shot.name);

  if (!reference) internal::make_folder(capture.folder() / "enclosure");
  std::vector<Shot> added;
  job.begin("importing the empty enclosure", files.size());
  for (const fs::path& file : files) {
    job.check();
    Shot shot;
    shot.name = internal::unique_name(file, taken);
    if (reference) {
      shot.file = internal::reference_to(file);
    } else {
      shot.file = "enclosure/" + internal::copy_name(shot.name, file);
      write_file(capture.folder() / shot.file, read_file(file));
    }
    shot.stamp = Capture::stamp(capture.photo_path(shot));
    added.push_back(std::move(shot));
    job.advance();
  }
  job.end();
  capture.enclosure.insert(capture.enclosure.end(), added.begin(), added.end());
  capture.save();
  return int(files.size());
}

}  // namespace lumihull
