#include <fcntl.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/simulated_devices.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <thread>

namespace lumihull::capture {

namespace fs = std::filesystem;
using capture::PlannedStop;
using capture::ShotId;
using capture::ShotOutcome;
using capture::ShotState;

namespace {

void pass(double seconds, Job& job) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    job.check();
    const auto left = end - std::chrono::steady_clock::now();
    std::this_thread::sleep_for(std::min<std::chrono::duration<double>>(left, std::chrono::milliseconds(20)));
  }
}

/// In one write, so that a killed program leaves a whole line or none.
void append_line(const fs::path& file, const std::string& line) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  const bool good = descriptor >= 0 && ::write(descriptor, line.data(), line.size()) == ssize_t(line.size());
  if (descriptor >= 0) ::close(descriptor);
  if (!good) throw Error(ErrorCode::io, "can't write the camera's list", file.string());
}

std::uint32_t mixed(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

}  // namespace

SimulatedRobot::SimulatedRobot(const Options& options) : options_(options), known_(options.starts_anywhere) {
  if (options.memory.empty()) return;
  std::ifstream in(options.memory);
  double length = 0;
  if (!(in >> stop_)) return;
  while (in >> length) lengths_m_.push_back(length);
  known_ = true;
}

capture::Robot::State SimulatedRobot::state() {
  return {.ready = true, .moving = false, .position_known = known_, .lengths_m = lengths_m_, .fault = {}};
}

void SimulatedRobot::remember(const std::vector<double>& lengths_m, const std::string& stop) {
  lengths_m_ = lengths_m;
  stop_ = stop;
  known_ = true;
  if (options_.memory.empty()) return;
  std::ostringstream text;
  text.precision(17);
  text << stop;
  for (const double length : lengths_m) text << ' ' << length;
  // Not the file's content but the controller's memory: it must not be torn, it need not survive a power cut.
  const fs::path aside = options_.memory.string() + ".new";
  std::ofstream(aside) << text.str();
  fs::rename(aside, options_.memory);
}

void SimulatedRobot::move_to(const PlannedStop& stop, Job& job) {
  if (on_move) on_move(stop);
  motors_on_ = true;
  std::vector<double> half = stop.lengths_m;
  for (std::size_t i = 0; i < half.size() && i < lengths_m_.size(); ++i) half[i] = (half[i] + lengths_m_[i]) / 2;
  remember(half, "between");
  pass(stop.travel_s * options_.time_scale, job);
  remember(stop.lengths_m, stop.name);
}

void SimulatedRobot::set_roll(double roll_rad, Job& job) {
  if (on_roll) on_roll(roll_rad);
  pass(options_.turn_s * options_.time_scale, job);
}

void SimulatedRobot::declare_position(const PlannedStop& stop) { remember(stop.lengths_m, stop.name); }

/// Squares of a checkerboard in colours of the shot, and a blot whose place is the shot's number.
std::string SimulatedCamera::picture(ShotId id, const std::string& stop) const {
  std::uint32_t seed = mixed(id);
  for (const char c : options_.name + "/" + stop) seed = mixed(seed ^ std::uint8_t(c));
  Image image(options_.width, options_.height, 3);
  const int side = std::max(4, options_.width / 12);
  const int blot_x = int(seed % std::uint32_t(options_.width)),
            blot_y = int(mixed(seed) % std::uint32_t(options_.height));
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      for (int c = 0; c < 3; ++c) {
        const bool light = ((x / side) + (y / side)) % 2 == 0;
        const bool blot = std::abs(x - blot_x) < side / 2 && std::abs(y - blot_y) < side / 2;
        const int base = int(seed >> (8 * c) & 0x7f);
        image.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(blot ? 230 : light ? 100 + base : 20 + base / 2);
      }
  return encode_jpeg(image, 85);
}

ShotOutcome SimulatedCamera::shoot(ShotId id, double exposure_s, const fs::path& folder, Job& job) {
  ready_ = true;
  if (instead)
    if (const auto outcome = instead(id)) return *outcome;
  const std::string stop = robot_ && !robot_->stop().empty() ? robot_->stop() : "nowhere";
  const std::string bytes = picture(id, stop);
  const fs::path place = (options_.delivers ? folder : options_.card) / ("IMG_" + std::to_string(id) + ".jpg");
  append_line(options_.list, std::to_string(id) + " " + stop + " " + sha256(bytes) + " " + place.string() + "\n");
  pass(exposure_s * options_.time_scale, job);
  {
    // As a download comes in: a killed program leaves half of it.
    std::ofstream out(place, std::ios::binary);
    out.write(bytes.data(), std::streamsize(bytes.size() / 2)).flush();
    if (halfway) halfway(id);
    pass(exposure_s * options_.time_scale / 2, job);
    out.write(bytes.data() + bytes.size() / 2, std::streamsize(bytes.size() - bytes.size() / 2)).flush();
    if (!out) return {ShotState::unknown, {}, "the download failed"};
  }
  if (afterwards)
    if (const auto outcome = afterwards(id)) return *outcome;
  return {.state = ShotState::done, .file = options_.delivers ? place : fs::path(), .detail = {}};
}

ShotOutcome SimulatedCamera::recall(ShotId id) {
  if (!options_.recalls) return {ShotState::unknown, {}, "this camera keeps no list"};
  std::ifstream in(options_.list);
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    ShotId listed = 0;
    std::string stop, digest, path;
    if (!(words >> listed >> stop >> digest >> path) || listed != id) continue;
    if (options_.delivers) write_file(path, picture(id, stop));  // from its card, once more
    return {.state = ShotState::done, .file = options_.delivers ? fs::path(path) : fs::path(), .detail = {}};
  }
  return {ShotState::refused, {}, "not on the camera's list"};
}

}  // namespace lumihull::capture
