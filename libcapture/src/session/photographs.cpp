#include "photographs.h"

#include <fcntl.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/session.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <system_error>

namespace lumihull::capture {

namespace fs = std::filesystem;

namespace internal {

namespace {

[[noreturn]] void fail(const std::string& what, int error, const fs::path& file) {
  throw Error(ErrorCode::io, what + ": " + std::strerror(error), file.string());
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(ErrorCode::io, "can't make the folder: " + error.message(), folder.string());
}

void synchronise(const fs::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | flags);
  if (descriptor < 0) fail("can't open", errno, path);
  const int result = ::fsync(descriptor), error = errno;
  ::close(descriptor);
  if (result != 0 && error != EINVAL) fail("can't synchronise", error, path);  // EINVAL: a file system without it
}

std::string replaced(std::string text, const std::string& field, const std::string& value) {
  for (std::size_t at = text.find(field); at != std::string::npos; at = text.find(field, at + value.size()))
    text.replace(at, field.size(), value);
  return text;
}

std::string expand(const JournalHead& head, std::size_t stop, std::size_t camera) {
  char number[24];
  std::snprintf(number, sizeof number, "%04zu", stop + 1);
  return replaced(replaced(replaced(head.name_template, "{stop}", head.stops[stop]), "{camera}", head.cameras[camera]),
                  "{number}", number);
}

/// A name that ends in ~2, ~3, … would be a retake's.
bool like_a_retake(const std::string& name) {
  const std::size_t tilde = name.rfind('~');
  return tilde != std::string::npos && tilde + 1 < name.size() &&
         name.find_first_not_of("0123456789", tilde + 1) == std::string::npos;
}

/// Moves a file where nothing of that name is. False: something is.
bool move_without_replacing(const fs::path& from, const fs::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno == EEXIST) return false;
  if (errno != EINVAL && errno != ENOSYS) fail("can't put the photograph in its place", errno, to);
  // Not every file system knows it; most of the others know links.
  if (::link(from.c_str(), to.c_str()) != 0) {
    if (errno == EEXIST) return false;
    fail("can't put the photograph in its place", errno, to);
  }
  return ::unlink(from.c_str()) == 0 || errno == ENOENT;
}

bool is_file(const fs::path& path, std::uint64_t size) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && std::uint64_t(status.st_size) == size;
}

void remove_if_empty(const fs::path& folder) { ::rmdir(folder.c_str()); }

/// Error{bad_input}: a damaged picture would only be found out by a later stage. RAW files are looked at less closely:
/// developing one takes seconds.
void check_picture(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".jpg" || extension == ".jpeg" || extension == ".png")
    read_image(file, {.reduction = 8});
  else
    read_image_info(file);
}

bool is_whole_picture(const fs::path& file) {
  try {
    read_image(file, {.reduction = 8});
    return true;
  } catch (const Error& e) {
    if (e.code() == ErrorCode::out_of_memory) throw;
    return false;
  }
}

}  // namespace

std::vector<std::string> photograph_names(const JournalHead& head) {
  const std::string& text = head.name_template;
  std::string rest = text;
  for (const char* field : {"{stop}", "{camera}", "{number}"}) rest = replaced(rest, field, "");
  if (rest.find_first_of("{}") != std::string::npos)
    throw Error(ErrorCode::bad_input, "expected {stop}, {camera} and {number} as the only fields in braces", text);
  std::vector<std::string> names;
  std::map<std::string, std::string, std::less<>> taken;
  for (std::size_t stop = 0; stop < head.stops.size(); ++stop)
    for (std::size_t camera = 0; camera < head.cameras.size(); ++camera) {
      if (head.passed.contains(head.stops[stop])) {
        names.emplace_back();
        continue;
      }
      const std::string name = expand(head, stop, camera), title = head.stops[stop] + ", " + head.cameras[camera];
      if (name.empty() || name.size() > 180 || name.front() == '.' || name.find('/') != std::string::npos ||
          Error(ErrorCode::internal, name).message() != name || like_a_retake(name))
        throw Error(ErrorCode::bad_input,
                    "expected plain file names in UTF-8 that don't begin with '.' or end in ~ and a number, found \"" +
                        name + "\"",
                    text);
      if (const auto [other, is_new] = taken.emplace(name, title); !is_new)
        throw Error(
            ErrorCode::bad_input,
            "gives the name \"" + name + "\" to " + other->second + " and to " + title + ": add {stop} or {camera}",
            text);
      names.push_back(name);
    }
  return names;
}

fs::path incoming_folder(const fs::path& folder, ShotId shot) { return folder / "incoming" / std::to_string(shot); }

std::optional<fs::path> arrived_picture(const fs::path& folder, ShotId shot) {
  std::optional<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(incoming_folder(folder, shot), error)) {
    if (!entry.is_regular_file(error) || entry.path().filename().string().front() == '.' ||
        !is_whole_picture(entry.path()))
      continue;
    if (found) return std::nullopt;
    found = entry.path();
  }
  return found;
}

bool put_in_place(const fs::path& folder, const Take& take) {
  const fs::path place = folder / "photos" / take.file, incoming = incoming_folder(folder, take.shot);
  if (is_file(place, take.size)) return true;
  std::error_code error;
  const bool blocked = fs::exists(fs::symlink_status(place, error));
  for (const auto& entry : fs::directory_iterator(incoming, error)) {
    if (!is_file(entry.path(), take.size) || sha256_of_file(entry.path()) != take.sha256) continue;
    if (blocked || !move_without_replacing(entry.path(), place))
      throw Error(ErrorCode::bad_input,
                  "a file that this capture did not take is in the way of a photograph (which waits in " +
                      entry.path().string() + "): move it away",
                  place.string());
    synchronise(place.parent_path(), O_DIRECTORY);
    remove_if_empty(incoming);
    return true;
  }
  return false;
}

std::string shot_title(const JournalState& state, std::size_t shot) {
  const std::size_t cameras = state.head.cameras.size();
  return state.head.stops[shot / cameras] + (cameras > 1 ? ", camera " + state.head.cameras[shot % cameras] : "");
}

}  // namespace internal

std::string land_photograph(Journal& journal, const fs::path& folder, ShotId id, const fs::path& file) {
  using namespace internal;
  const JournalState& state = journal.state();
  const auto found = state.by_id.find(id);
  if (found == state.by_id.end() || state.shots[found->second].take.shot != id ||
      state.shots[found->second].step != ShotStep::done)
    throw Error(ErrorCode::invalid_argument,
                "expected a shot that was taken and has no file yet, found " + std::to_string(id), "shot");
  const ShotProgress& shot = state.shots[found->second];
  check_picture(file);

  const fs::path incoming = incoming_folder(folder, id);
  fs::path source = file;
  std::error_code error;
  if (!fs::equivalent(file.parent_path().empty() ? "." : file.parent_path(), incoming, error)) {
    make_folder(incoming);
    source = incoming / file.filename();
    write_file(source, read_file(file, std::size_t(2) << 30));
  }
  synchronise(source, 0);

  std::string name = photograph_names(state.head)[found->second];
  if (!shot.landed.empty()) name += "~" + std::to_string(shot.landed.size() + 1);
  const std::string extension = file.extension().string();
  const auto plain = [](unsigned char c) { return std::isalnum(c); };
  if (extension.size() > 1 && extension.size() < 12 && std::all_of(extension.begin() + 1, extension.end(), plain))
    name += extension;
  const fs::path place = folder / "photos" / name;
  make_folder(place.parent_path());
  if (fs::exists(fs::symlink_status(place, error)))
    throw Error(ErrorCode::bad_input,
                "a file that this capture did not take is in the way of a photograph (which waits in " +
                    source.string() + "): move it away",
                place.string());
  Take take;
  take.shot = id;
  take.file = name;
  take.size = fs::file_size(source);
  take.sha256 = sha256_of_file(source);
  journal.append({.kind = EventKind::file, .shot = id, .file = take.file, .sha256 = take.sha256, .size = take.size});
  put_in_place(folder, take);
  return name;
}

fs::path journal_path(const fs::path& folder) { return folder / "journal.jsonl"; }
fs::path plan_path(const fs::path& folder) { return folder / "plan.json"; }

SessionLock::SessionLock(const fs::path& folder) {
  internal::make_folder(folder);
  const fs::path file = folder / "capture.lock";
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) internal::fail("can't write here", errno, file);
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
  const int error = errno;
  ::close(descriptor_);
  if (error == EWOULDBLOCK)
    throw Error(ErrorCode::io, "another process is capturing into this folder", folder.string());
  internal::fail("can't lock", error, file);
}

SessionLock::~SessionLock() { ::close(descriptor_); }

}  // namespace lumihull::capture
