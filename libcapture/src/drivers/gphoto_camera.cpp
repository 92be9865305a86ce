// A camera behind lumihull-gphoto2. This side has the deadlines: a helper that misses one is killed.

#include <dlfcn.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/camera_devices.h>
#include <lumihull/internal/child_process.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>

#include "gphoto_protocol.h"
#include "ingest/picture_end.h"
#include "shot_name.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Words = std::vector<std::string>;
using gphoto::word;
using internal::ChildProcess;

constexpr double kShortAnswer_s = 5;  ///< for requests that touch no shutter
constexpr std::size_t kMaxFile = std::size_t(1) << 30;

Clock::time_point after(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}
double until(Clock::time_point t) { return std::chrono::duration<double>(t - Clock::now()).count(); }

fs::path installed_helper() {
  Dl_info here{};
  static const char kAnchor = 0;
  std::error_code ignored;
  if (dladdr(&kAnchor, &here) && here.dli_fname) {
    const fs::path folder = fs::canonical(here.dli_fname, ignored).parent_path();
    for (const char* up : {"..", "../.."}) {  // lib, lib/x86_64-linux-gnu
      const fs::path file = folder / up / LUMIHULL_LIBEXEC / "lumihull-gphoto2";
      if (fs::exists(file, ignored)) return file.lexically_normal();
    }
  }
  throw Error(ErrorCode::not_found, "no helper program: this build has no libgphoto2 (LUMIHULL_GPHOTO2)",
              "lumihull-gphoto2");
}

std::optional<std::uint64_t> number(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Thrown where the helper can no longer be relied upon; it is ended then.
struct HelperLost {
  std::string why;
};

/// The helper and its lines.
class Helper {
 public:
  explicit Helper(const fs::path& program) : child_({program.string()}, ChildProcess::Talk::converse) {
    if (next_line(after(kShortAnswer_s)) != gphoto::kHello) lose("the helper program does not speak as expected");
  }
  ~Helper() { child_.end(500); }

  void ask(const std::string& line) {
    if (!child_.write(line + "\n", 1000)) lose("the helper program is gone");
  }

  /// The next answer; `deadline` ends the waiting.
  Words answer(Clock::time_point deadline) {
    const auto w = gphoto::words(next_line(deadline));
    if (!w || w->empty()) lose("the helper program answered nonsense");
    return *w;
  }

  std::string bytes(std::size_t count, Clock::time_point deadline) {
    while (text_.size() < count) read(deadline);
    std::string out = text_.substr(0, count);
    text_.erase(0, count);
    return out;
  }

 private:
  [[noreturn]] void lose(const std::string& why) { throw HelperLost{why}; }

  void read(Clock::time_point deadline) {
    const double left = until(deadline);
    if (left <= 0) lose("the camera did not answer in time");
    if (!child_.read(text_, std::max(1, int(std::min(left, 0.1) * 1000))))
      lose("the helper program ended unexpectedly");
  }

  std::string next_line(Clock::time_point deadline) {
    for (std::size_t from = 0;;) {
      const std::size_t end = text_.find('\n', from);
      if (end != std::string::npos) {
        std::string line = text_.substr(0, end);
        text_.erase(0, end + 1);
        return line;
      }
      from = text_.size();
      if (from > gphoto::kMaxLine) lose("the helper program answered nonsense");
      read(deadline);
    }
  }

  ChildProcess child_;
  std::string text_;
};

struct Announced {
  std::uint64_t size = 0;  ///< 0: not told
  std::string folder, name;
};

class GphotoCamera final : public CameraDevice {
 public:
  GphotoCamera(GphotoOptions options, fs::path program) : options_(std::move(options)), program_(std::move(program)) {}

  void open() {
    helper_.reset();
    try {
      helper_ = std::make_unique<Helper>(program_);
      helper_->ask("open " + word(options_.port) + " " + word(options_.model));
      const Words w = helper_->answer(after(options_.open_timeout_s));
      if (w[0] == "ok" && w.size() == 2) return;
      helper_.reset();
      throw Error(ErrorCode::io,
                  "the camera can't be opened: " + (w.size() > 1 ? w[1] : std::string("no reason given")),
                  options_.port);
    } catch (const HelperLost& lost) {
      helper_.reset();
      throw Error(ErrorCode::io, "the camera can't be opened: " + lost.why, options_.port);
    }
  }

  bool delivers_files() const override { return true; }

  ShotOutcome shoot(ShotId id, double exposure_s, const fs::path& folder, Job& job) override {
    if (!std::isfinite(exposure_s) || exposure_s < 0)
      throw Error(ErrorCode::invalid_argument, "expected an exposure of 0 s or more", shot_name(id));
    if (const auto known = outcomes_.find(id); known != outcomes_.end() && known->second.state != ShotState::refused)
      return known->second;
    job.check();
    const std::string trouble = make_ready();
    if (!trouble.empty()) return outcomes_[id] = {ShotState::refused, {}, trouble};
    return outcomes_[id] = expose(id, exposure_s, folder);
  }

  ShotOutcome recall(ShotId id) override {
    const auto known = outcomes_.find(id);
    if (known != outcomes_.end()) return known->second;
    return {ShotState::unknown, {}, "the camera keeps no record of shots"};
  }

  void make_safe() noexcept override { helper_.reset(); }

 private:
  /// Connected, and with no event of an earlier exposure waiting: else a late picture would be taken for this shot's.
  std::string make_ready() {
    for (int attempt = 0; attempt < 2; ++attempt) {
      try {
        if (!helper_) open();
        helper_->ask("drain");
        const Words w = helper_->answer(after(kShortAnswer_s));
        if (w[0] != "ok") throw HelperLost{w.size() > 1 ? w[1] : "no reason given"};
        return {};
      } catch (const HelperLost& lost) {
        helper_.reset();
        if (attempt == 1) return "the camera is not ready: " + lost.why;
      } catch (const Error& e) {
        return e.what();  // nothing was released: a refusal, not an error that would leave the shot in doubt
      }
    }
    return {};
  }

  ShotOutcome expose(ShotId id, double exposure_s, const fs::path& folder) {
    ShotOutcome outcome;
    std::vector<Announced> pictures;
    bool complete = false;
    try {
      helper_->ask("trigger");
      const Words w = helper_->answer(after(exposure_s + options_.event_timeout_s));
      const std::string why = w.size() > 1 ? w[1] : "no reason given";
      if (w[0] == "refused") return {ShotState::refused, {}, "the camera declined: " + why};
      // In doubt the camera is still listened to: a picture ends the doubt.
      if (w[0] != "ok") outcome.detail = "the camera answered the release with an error: " + why;
      complete = listen(after(exposure_s + options_.event_timeout_s), pictures);
    } catch (const HelperLost& lost) {
      outcome.detail = lost.why;
      helper_.reset();
    }
    if (pictures.empty()) {
      if (complete) return {ShotState::done, {}, "the camera finished the exposure but announced no picture"};
      if (outcome.detail.empty())
        outcome.detail = "released, but neither a picture nor the exposure's end was announced";
      helper_.reset();  // what comes late must not reach the next shot
      return outcome;
    }
    outcome = {ShotState::done, {}, {}};
    std::set<std::string> kinds;
    for (const Announced& p : pictures)
      if (!kinds.insert(small_extension(p.name)).second) {
        outcome.detail = std::to_string(pictures.size()) +
                         " pictures were announced, which one is this shot's can't be told; "
                         "they stay on the camera";
        return outcome;
      }
    download(id, pictures, folder, outcome);
    return outcome;
  }

  /// Waits for pictures; true when the camera said that the exposure is over. Throws HelperLost only while there is no
  /// picture: after one, what is known is enough.
  bool listen(Clock::time_point deadline, std::vector<Announced>& pictures) {
    constexpr double kAfterComplete_s = 0.3;  // the second file of RAW + JPEG
    constexpr double kAfterPicture_s = 2;     // as well, or the announcement of the end, which may be lost
    bool complete = false;
    try {
      while (until(deadline) > 0) {
        helper_->ask("event " + std::to_string(std::clamp(int(until(deadline) * 1000), 1, 250)));
        const Words w = helper_->answer(after(kShortAnswer_s));
        if (w[0] == "error") throw HelperLost{w.size() > 1 ? w[1] : "no reason given"};
        if (w[0] == "complete") complete = true;
        if (w[0] == "added") {
          const auto size = w.size() == 4 ? number(w[1]) : std::nullopt;
          if (!size) throw HelperLost{"the helper program answered nonsense"};
          const bool again = std::any_of(pictures.begin(), pictures.end(),
                                         [&](const Announced& p) { return p.folder == w[2] && p.name == w[3]; });
          if (!again) pictures.push_back({*size, w[2], w[3]});
        }
        if ((w[0] == "added" || w[0] == "complete") && !pictures.empty())
          deadline = std::min(deadline, after(complete ? kAfterComplete_s : kAfterPicture_s));
      }
    } catch (const HelperLost&) {
      if (pictures.empty() && !complete) throw;
      helper_.reset();
    }
    return complete;
  }

  void download(ShotId id, const std::vector<Announced>& pictures, const fs::path& folder, ShotOutcome& outcome) {
    const auto deadline = after(options_.download_timeout_s);
    for (const Announced& p : pictures) {
      try {
        if (!helper_) open();
        const fs::path file = store(id, p, get(p, deadline), folder);
        if (outcome.file.empty() || !is_raw_name(file)) outcome.file = file;
        if (options_.delete_after_download) {
          helper_->ask("delete " + word(p.folder) + " " + word(p.name));
          const Words w = helper_->answer(after(kShortAnswer_s));
          if (w[0] != "ok")
            outcome.detail += (outcome.detail.empty() ? "" : "; ") + p.name + " stays on the camera as well";
        }
      } catch (const HelperLost& lost) {
        helper_.reset();
        outcome.detail += (outcome.detail.empty() ? "" : "; ") + p.name + " stays on the camera: " + lost.why;
      } catch (const Error& e) {
        outcome.detail += (outcome.detail.empty() ? "" : "; ") + p.name + " stays on the camera: " + e.what();
      }
    }
  }

  std::string get(const Announced& p, Clock::time_point deadline) {
    helper_->ask("get " + word(p.folder) + " " + word(p.name));
    std::string content;
    for (;;) {
      const Words w = helper_->answer(deadline);
      if (w[0] == "data") {
        const auto size = w.size() == 2 ? number(w[1]) : std::nullopt;
        if (!size || *size > gphoto::kMaxChunk || content.size() + *size > kMaxFile)
          throw HelperLost{"the helper program answered nonsense"};
        content += helper_->bytes(std::size_t(*size), deadline);
        continue;
      }
      if (w[0] == "ok") break;
      throw HelperLost{"the download failed: " + (w.size() > 1 ? w[1] : std::string("no reason given"))};
    }
    if (p.size != 0 && content.size() != p.size)
      throw HelperLost{"expected " + std::to_string(p.size) + " bytes, got " + std::to_string(content.size())};
    if (const std::string fault = picture_fault(content); !fault.empty()) throw HelperLost{fault};
    return content;
  }

  static fs::path store(ShotId id, const Announced& p, const std::string& content, const fs::path& folder) {
    for (;;) {
      const fs::path file = free_name(folder, shot_name(id), plain_extension(p.name));
      AtomicFile out(file);
      out.write(content);
      if (out.commit_new()) return file;
    }
  }

  GphotoOptions options_;
  fs::path program_;
  std::unique_ptr<Helper> helper_;
  std::map<ShotId, ShotOutcome> outcomes_;
};

void check_seconds(double value, const char* name) {
  if (!std::isfinite(value) || value <= 0)
    throw Error(ErrorCode::invalid_argument, "expected a positive number of seconds", name);
}

}  // namespace

std::unique_ptr<CameraDevice> open_gphoto_camera(const GphotoOptions& options, Job& job) {
  check_seconds(options.open_timeout_s, "open_timeout_s");
  check_seconds(options.event_timeout_s, "event_timeout_s");
  check_seconds(options.download_timeout_s, "download_timeout_s");
  job.check();
  auto camera = std::make_unique<GphotoCamera>(options, options.helper.empty() ? installed_helper() : options.helper);
  camera->open();
  return camera;
}

std::vector<FoundCamera> find_gphoto_cameras(Job& job, const fs::path& helper) {
  job.check();
  std::vector<FoundCamera> found;
  constexpr double kLook_s = 30;
  try {
    Helper asked(helper.empty() ? installed_helper() : helper);
    asked.ask("cameras");
    for (const auto deadline = after(kLook_s);;) {
      const Words w = asked.answer(deadline);
      if (w[0] == "ok") return found;
      if (w[0] != "camera" || w.size() != 3) throw HelperLost{w.size() > 1 ? w[1] : "no reason given"};
      found.push_back({w[1], w[2]});
    }
  } catch (const HelperLost& lost) {
    throw Error(ErrorCode::io, "cameras can't be looked for: " + lost.why);
  }
}

}  // namespace lumihull::capture
