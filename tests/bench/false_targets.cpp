// What detectors find in pictures that hold no targets: noise, print, foliage, lattices of dots, tiles, photographs.
// Anything found is false. libapriltag and OpenCV's ArUco look at the same pictures.
//
//     bench_false_targets [OUT_FOLDER] [--pictures 10000] [--size 320] [--data FOLDER] [--seed 1] [--threads 0]
//
// Crops are taken from photographs in FOLDER's dinosaur, temple, chessboards and case ($LUMIHULL_TEST_DATA; without,
// that kind is left out). `case` shows ArUco markers of 6x6_250: families of ArUco do not look at its crops.

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/detect_targets.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "../calib/targets/pictures_without_targets.h"
#include "../calib/targets/target_shot.h"

using namespace lumihull;
namespace fs = std::filesystem;

namespace {

struct Settings {
  fs::path out = ".", data;
  std::size_t pictures = 10000;
  int size = 320;
  std::uint64_t seed = 1;
  unsigned threads = 0;
  std::vector<std::string> families{"matrix5x5", "matrix6x6", "paper4x4", "apriltag:36h11", "aruco:6x6_250"};
};

std::vector<Image> photographs(const fs::path& data, const std::vector<std::string>& folders) {
  std::vector<fs::path> files;
  for (const std::string& folder : folders)
    if (fs::is_directory(data / folder))
      for (const auto& entry : fs::directory_iterator(data / folder))
        if (entry.path().extension() == ".png" || entry.path().extension() == ".jpg") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  ReadOptions rgb;
  rgb.channels = 3;
  std::vector<Image> images;
  for (const fs::path& file : files) images.push_back(read_image(file, rgb));
  return images;
}

std::size_t libapriltag(const Image& grey) {
  apriltag_family_t* family = tag36h11_create();
  apriltag_detector_t* detector = apriltag_detector_create();
  apriltag_detector_add_family(detector, family);
  detector->quad_decimate = 1;
  image_u8_t picture{grey.width(), grey.height(), grey.width(),
                     reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(grey.data()))};
  zarray_t* found = apriltag_detector_detect(detector, &picture);
  const auto n = std::size_t(zarray_size(found));
  apriltag_detections_destroy(found), apriltag_detector_destroy(detector), tag36h11_destroy(family);
  return n;
}

std::size_t opencv(const Image& grey) {
  static const cv::Ptr<cv::aruco::Dictionary> dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_6X6_250);
  const cv::Mat picture(grey.height(), grey.width(), CV_8U, const_cast<std::byte*>(grey.data()));
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
  cv::aruco::detectMarkers(picture, dictionary, corners, ids);
  return ids.size();
}

void run(const Settings& s) {
  Job job(
      [](const Progress& p) {
        std::fprintf(stderr, "\r  %-24s %3.0f %%\r", p.stage.c_str(), 100. * double(p.done) / double(p.total));
      },
      s.threads);
  cv::setNumThreads(1);
  // Whatever holds no ArUco markers first: its crops are for all families.
  const std::vector<Image> plain = photographs(s.data, {"dinosaur", "temple", "chessboards"}),
                           marked = photographs(s.data, {"case"});
  std::vector<calib::TargetDetector> detectors;
  for (const std::string& name : s.families) {
    calib::TargetSet set;
    calib::TargetDesign design;
    design.family = calib::TargetFamily::by_name(name);
    set.designs = {test::sized(design, .09)};
    calib::DetectOptions options;
    options.min_circle_px = 3;
    detectors.emplace_back(set, options);
  }
  const std::size_t columns = s.families.size() + 2;
  const int kinds = plain.empty() ? test::kClutterKinds - 1 : test::kClutterKinds;
  std::vector<std::vector<int>> found(s.pictures, std::vector<int>(columns, 0));
  std::mutex mutex;
  std::string csv = "kind,picture,family,id,corrected,erased,rms_px,x,y\n";
  job.begin("pictures", s.pictures);
  parallel_chunks(
      job, s.pictures, 20,
      [&](std::size_t first, std::size_t last) {
        Job own({}, 1);
        for (std::size_t i = first; i < last; ++i) {
          const auto kind = test::Clutter(int(i % std::size_t(kinds)));
          const bool of_case = kind == test::Clutter::photographs && !marked.empty() && i / std::size_t(kinds) % 4 == 3;
          const Image picture = test::clutter(kind, s.size, s.seed * 1000003 + i, of_case ? marked : plain);
          for (std::size_t k = 0; k < detectors.size(); ++k) {
            if (of_case && s.families[k].starts_with("aruco")) continue;
            for (const calib::Detection& t : detectors[k].detect(picture, own).targets) {
              ++found[i][k];
              const std::lock_guard lock(mutex);
              char line[200];
              std::snprintf(line, sizeof line, "%s,%zu,%s,%d,%d,%d,%.3f,%.1f,%.1f\n", test::clutter_name(kind).c_str(),
                            i, s.families[k].c_str(), t.id, t.corrected, t.erased, t.rms_px, t.features[0].pixel.x(),
                            t.features[0].pixel.y());
              csv += line;
              std::fprintf(stderr, "false: seed %llu size %d %s", static_cast<unsigned long long>(s.seed), s.size,
                           line);
            }
          }
          const Image grey = converted(picture, PixelType::u8, 1);
          found[i][columns - 2] = int(libapriltag(grey));
          if (!of_case) found[i][columns - 1] = int(opencv(grey));
        }
      },
      true);
  job.end();
  write_file(s.out / "false_targets.csv", csv);

  std::printf("%-14s %9s", "", "pictures");
  for (const std::string& name : s.families) std::printf(" %14s", name.c_str());
  std::printf(" %14s %14s\n", "libapriltag", "OpenCV ArUco");
  std::vector<int> total(columns, 0);
  for (int kind = 0; kind < kinds; ++kind) {
    std::vector<int> sum(columns, 0);
    std::size_t pictures = 0;
    for (std::size_t i = std::size_t(kind); i < s.pictures; i += std::size_t(kinds), ++pictures)
      for (std::size_t k = 0; k < columns; ++k) sum[k] += found[i][k], total[k] += found[i][k];
    std::printf("%-14s %9zu", test::clutter_name(test::Clutter(kind)).c_str(), pictures);
    for (const int n : sum) std::printf(" %14d", n);
    std::printf("\n");
  }
  std::printf("%-14s %9zu", "all", s.pictures);
  for (const int n : total) std::printf(" %14d", n);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  Settings s;
  if (const char* data = std::getenv("LUMIHULL_TEST_DATA")) s.data = data;
  CLI::App app("Targets that detectors find in pictures without any");
  app.add_option("out", s.out, "folder for false_targets.csv")->capture_default_str();
  app.add_option("--pictures", s.pictures, "of all kinds together")->capture_default_str();
  app.add_option("--size", s.size, "of a picture, px")->capture_default_str();
  app.add_option("--data", s.data, "folder of the real photographs")->capture_default_str();
  app.add_option("--families", s.families, "names of families")->delimiter(',')->capture_default_str();
  app.add_option("--seed", s.seed, "of the pictures")->capture_default_str();
  app.add_option("--threads", s.threads, "0: one for each core")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    fs::create_directories(s.out);
    run(s);
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "%s\n", e.what()), 1;
  }
}
