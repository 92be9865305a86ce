// A memory card of 600 pictures into a capture, beside `cp` and `sha256sum` on the same files; the alignment alone.
//
//     bench_ingest FOLDER      an empty folder on the disk that is asked about

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/ingest.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "../capture/card_history.h"

namespace {

namespace fs = std::filesystem;
using namespace lumihull;

struct Times {
  double wall_s = 0, cpu_s = 0;
};

double cpu_seconds() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage u{};
    getrusage(who, &u);
    sum += double(u.ru_utime.tv_sec + u.ru_stime.tv_sec) + 1e-6 * double(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
  }
  return sum;
}

template <class Work>
Times timed(const Work& work) {
  const double cpu = cpu_seconds();
  const auto start = std::chrono::steady_clock::now();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), cpu_seconds() - cpu};
}

/// A JPEG of 3072 x 2048 pixels with noise, about as large as a camera writes it.
std::string picture() {
  Image image(3072, 2048, 3);
  std::mt19937 random(1);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width() * 3; ++x)
      image.row<std::uint8_t>(y)[x] = std::uint8_t(90 + (x + y) % 120 + int(random() % 12));
  return encode_jpeg(image, 90);
}

/// An APP1 segment with a date alone: "Exif", a TIFF block with one folder and, in it, the EXIF folder.
std::string with_time(const std::string& jpeg, double unix_s) {
  const auto t = std::time_t(unix_s);
  char date[32];
  std::strftime(date, sizeof date, "%Y:%m:%d %H:%M:%S", std::gmtime(&t));
  const auto u16 = [](unsigned v) { return std::string{char(v & 255), char(v >> 8)}; };
  const auto u32 = [&](unsigned v) { return u16(v & 0xffff) + u16(v >> 16); };
  std::string tiff = "II" + u16(42) + u32(8);
  tiff += u16(1) + u16(0x8769) + u16(4) + u32(1) + u32(26) + u32(0);
  tiff += u16(1) + u16(0x9003) + u16(2) + u32(20) + u32(44) + u32(0) + std::string(date, 20);
  const std::string body = std::string("Exif\0\0", 6) + tiff;
  const unsigned length = unsigned(body.size() + 2);
  return jpeg.substr(0, 2) + "\xff\xe1" + std::string{char(length >> 8), char(length & 255)} + body + jpeg.substr(2);
}

void run(const std::string& command) {
  if (std::system(command.c_str()) != 0) std::fprintf(stderr, "failed: %s\n", command.c_str());
}

void copying(const fs::path& folder) {
  const std::size_t count = 600;
  const test::History h = test::make_history({.shots = count, .offset_s = 3600}, 1);
  const fs::path card = folder / "card/DCIM/100LUMIX";
  fs::create_directories(card);
  const std::string jpeg = picture();
  for (std::size_t i = 0; i < count; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "P100%04d.JPG", int(i + 1));
    write_file(card / name, with_time(jpeg, *h.pictures[i].clock_s));
  }
  std::printf("%zu pictures of %.2f MB\n", count, double(jpeg.size()) / 1e6);
  const std::string from = (folder / "card").string();
  for (int round = 0; round < 3; ++round) {
    for (const char* name : {"peer", "ours", "one"}) {
      fs::remove_all(folder / name);
      fs::create_directory(folder / name);
    }
    run("sync");
    const Times peer = timed([&] {
      run("cp -r " + from + " " + (folder / "peer").string() + " && sync " + (folder / "peer").string() + " && find " +
          from + " -name '*.JPG' -exec sha256sum {} + > " + (folder / "sums").string());
    });
    run("sync");
    std::size_t matched = 0;
    const auto ours = [&](const char* to, unsigned threads) {
      return timed([&] {
        Job job({}, threads);
        matched = capture::ingest(folder / to, from, h.shots, {}, job).photos.size();
      });
    };
    const Times two = ours("ours", 2);
    run("sync");
    const Times one = ours("one", 1);
    std::printf(
        "cp + sync + sha256sum %.2f s (cpu %.2f); ingest, 2 threads %.2f s (cpu %.2f), 1 thread %.2f s (cpu %.2f), "
        "%zu matched\n",
        peer.wall_s, peer.cpu_s, two.wall_s, two.cpu_s, one.wall_s, one.cpu_s, matched);
  }
}

void aligning() {
  for (const std::size_t shots : {100, 600, 2000, 5000}) {
    test::HistoryOptions o{.shots = shots, .missing = 0.02, .extra = 0.02, .offset_s = -7e6, .drift_ppm = 30};
    for (const bool jump : {false, true}) {
      o.zone_jump_s = jump ? 3600 : 0;
      const test::History h = test::make_history(o, 3);
      Job job({}, 1);
      std::size_t matched = 0;
      const Times t = timed([&] { matched = capture::align_pictures(h.shots, h.pictures, {}, job).matches.size(); });
      std::printf("alignment of %zu shots and %zu pictures%s: cpu %.3f s, %zu matched\n", h.shots.size(),
                  h.pictures.size(), jump ? ", clock set once" : "", t.cpu_s, matched);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  aligning();
  if (argc > 1) copying(argv[1]);
}
