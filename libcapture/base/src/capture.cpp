#include <fcntl.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <system_error>

#include "capture_json.h"
#include "import_common.h"
#include "text.h"

namespace lumihull {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxJsonBytes = std::size_t(256) << 20;

/// Lines "SOURCE SHA256 NAME", one a mask, appended before the mask itself is put in place: so that a run that was
/// killed before capture.json was written does not leave masks that look as if a person had drawn them.
fs::path mask_journal(const fs::path& folder) { return folder / "masks" / "written.txt"; }

void append_line(const fs::path& file, const std::string& line) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  const bool good = descriptor >= 0 && ::write(descriptor, line.data(), line.size()) == ssize_t(line.size()) &&
                    ::fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!good) throw Error(ErrorCode::io, std::string("can't write: ") + std::strerror(error), file.string());
}

}  // namespace

Capture Capture::create(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error)) {
    if (!fs::is_directory(folder, error))
      throw Error(ErrorCode::invalid_argument, "expected a folder, found a file", folder.string());
    if (!fs::is_empty(folder, error))
      throw Error(ErrorCode::invalid_argument, "the folder is in use; name a new or empty one", folder.string());
  }
  internal::make_folder(folder);
  return Capture(folder);
}

Capture Capture::create_among(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / "capture.json", error))
    throw Error(ErrorCode::invalid_argument, "the folder already holds a capture", folder.string());
  internal::make_folder(folder);
  return Capture(folder);
}

Capture Capture::open(const fs::path& folder) {
  const fs::path main = folder / "capture.json", cameras = folder / "cameras.json";
  std::error_code error;
  if (!fs::exists(main, error))
    throw Error(ErrorCode::not_found, "not a capture: it has no capture.json (`lumihull import` makes one)",
                folder.string());
  Capture capture(folder);
  internal::parse_capture_json(read_file(main, kMaxJsonBytes), main.string(), capture);
  internal::parse_cameras_json(read_file(cameras, kMaxJsonBytes), cameras.string(), capture);
  capture.absorb_mask_journal();
  return capture;
}

void Capture::absorb_mask_journal() {
  std::error_code error;
  if (!fs::exists(mask_journal(folder_), error)) return;
  std::map<std::string, Shot*, std::less<>> by_name;
  for (Shot& shot : shots) by_name[shot.name] = &shot;
  std::istringstream lines(read_file(mask_journal(folder_), kMaxJsonBytes));
  std::string source, digest, name;
  while (lines >> source >> digest && lines.ignore(1) && std::getline(lines, name)) {
    const auto shot = by_name.find(name);
    if (shot == by_name.end() || !fs::exists(mask_path(*shot->second), error)) continue;
    if (sha256_of_file(mask_path(*shot->second)) != digest) continue;
    shot->second->mask_sha256 = digest;
    shot->second->mask_source = source == "imported" ? MaskSource::imported : MaskSource::keyed;
  }
}

void Capture::save() const {
  const fs::path main = folder_ / "capture.json", beside = folder_ / "cameras.json";
  const std::string main_text = internal::print_capture_json(*this, main.string()),
                    cameras_text = internal::print_cameras_json(*this, beside.string());
  // What could not be read again (a number that is not finite, a name used twice) must not replace what can.
  Capture again(folder_);
  internal::parse_capture_json(main_text, main.string(), again);
  internal::parse_cameras_json(cameras_text, beside.string(), again);
  internal::make_folder(folder_);
  // Cameras first: a shot must never refer to a camera that is not on disk yet.
  write_file(beside, cameras_text);
  write_file(main, main_text);
  std::error_code ignored;
  fs::remove(mask_journal(folder_), ignored);  // capture.json holds the digests now
}

int Capture::hold_out() const { return int(option("evaluate", "hold_out", std::int64_t(0))); }

void Capture::set_hold_out(int n) {
  if (n < 0 || n == 1)
    throw Error(ErrorCode::invalid_argument, "expected 0 (none) or at least 2, found " + std::to_string(n), "hold-out");
  options["evaluate"]["hold_out"] = std::int64_t(n);
}

std::size_t Capture::add_shot(const std::string& name, const std::string& file, std::size_t camera) {
  if (!internal::is_shot_name(name))
    throw Error(ErrorCode::invalid_argument, std::string("expected ") + internal::kShotName, "name");
  if (camera >= cameras.size())
    throw Error(ErrorCode::invalid_argument,
                "expected less than " + std::to_string(cameras.size()) + ", found " + std::to_string(camera), "camera");
  if (std::any_of(shots.begin(), shots.end(), [&](const Shot& s) { return s.name == name; }))
    throw Error(ErrorCode::invalid_argument, "expected a name that no other shot has, found \"" + name + "\"", "name");
  Shot shot;
  shot.name = name;
  shot.file = file;
  shot.camera = int(camera);
  shot.stamp = stamp(photo_path(shot));
  shots.push_back(std::move(shot));
  return shots.size() - 1;
}

fs::path Capture::photo_path(const Shot& shot) const {
  const fs::path file(shot.file);
  return file.is_absolute() ? file : folder_ / file;
}

View Capture::view(std::size_t i) const {
  const Shot& shot = shots.at(i);
  if (!shot.cam_from_world)
    throw Error(ErrorCode::bad_input, "this photograph has no pose yet; import or calibrate cameras first", shot.name);
  return {cameras.at(std::size_t(shot.camera)), *shot.cam_from_world};
}

Image Capture::read_photo(std::size_t i, int channels) const {
  const Shot& shot = shots.at(i);
  const fs::path path = photo_path(shot);
  Image photo = read_image(path, {.channels = channels});
  const Camera& camera = cameras.at(std::size_t(shot.camera));
  if (photo.width() != camera.width || photo.height() != camera.height)
    throw Error(ErrorCode::bad_input,
                "expected " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                    " pixels as its camera has, found " + std::to_string(photo.width()) + " x " +
                    std::to_string(photo.height()),
                path.string());
  return photo;
}

Image Capture::read_mask(std::size_t i) const {
  const Shot& shot = shots.at(i);
  const fs::path path = mask_path(shot);
  std::error_code error;
  if (!fs::exists(path, error))
    throw Error(ErrorCode::not_found, "photograph \"" + shot.name + "\" has no mask; run `lumihull key` first",
                path.string());
  Image mask = read_image(path, {.channels = 1});
  if (mask.type() != PixelType::u8) mask = converted(mask, PixelType::u8, 1);
  const Camera& camera = cameras.at(std::size_t(shot.camera));
  if (mask.width() != camera.width || mask.height() != camera.height)
    throw Error(ErrorCode::bad_input,
                "expected a mask of " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                    " pixels as its photograph has, found " + std::to_string(mask.width()) + " x " +
                    std::to_string(mask.height()),
                path.string());
  return mask;
}

void Capture::write_mask(std::size_t i, const Image& mask, MaskSource source) {
  Shot& shot = shots.at(i);
  const Camera& camera = cameras.at(std::size_t(shot.camera));
  if (mask.type() != PixelType::u8 || mask.channels() != 1 || mask.width() != camera.width ||
      mask.height() != camera.height)
    throw Error(ErrorCode::invalid_argument, "a mask is 8-bit, one channel, of its photograph's size", shot.name);
  internal::make_folder(folder_ / "masks");
  const std::string png = encode_mask(mask);
  const std::string digest = sha256(png);
  append_line(mask_journal(folder_),
              (source == MaskSource::imported ? "imported " : "keyed ") + digest + " " + shot.name + "\n");
  write_file(mask_path(shot), png);
  shot.mask_source = source;
  shot.mask_sha256 = digest;
}

MaskSource Capture::mask_state(const Shot& shot) const {
  const fs::path path = mask_path(shot);
  std::error_code error;
  if (!fs::exists(path, error)) return MaskSource::none;
  if (shot.mask_source == MaskSource::none || sha256_of_file(path) != shot.mask_sha256) return MaskSource::edited;
  return shot.mask_source;
}

FileStamp Capture::stamp(const fs::path& file, const FileStamp& known) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) {
    const int error = errno;
    throw Error(error == ENOENT || error == ENOTDIR ? ErrorCode::not_found : ErrorCode::io,
                std::string("can't look at the photograph: ") + std::strerror(error), file.string());
  }
  // Unsigned, for a file may claim to be of any year: what overflows still differs from another time.
  const auto mtime_ns = std::uint64_t(status.st_mtim.tv_sec) * 1'000'000'000 + std::uint64_t(status.st_mtim.tv_nsec);
  FileStamp now{known.sha256, std::uint64_t(status.st_size), std::int64_t(mtime_ns)};
  if (known.sha256.empty() || now.size != known.size || now.mtime_ns != known.mtime_ns)
    now.sha256 = sha256_of_file(file);
  return now;
}

void Capture::refresh_stamps(Job& job) {
  std::vector<Shot*> all;
  for (Shot& shot : shots) all.push_back(&shot);
  for (Shot& shot : enclosure) all.push_back(&shot);
  parallel_for(job, all.size(), [&](std::size_t i) { all[i]->stamp = stamp(photo_path(*all[i]), all[i]->stamp); });
}

template <class T>
T Capture::option(std::string_view stage, std::string_view name, T fallback) const {
  const auto values = options.find(stage);
  if (values == options.end()) return fallback;
  const auto value = values->second.find(name);
  if (value == values->second.end()) return fallback;
  if (const T* v = std::get_if<T>(&value->second)) return *v;
  if constexpr (std::is_same_v<T, double>)  // JSON writes 2.0 as 2
    if (const auto* v = std::get_if<std::int64_t>(&value->second)) return double(*v);
  throw Error(ErrorCode::bad_input,
              "at /options/" + std::string(stage) + "/" + std::string(name) + ": a value of another type is expected",
              (folder_ / "capture.json").string());
}

template bool Capture::option(std::string_view, std::string_view, bool) const;
template std::int64_t Capture::option(std::string_view, std::string_view, std::int64_t) const;
template double Capture::option(std::string_view, std::string_view, double) const;
template std::string Capture::option(std::string_view, std::string_view, std::string) const;
template std::vector<double> Capture::option(std::string_view, std::string_view, std::vector<double>) const;

}  // namespace lumihull
