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

  const fs::path folder = capture.folder() / "enclosure";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(ErrorCode::io, "can't make the folder: " + error.message(), folder.string());
  job.begin("importing the empty enclosure", files.size());
  for (const fs::path& file : files) {
    job.check();
    Shot shot;
    shot.name = internal::unique_name(file, taken);
    if (reference) {
      shot.file = fs::absolute(file).lexically_normal().string();
    } else {
      shot.file = "enclosure/" + shot.name + file.extension().string();
      AtomicFile copy(capture.folder() / shot.file);
      copy.write(read_file(file));
      copy.commit();
    }
    shot.stamp = Capture::stamp(capture.photo_path(shot));
    capture.enclosure.push_back(std::move(shot));
    job.advance();
  }
  job.end();
  capture.save();
  return int(files.size());
}

}  // namespace lumihull
