// A folder in which another program's pictures appear.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/camera_devices.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <vector>

#include "ingest/picture_end.h"
#include "shot_name.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kPollMs = 100;
constexpr std::size_t kMaxFile = std::size_t(1) << 30;
constexpr std::size_t kMostFiles = 100'000;

double since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

/// What a file is, as far as the folder tells.
struct Stamp {
  std::uint64_t inode = 0, size = 0;
  std::int64_t mtime_ns = 0;
  bool operator==(const Stamp&) const = default;
};

std::optional<Stamp> stamp_of(const fs::path& file) {
  struct stat s {};
  if (::lstat(file.c_str(), &s) != 0 || !S_ISREG(s.st_mode)) return std::nullopt;  // a link may lead anywhere
  return Stamp{std::uint64_t(s.st_ino), std::uint64_t(s.st_size),
               std::int64_t(std::uint64_t(s.st_mtim.tv_sec) * 1'000'000'000 + std::uint64_t(s.st_mtim.tv_nsec))};
}

/// Names under which programs write what is not finished do not end like pictures (IMG.jpg.part, IMG.crdownload), or
/// are hidden (.IMG.jpg.x7f3, of rsync), or begin with '~'.
bool is_final_name(const fs::path& name) {
  const std::string text = name.filename().string();
  return !text.empty() && text[0] != '.' && text[0] != '~' && is_picture_name(name);
}

/// Tells which files their writers have closed. Where inotify is not to be had (network file systems tell nothing of
/// other machines' writing), times alone decide.
class Notices {
 public:
  explicit Notices(const fs::path& folder) : descriptor_(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK)) {
    if (descriptor_ >= 0)
      ::inotify_add_watch(descriptor_, folder.c_str(), IN_CLOSE_WRITE | IN_MOVED_TO | IN_CREATE | IN_ONLYDIR);
  }
  ~Notices() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Notices(const Notices&) = delete;
  Notices& operator=(const Notices&) = delete;

  void wait(int ms) const {
    pollfd p{descriptor_, POLLIN, 0};
    ::poll(&p, descriptor_ >= 0 ? 1 : 0, ms);
  }

  /// Names that were closed after writing, or moved here, since the last call.
  void collect(std::set<std::string>& closed) const {
    alignas(inotify_event) std::array<char, 16384> buffer;
    for (ssize_t n; descriptor_ >= 0 && (n = ::read(descriptor_, buffer.data(), buffer.size())) > 0;)
      for (const char* at = buffer.data(); at < buffer.data() + n;) {
        inotify_event event{};
        std::memcpy(&event, at, sizeof event);
        const char* name = at + sizeof event;
        if (event.len > 0 && (event.mask & (IN_CLOSE_WRITE | IN_MOVED_TO))) closed.insert(name);
        if (event.len > 0 && (event.mask & IN_CREATE)) closed.erase(name);
        at = name + event.len;
      }
  }

 private:
  int descriptor_;
};

struct Arrival {
  Stamp stamp;
  Clock::time_point changed;
  std::string fault = "an empty file";  ///< of the content at `stamp`
  bool looked = false, whole = false;
  std::string sha256;
};

class FolderCamera final : public CameraDevice {
 public:
  explicit FolderCamera(FolderCameraOptions options) : options_(std::move(options)) {}

  bool delivers_files() const override { return true; }
  void make_safe() noexcept override {}

  ShotOutcome recall(ShotId id) override {
    const auto known = outcomes_.find(id);
    if (known != outcomes_.end()) return known->second;
    return {ShotState::unknown, {}, "a folder keeps no record of shots"};
  }

  ShotOutcome shoot(ShotId id, double exposure_s, const fs::path& folder, Job& job) override {
    if (!std::isfinite(exposure_s) || exposure_s < 0)
      throw Error(ErrorCode::invalid_argument, "expected an exposure of 0 s or more", shot_name(id));
    if (const auto known = outcomes_.find(id); known != outcomes_.end() && known->second.state != ShotState::refused)
      return known->second;
    job.check();
    const Notices notices(options_.watched);
    const std::map<std::string, Stamp> before = listing();
    outcomes_[id] = {ShotState::unknown, {}, "the release was interrupted"};
    if (options_.release && !options_.release(id, exposure_s))
      return outcomes_[id] = {ShotState::refused, {}, "the release was declined"};
    ShotOutcome outcome = wait_for_picture(id, exposure_s, folder, notices, before, job);
    if (!outcome.file.empty() && owed_) {
      outcome.detail += outcome.detail.empty() ? "" : "; ";
      outcome.detail += "an earlier shot's picture never came, this one may be it";
    }
    owed_ = outcome.state == ShotState::unknown;
    return outcomes_[id] = outcome;
  }

 private:
  std::map<std::string, Stamp> listing() const {
    std::map<std::string, Stamp> out;
    std::error_code error;
    std::size_t entries = 0;
    fs::directory_iterator at(options_.watched, error);
    for (; !error && at != fs::directory_iterator(); at.increment(error)) {
      if (++entries > kMostFiles)
        throw Error(ErrorCode::io, "more than " + std::to_string(kMostFiles) + " files", options_.watched.string());
      if (!is_final_name(at->path())) continue;
      if (const auto stamp = stamp_of(at->path())) out[at->path().filename().string()] = *stamp;
    }
    if (error) throw Error(ErrorCode::io, "can't be watched: " + error.message(), options_.watched.string());
    return out;
  }

  /// Brings `arrivals` up to date.
  void look(const std::map<std::string, Stamp>& before, const std::set<std::string>& closed,
            std::map<std::string, Arrival>& arrivals) const {
    const std::map<std::string, Stamp> now = listing();
    std::erase_if(arrivals, [&](const auto& a) { return !now.count(a.first); });
    for (const auto& [name, stamp] : now) {
      const auto old = before.find(name);
      if (old != before.end() && old->second == stamp) continue;
      const auto [at, is_new] = arrivals.try_emplace(name);
      Arrival& a = at->second;
      if (is_new || !(a.stamp == stamp)) a = Arrival{stamp, Clock::now(), {}, false, false, {}};
      const double quiet = since(a.changed);
      // One that stopped in the middle is looked at again when it has grown.
      if (a.looked || (!closed.count(name) && quiet < options_.quiet_s)) continue;
      std::string bytes;
      try {
        bytes = read_file(options_.watched / name, kMaxFile);
      } catch (const Error& e) {
        a.fault = e.message();
        continue;  // it went, or is being replaced
      }
      const auto after = stamp_of(options_.watched / name);
      if (!after || !(*after == stamp)) continue;
      a.looked = true;
      a.fault = picture_fault(bytes);
      a.whole = a.fault.empty();
      if (a.whole) a.sha256 = sha256(bytes);
    }
  }

  static std::string stem(const std::string& name) { return fs::path(name).stem().string(); }

  ShotOutcome wait_for_picture(ShotId id, double exposure_s, const fs::path& folder, const Notices& notices,
                               const std::map<std::string, Stamp>& before, Job& job) {
    const Clock::time_point start = Clock::now();
    double whole_since_s = -1;  // after `start`; negative: no whole picture is there
    std::map<std::string, Arrival> arrivals;
    std::set<std::string> closed;
    bool stopped = false;
    for (;;) {
      notices.wait(kPollMs);
      notices.collect(closed);
      look(before, closed, arrivals);
      const bool any = std::any_of(arrivals.begin(), arrivals.end(), [](const auto& a) { return a.second.whole; });
      const bool growing =
          std::any_of(arrivals.begin(), arrivals.end(), [](const auto& a) { return !a.second.looked; });
      if (any && whole_since_s < 0) whole_since_s = since(start);
      if (!any) whole_since_s = -1;
      if (any && since(start) - whole_since_s >= options_.pair_s && !growing) break;
      stopped = job.cancelled();
      if (stopped || since(start) > exposure_s + options_.timeout_s) break;
    }
    return settle(id, folder, arrivals, stopped);
  }

  ShotOutcome settle(ShotId id, const fs::path& folder, const std::map<std::string, Arrival>& arrivals,
                     bool stopped) const {
    std::set<std::string> stems, digests;
    std::vector<std::string> files;
    std::string damaged;
    for (const auto& [name, a] : arrivals) {
      if (!a.whole) {
        if (damaged.empty()) damaged = name + ": " + (a.looked ? a.fault : "still growing");
        continue;
      }
      if (!digests.insert(a.sha256).second) continue;  // the same picture twice
      files.push_back(name);
      stems.insert(stem(name));
    }
    if (files.empty()) {
      if (!damaged.empty()) return {ShotState::unknown, {}, "no whole picture came: " + damaged};
      return {ShotState::unknown, {}, stopped ? "stopped before a picture came" : "no picture came in time"};
    }
    std::set<std::string> kinds;
    for (const std::string& f : files) kinds.insert(small_extension(f));
    if (stems.size() > 1 || kinds.size() < files.size())
      return {ShotState::done,
              {},
              std::to_string(files.size()) + " pictures came, which one is this shot's can't be told; they stay in " +
                  options_.watched.string()};
    ShotOutcome outcome{ShotState::done, {}, damaged.empty() ? "" : "besides, " + damaged};
    for (const std::string& f : files) {
      try {
        const fs::path to = take(options_.watched / f, id, folder);
        if (outcome.file.empty() || !is_raw_name(to)) outcome.file = to;
      } catch (const Error& e) {
        outcome.detail = f + " stays in " + options_.watched.string() + ": " + e.what();
      }
    }
    return outcome;
  }

  /// Copied, synchronised, put in place, and only then removed here: a kill leaves the picture in one of both places.
  static fs::path take(const fs::path& from, ShotId id, const fs::path& folder) {
    const std::string bytes = read_file(from, kMaxFile);
    for (;;) {
      const fs::path to = free_name(folder, shot_name(id), plain_extension(from));
      AtomicFile out(to);
      out.write(bytes);
      if (!out.commit_new()) continue;
      std::error_code ignored;
      fs::remove(from, ignored);
      return to;
    }
  }

  FolderCameraOptions options_;
  std::map<ShotId, ShotOutcome> outcomes_;
  bool owed_ = false;  ///< the shot before may still bring a picture
};

void check_seconds(double value, const char* name) {
  if (!std::isfinite(value) || value <= 0)
    throw Error(ErrorCode::invalid_argument, "expected a positive number of seconds", name);
}

}  // namespace

std::unique_ptr<CameraDevice> watch_folder(const FolderCameraOptions& options) {
  check_seconds(options.timeout_s, "timeout_s");
  check_seconds(options.quiet_s, "quiet_s");
  check_seconds(options.pair_s, "pair_s");
  std::error_code error;
  if (!fs::exists(options.watched, error))
    throw Error(ErrorCode::not_found, "no such folder", options.watched.string());
  if (!fs::is_directory(options.watched, error))
    throw Error(ErrorCode::invalid_argument, "expected a folder", options.watched.string());
  return std::make_unique<FolderCamera>(options);
}

}  // namespace lumihull::capture
