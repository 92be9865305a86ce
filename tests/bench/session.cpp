// The capture's own costs: journal events with fsync, the contact sheet of many photographs. No peer: other rigs keep
// no journal that survives a crash.

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/session.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>

namespace {

namespace fs = std::filesystem;
using namespace lumihull;
using namespace lumihull::capture;

double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * double(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

struct Timer {
  std::chrono::steady_clock::time_point wall = std::chrono::steady_clock::now();
  double cpu = cpu_s();
  void print(const char* what, double count) const {
    const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count(), c = cpu_s() - cpu;
    std::printf("%-44s %8.3f s wall (%.3f ms each), %8.3f s CPU (%.3f ms each)\n", what, s, 1e3 * s / count, c,
                1e3 * c / count);
  }
};

Plan plan_of(int stops) {
  Plan plan;
  plan.robot = "turntable";
  plan.cameras = {"main"};
  for (int i = 0; i < stops; ++i) {
    PlannedStop stop;
    stop.name = "s" + std::to_string(i);
    stop.theta_rad = 6.28 * i / stops;
    plan.stops.push_back(stop);
  }
  return plan;
}

JournalHead head_of(const Plan& plan) {
  JournalHead head{std::string(64, '0'), "{stop}", {}, plan.cameras, {}};
  for (const PlannedStop& stop : plan.stops) head.stops.push_back(stop.name);
  return head;
}

/// Noise and gradients: as many bytes as a photograph has.
Image photograph(int i) {
  Image image(3072, 2048, 3);
  std::uint32_t x = 1 + std::uint32_t(i);
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u)
      for (int c = 0; c < 3; ++c) {
        x = x * 1664525 + 1013904223;
        const bool square = (u / 200 + v / 200 + i) % 2 == 0;
        image.row<std::uint8_t>(v)[3 * u + c] = std::uint8_t((square ? 150 : 60) + (x >> 28) + u / 64);
      }
  return image;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Journal and contact sheet.");
  std::string place;
  int events = 3000, photos = 600;
  app.add_option("folder", place, "an empty folder, on the disk to be measured")->required();
  app.add_option("--events", events, "events")->check(CLI::Range(10, 1000000));
  app.add_option("--photos", photos, "photographs")->check(CLI::Range(1, 10000));
  CLI11_PARSE(app, argc, argv);

  const Plan plan = plan_of(photos);
  fs::create_directories(place);
  {
    Journal journal = Journal::create(fs::path(place) / "events.jsonl", head_of(plan));
    const Timer timer;
    for (int i = 0; i < events; ++i)
      journal.append({.kind = EventKind::moving, .stop = plan.stops[std::size_t(i) % plan.stops.size()].name});
    timer.print("journal events, each synchronised", events);
  }
  {
    const Timer timer;
    read_journal(fs::path(place) / "events.jsonl");
    timer.print("the same events read", events);
  }

  const fs::path folder = fs::path(place) / "capture";
  fs::create_directories(folder / "photos");
  Journal journal = Journal::create(journal_path(folder), head_of(plan));
  const int different = std::min(photos, 8);
  std::vector<std::string> jpegs;
  for (int i = 0; i < different; ++i) jpegs.push_back(encode_jpeg(photograph(i), 90));
  for (int i = 0; i < photos; ++i) {
    // A comment behind the start marker makes every file another one.
    std::string bytes = jpegs[std::size_t(i % different)];
    const std::string comment = std::to_string(100000 + i);
    bytes.insert(2, std::string("\xff\xfe\x00\x08", 4) + comment);
    const auto id = ShotId(i + 1);
    journal.append({.kind = EventKind::firing, .stop = plan.stops[std::size_t(i)].name, .camera = "main", .shot = id});
    journal.append({.kind = EventKind::done, .shot = id});
    const std::string name = plan.stops[std::size_t(i)].name + ".jpg";
    write_file(folder / "photos" / name, bytes);
    journal.append({.kind = EventKind::file, .shot = id, .file = name, .sha256 = sha256(bytes), .size = bytes.size()});
  }
  std::printf("%d photographs of 3072 x 2048, %.1f MB each\n", photos, double(jpegs[0].size()) / 1e6);
  reset_peak_memory();
  {
    const Timer timer;
    write_contact_sheet(folder, plan, journal.state(), "going on", 60);
    timer.print("contact sheet, all thumbnails new", photos);
  }
  std::printf("peak memory %.0f MB, page %.0f kB\n", double(peak_memory_bytes()) / 1e6,
              double(fs::file_size(folder / "contact.html")) / 1e3);
  {
    const Timer timer;
    for (int i = 0; i < 10; ++i) write_contact_sheet(folder, plan, journal.state(), "going on", 60);
    timer.print("contact sheet, thumbnails there", 10);
  }
  {
    const Timer timer;
    update_capture(folder, plan, journal.state());
    timer.print("capture.json, written first", 1);
  }
  {
    const Timer timer;
    for (int i = 0; i < 10; ++i) update_capture(folder, plan, journal.state());
    timer.print("capture.json, brought up to date", 10);
  }
}
