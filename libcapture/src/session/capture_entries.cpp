// capture.json from the journal, so that the other stages go on from it.

#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/base/import.h>
#include <lumihull/capture/session.h>
#include <sys/stat.h>

#include <map>
#include <set>
#include <tuple>

#include "photographs.h"

namespace lumihull::capture {

namespace fs = std::filesystem;

namespace {

auto lens_of(const ImageInfo& info) {
  return std::make_tuple(info.width, info.height, info.make, info.model, info.focal_length_mm.value_or(0),
                         info.focal_length_35mm_mm.value_or(0));
}

std::int64_t modified_ns(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return 0;
  return std::int64_t(std::uint64_t(status.st_mtim.tv_sec) * 1'000'000'000 + std::uint64_t(status.st_mtim.tv_nsec));
}

class Entries {
 public:
  Entries(Capture& capture, const Plan& plan, const JournalState& state,
          const std::map<std::string, Camera>& intrinsics)
      : capture_(capture), plan_(plan), state_(state), intrinsics_(intrinsics) {}

  void run() {
    know_cameras();
    std::map<std::string, Shot, std::less<>> known;
    std::vector<std::string> order;
    for (Shot& shot : capture_.shots) {
      order.push_back(shot.name);
      known.emplace(shot.name, std::move(shot));
    }
    capture_.shots.clear();
    const std::vector<std::string> names = internal::photograph_names(state_.head);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (state_.shots[i].landed.empty()) continue;
      const auto before = known.find(names[i]);
      const bool was_there = before != known.end();
      Shot shot = was_there ? std::move(before->second) : Shot{};
      if (was_there) known.erase(before);
      shot.name = names[i];
      fill(shot, i, state_.shots[i].landed.back());
      capture_.shots.push_back(std::move(shot));
    }
    for (const std::string& name : order)  // what was added by hand
      if (const auto other = known.find(name); other != known.end()) capture_.shots.push_back(std::move(other->second));
  }

 private:
  /// One photograph of each camera tells its device and lens.
  void know_cameras() {
    std::set<int> seen;
    for (const Shot& shot : capture_.shots)
      if (shot.commanded && seen.insert(shot.camera).second)
        cameras_.emplace(std::make_pair(shot.commanded->device, lens_of(read_image_info(capture_.photo_path(shot)))),
                         shot.camera);
  }

  void fill(Shot& shot, std::size_t index, const Take& take) {
    const PlannedStop& stop = plan_.stops[index / plan_.cameras.size()];
    const std::string& device = plan_.cameras[index % plan_.cameras.size()];
    if (shot.stamp.sha256 != take.sha256) {
      // A new photograph: what was found in the one before does not hold for it.
      const std::string mask_sha256 = shot.mask_sha256;
      const MaskSource mask_source = shot.mask_source;
      const std::string name = shot.name;
      shot = {};
      shot.name = name;
      shot.mask_sha256 = mask_sha256;  // else the old silhouette would be taken for drawn by hand
      shot.mask_source = mask_source;
      shot.file = "photos/" + take.file;
      shot.stamp = {take.sha256, take.size, modified_ns(capture_.photo_path(shot))};
      const ImageInfo info = read_image_info(capture_.photo_path(shot));
      shot.camera = camera_of(device, info, capture_.photo_path(shot));
      shot.orientation = info.orientation;
      shot.time = info.time.empty() ? take.time : info.time;
    }
    CommandedShot& commanded = shot.commanded.emplace();
    commanded.stop = stop.name;
    commanded.device = device;
    commanded.id = take.shot;
    commanded.cam_from_world = stop.cam_from_world;
    commanded.lengths_m = take.lengths_m;
    commanded.settle_s = take.settle_s;
    commanded.exposure_s = take.exposure_s;
    commanded.attempts = take.attempts;
    commanded.plan_sha256 = state_.head.plan_sha256;
    commanded.state = take.confirmed ? "confirmed" : "done";
  }

  /// The camera of another photograph by the same device with the same lens; else a new one.
  int camera_of(const std::string& device, const ImageInfo& info, const fs::path& file) {
    const auto lens = std::make_pair(device, lens_of(info));
    if (const auto found = cameras_.find(lens); found != cameras_.end()) return found->second;
    const int index = int(capture_.cameras.size());
    const std::string title = "camera " + std::to_string(index) + " (" + device + ")";
    if (const auto known = intrinsics_.find(device); known != intrinsics_.end()) {
      if (known->second.width != info.width || known->second.height != info.height)
        throw Error(ErrorCode::bad_input,
                    "the photograph has " + std::to_string(info.width) + " x " + std::to_string(info.height) +
                        " pixels, its camera's intrinsics are for " + std::to_string(known->second.width) + " x " +
                        std::to_string(known->second.height),
                    file.string());
      capture_.cameras.push_back(known->second);
      capture_.notes.push_back(title + ": intrinsics as given");
    } else {
      const auto [camera, f_known] = camera_of_header(info);
      capture_.cameras.push_back(camera);
      capture_.notes.push_back(title + (f_known ? ": f from EXIF's 35 mm equivalent; calibrate it for anything exact"
                                                : ": f is a guess (1.2 times the longer side)"));
    }
    cameras_.emplace(lens, index);
    return index;
  }

  Capture& capture_;
  const Plan& plan_;
  const JournalState& state_;
  const std::map<std::string, Camera>& intrinsics_;
  std::map<std::pair<std::string, decltype(lens_of(ImageInfo{}))>, int> cameras_;
};

}  // namespace

void update_capture(const fs::path& folder, const Plan& plan, const JournalState& state,
                    const std::map<std::string, Camera>& intrinsics) {
  std::error_code error;
  const bool is_new = !fs::exists(folder / "capture.json", error);
  if (is_new && state.views() == 0) return;  // the other stages want photographs
  Capture capture = is_new ? Capture::create_among(folder) : Capture::open(folder);
  Entries(capture, plan, state, intrinsics).run();
  capture.save();
}

}  // namespace lumihull::capture
