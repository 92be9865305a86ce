// From a memory card into the photos' folder.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/capture/ingest.h>

#include <algorithm>
#include <set>
#include <system_error>

#include "drivers/shot_name.h"
#include "picture_end.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxPicture = std::size_t(1) << 30;

bool is_plain_name(const std::string& name) {
  constexpr std::size_t kMost = 200;
  if (name.empty() || name.size() > kMost || name[0] == '.' || name.find('/') != std::string::npos) return false;
  return Error(ErrorCode::bad_input, name).message() == name;  // no control character, UTF-8
}

std::vector<std::size_t> shots_of_camera(std::span<const ExpectedShot> shots, const std::string& camera,
                                         bool& several) {
  std::set<std::string> cameras;
  for (const ExpectedShot& s : shots) cameras.insert(s.camera);
  several = cameras.size() > 1;
  const auto listed = [&] {
    std::string out;
    for (const std::string& c : cameras) out += (out.empty() ? "" : ", ") + c;
    return out;
  };
  if (camera.empty() && several)
    throw Error(ErrorCode::invalid_argument,
                "the shots are of several cameras, say which one's card it is: " + listed(), "camera");
  if (!camera.empty() && !cameras.count(camera))
    throw Error(ErrorCode::invalid_argument, "expected one of the shots' cameras (" + listed() + "), found " + camera,
                "camera");
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < shots.size(); ++i)
    if (camera.empty() || shots[i].camera == camera) out.push_back(i);
  return out;
}

std::string name_of(const ExpectedShot& shot, bool several) {
  if (!shot.name.empty()) return shot.name;
  return several ? shot.stop + "-" + shot.camera : shot.stop;
}

/// One file into place; says what went wrong with it alone.
std::string copy_file(const fs::path& from, const fs::path& to, std::string& digest, bool& was_there) {
  std::string bytes;
  try {
    bytes = read_file(from, kMaxPicture);
  } catch (const Error& e) {
    return std::string("can't be read: ") + e.message();
  }
  if (std::string fault = picture_fault(bytes); !fault.empty()) return fault;
  const std::string own = sha256(bytes);
  std::error_code error;
  if (fs::symlink_status(to, error).type() == fs::file_type::not_found) {
    AtomicFile out(to);
    out.write(bytes);
    if (out.commit_new()) {
      digest = own;
      return {};
    }
  }
  if (fs::symlink_status(to, error).type() != fs::file_type::regular || sha256_of_file(to) != own)
    return "its place is taken by another file, which stays";
  digest = own;
  was_there = true;
  return {};
}

void copy_photo(const fs::path& card, const fs::path& photos, IngestedPhoto& photo) {
  bool all_there = true;
  for (std::size_t i = 0; i < photo.from.size(); ++i) {
    std::string digest;
    bool was_there = false;
    const std::string trouble = copy_file(card / photo.from[i], photos / photo.to[i], digest, was_there);
    all_there = all_there && was_there;
    photo.sha256.push_back(digest);
    if (trouble.empty()) continue;
    photo.trouble = Error(ErrorCode::bad_input, trouble, photo.from[i].string()).what();
    photo.sha256.clear();
    return;
  }
  photo.was_there = all_there;
}

}  // namespace

Assignment ingest(const fs::path& photos, const fs::path& card, std::span<const ExpectedShot> shots,
                  const IngestOptions& options, Job& job) {
  bool several = false;
  Assignment out;
  out.shots = shots_of_camera(shots, options.camera, several);
  std::set<std::string> names;
  std::vector<ExpectedShot> own;
  for (const std::size_t i : out.shots) {
    const std::string name = name_of(shots[i], several);
    if (!is_plain_name(name))
      throw Error(ErrorCode::invalid_argument, "expected a plain file name of 1 to 200 bytes", name);
    if (shots[i].state != ShotState::refused && !names.insert(name).second)
      throw Error(ErrorCode::invalid_argument, "expected names that come once", name);
    own.push_back(shots[i]);
  }
  std::error_code error;
  if (!options.dry_run && !fs::is_directory(photos, error))
    throw Error(ErrorCode::not_found, "no such folder", photos.string());

  out.card = read_card(card, job);
  out.alignment = align_pictures(own, out.card.pictures, options.align, job);
  for (const PictureOfShot& m : out.alignment.matches) {
    IngestedPhoto photo;
    photo.shot = out.shots[m.shot];
    photo.by_order = m.by_order;
    photo.from = out.card.pictures[m.picture].files;
    for (const fs::path& f : photo.from) photo.to.push_back(name_of(own[m.shot], several) + "." + plain_extension(f));
    out.photos.push_back(std::move(photo));
  }
  if (options.dry_run) return out;
  job.begin("copying pictures", out.photos.size());
  parallel_for(
      job, out.photos.size(), [&](std::size_t i) { copy_photo(card, photos, out.photos[i]); }, true);
  job.end();
  return out;
}

}  // namespace lumihull::capture
