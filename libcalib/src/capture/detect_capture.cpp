// The targets in all photographs of a capture, kept beside it.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/detect_capture.h>
#include <lumihull/calib/detect_targets.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <optional>

#include "../targets/target_set_impl.h"
#include "detections_file.h"

namespace lumihull::calib {
namespace {

namespace fs = std::filesystem;

constexpr int kDetector = 2;  ///< goes up when the same photograph gives other detections
/// What a photograph takes while it is looked at: decoded, and the detector's planes (16 were measured).
constexpr std::int64_t kBytesPerPixel = 32;
constexpr std::int64_t kMostBytes = std::int64_t(2) << 30;

/// What the detections depend on beside the photograph.
std::string settings_text(const TargetSet& set, const CaptureDetectOptions& options) {
  return std::to_string(kDetector) + "\n" + internal::print_target_set(set, "targets") + "\n" +
         std::to_string(options.min_circle_px) + "\n" +
         (options.ink_key.empty() ? "" : sha256_of_file(options.ink_key));
}

constexpr std::size_t kMostFileBytes = std::size_t(256) << 20;

/// What is in a kept file if it has the key. A file that can't be read is as good as none: it can be made again.
std::optional<std::vector<Detection>> kept_targets(const fs::path& file, const std::string& key, const TargetSet& set) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  try {
    internal::KeptDetections kept = internal::parse_detections(read_file(file, kMostFileBytes), file.string(), set);
    if (kept.key != key) return std::nullopt;
    return std::move(kept.detections.found.targets);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::bad_input) throw;
    return std::nullopt;
  }
}

/// A copy with left and right exchanged.
Image mirrored(const Image& photo) {
  Image flipped = Image::uninitialized(photo.width(), photo.height(), photo.channels(), photo.type());
  const std::size_t pixel = photo.row_bytes() / std::size_t(photo.width());
  for (int y = 0; y < photo.height(); ++y) {
    const std::byte* from = photo.data() + photo.row_bytes() * std::size_t(y);
    std::byte* to = flipped.data() + photo.row_bytes() * std::size_t(y);
    for (int x = 0; x < photo.width(); ++x)
      std::memcpy(to + std::size_t(photo.width() - 1 - x) * pixel, from + std::size_t(x) * pixel, pixel);
  }
  return flipped;
}

/// Targets less the cells that had to be corrected: a pattern that is turned over is a word only by chance, if at all.
int credit(const std::vector<Detection>& targets) {
  int sum = 0;
  for (const Detection& d : targets) sum += 1 - d.corrected;
  return sum;
}

/// Targets of a photograph that was taken in a mirror, or flipped, as they stand in it: calibration names what is wrong
/// by the sign of their homographies.
std::vector<Detection> mirrored_targets(const TargetDetector& detector, const Image& photo, Job& job) {
  std::vector<Detection> targets = detector.detect(mirrored(photo), job).targets;
  Eigen::Matrix3d flip = Eigen::Matrix3d::Identity();
  flip(0, 0) = -1;
  flip(0, 2) = photo.width();
  for (Detection& d : targets) {
    d.pixel_from_target = flip * d.pixel_from_target;
    for (Feature& f : d.features) {
      f.pixel.x() = photo.width() - f.pixel.x();
      f.covariance(0, 1) = f.covariance(1, 0) = -f.covariance(0, 1);
      f.dual_conic = flip * f.dual_conic * flip.transpose();
    }
  }
  return targets;
}

/// Names, cameras and moments; no targets yet.
std::vector<PhotoTargets> photos_of(const Capture& capture) {
  std::vector<PhotoTargets> photos;
  std::vector<int> count(capture.cameras.size(), 0);
  for (const Shot& shot : capture.shots)
    photos.push_back({shot.name, count[std::size_t(shot.camera)]++, shot.camera, {}});
  return photos;
}

}  // namespace

fs::path detections_path(const Capture& capture, const Shot& shot) {
  return capture.folder() / "detections" / (shot.name + ".json");
}

CaptureDetections detect_capture(const Capture& capture, const TargetSet& set, const CaptureDetectOptions& options,
                                 Job& job) {
  DetectOptions detect;
  detect.min_circle_px = options.min_circle_px;
  if (!options.ink_key.empty()) detect.ink_key = ColorKey::load(options.ink_key, job);
  const TargetDetector detector(set, std::move(detect));
  const std::string settings = settings_text(set, options);
  std::error_code error;
  fs::create_directories(capture.folder() / "detections", error);
  if (error)
    throw Error(ErrorCode::io, "can't make the folder: " + error.message(), (capture.folder() / "detections").string());

  CaptureDetections out;
  out.photos = photos_of(capture);
  std::atomic<std::size_t> known{0};
  const auto look = [&](std::size_t i, Job& inner) {
    const Shot& shot = capture.shots[i];
    const std::string key = sha256(shot.stamp.sha256 + "\n" + settings);
    const fs::path file = detections_path(capture, shot);
    if (auto targets = kept_targets(file, key, set)) {
      out.photos[i].targets = std::move(*targets);
      ++known;
      return;
    }
    internal::KeptDetections seen;
    seen.key = key;
    seen.detections.photo = shot.name;
    {
      const Image photo = capture.read_photo(i, 0);
      seen.detections.width = photo.width(), seen.detections.height = photo.height();
      seen.detections.found = detector.detect(photo, inner);
      std::vector<Detection>& targets = seen.detections.found.targets;
      if (credit(targets) <= 0)
        if (auto turned = mirrored_targets(detector, photo, inner); credit(turned) > credit(targets))
          targets = std::move(turned);
    }
    const std::string text = internal::print_detections(set, seen);
    write_file(file, text);
    // As it will be read: a run that was stopped and one that was not must go on with the same digits.
    out.photos[i].targets = internal::parse_detections(text, file.string(), set).detections.found.targets;
  };

  std::int64_t largest = 0;
  for (const Camera& c : capture.cameras) largest = std::max(largest, std::int64_t(c.width) * c.height);
  job.begin("finding targets", capture.shots.size());
  if (capture.shots.size() >= job.threads() && largest * kBytesPerPixel * job.threads() <= kMostBytes) {
    parallel_for(
        job, capture.shots.size(),
        [&](std::size_t i) {
          Job inner({}, 1);
          look(i, inner);
        },
        true);
  } else {
    for (std::size_t i = 0; i < capture.shots.size(); ++i) {
      job.check();
      look(i, job);
      job.advance();
    }
  }
  job.end();
  out.kept = known;
  return out;
}

CaptureDetections kept_detections(const Capture& capture, const TargetSet& set) {
  CaptureDetections out;
  out.photos = photos_of(capture);
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    const fs::path file = detections_path(capture, capture.shots[i]);
    std::error_code ignored;
    if (!fs::exists(file, ignored)) continue;
    out.photos[i].targets =
        internal::parse_detections(read_file(file, kMostFileBytes), file.string(), set).detections.found.targets;
    ++out.kept;
  }
  return out;
}

}  // namespace lumihull::calib
