// How surely targets are found and read: rates by size, tilt and blur for each family, and wrong ids among all renders.
// libapriltag and OpenCV's ArUco look at tags of the same outer size in the same poses.
//
//     bench_detection [OUT_FOLDER] [--renders 2000] [--families matrix5x5,…] [--seed 1] [--threads 0] [--only INDEX]
//
// Each family gets its share of the renders. A render: one target on its sheet under random turn, tilt (0 … 75°),
// circles' minor axis (3.5 … 40 px, mostly small; a tag's as if it were a 5 x 5 target of its outer size), blur (half
// of them .3 … 1, half 0 … 3 px), exposure, shading, noise of .3 … 2 % of white, background; a quarter each in the
// corner of a 10 mm lens's picture, through a Bayer mosaic, through a JPEG, one in twenty partly hidden. `found`: the
// id was read and each feature is where it belongs; a detection that is not is wrong. --only writes that render of each
// family as a picture and says what was refused, and why.

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/job.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/detect_targets.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "../calib/targets/target_shot.h"
#include "svg_plot.h"

using namespace lumihull;
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kChunk = 50;  ///< renders
constexpr double kDegree = std::numbers::pi / 180;

struct Settings {
  fs::path out = ".";
  std::size_t renders = 2000;
  std::vector<std::string> families{"matrix5x5", "matrix6x6", "paper4x4", "apriltag:36h11", "aruco:6x6_250"};
  std::uint64_t seed = 1;
  unsigned threads = 0;
  std::optional<std::size_t> only;
};

/// What became of one render, by one detector.
struct Outcome {
  bool found = false;
  int wrong = 0;
};

struct Render {
  test::Seen seen;
  Outcome ours, peer;
  double ms = 0, peer_ms = 0;  ///< CPU
  int width = 0, height = 0;
};

double cpu_ms() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * double(t.tv_sec) + 1e-6 * double(t.tv_nsec);
}

test::Seen draw(std::uint64_t seed) {
  test::Dice dice(seed);
  test::Seen seen;
  const auto log_between = [&](double a, double b) { return a * std::pow(b / a, dice.unit()); };
  seen.minor_px = dice.chance(.9) ? log_between(3.5, 12) : log_between(12, 40);
  seen.tilt_rad = dice.between(0, 75) * kDegree;
  seen.blur_px = dice.chance(.5) ? dice.between(.3, 1) : dice.between(0, 3);
  seen.wide = dice.chance(.25), seen.bayer = dice.chance(.25), seen.jpeg = dice.chance(.25);
  seen.occluded = dice.chance(.05);
  seen.noise = log_between(.003, .02);
  return seen;
}

/// A peer's answer: a tag's id and its middle.
struct Tag {
  int id;
  Eigen::Vector2d center;
};

Outcome judge_tags(const test::TargetShot& shot, const std::vector<Tag>& tags, double minor_px) {
  Outcome outcome;
  const auto truth = shot.camera.project(shot.cam_from_target.translation);
  for (const Tag& tag : tags)
    if (tag.id == shot.id && (tag.center - *truth).norm() < std::max(3., 2 * minor_px) && !outcome.found)
      outcome.found = true;
    else
      ++outcome.wrong;
  return outcome;
}

/// libapriltag at full resolution, otherwise as it comes.
class AprilTagPeer {
 public:
  AprilTagPeer() : family_(tag36h11_create()), detector_(apriltag_detector_create()) {
    apriltag_detector_add_family(detector_, family_);
    detector_->quad_decimate = 1;
  }
  AprilTagPeer(const AprilTagPeer&) = delete;
  AprilTagPeer& operator=(const AprilTagPeer&) = delete;
  ~AprilTagPeer() { apriltag_detector_destroy(detector_), tag36h11_destroy(family_); }

  std::vector<Tag> operator()(const Image& grey) {
    image_u8_t picture{grey.width(), grey.height(), grey.width(),
                       reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(grey.data()))};
    zarray_t* found = apriltag_detector_detect(detector_, &picture);
    std::vector<Tag> tags;
    for (int i = 0; i < zarray_size(found); ++i) {
      apriltag_detection_t* d;
      zarray_get(found, i, static_cast<void*>(&d));
      tags.push_back({d->id, {d->c[0], d->c[1]}});
    }
    apriltag_detections_destroy(found);
    return tags;
  }

 private:
  apriltag_family_t* family_;
  apriltag_detector_t* detector_;
};

std::vector<Tag> aruco_tags(const Image& grey) {
  static const cv::Ptr<cv::aruco::Dictionary> dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_6X6_250);
  const cv::Mat picture(grey.height(), grey.width(), CV_8U, const_cast<std::byte*>(grey.data()));
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
  cv::aruco::detectMarkers(picture, dictionary, corners, ids);
  std::vector<Tag> tags;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    Eigen::Vector2d middle(.5, .5);
    for (const cv::Point2f& p : corners[i]) middle += .25 * Eigen::Vector2d(p.x, p.y);
    tags.push_back({ids[i], middle});
  }
  return tags;
}

/// Rates over those renders of a family that `select` takes.
struct Rate {
  std::size_t renders = 0, found = 0;
  double percent() const { return renders ? 100. * double(found) / double(renders) : 0; }
};

Rate rate(const std::vector<Render>& renders, bool peer, const std::function<bool(const Render&)>& select) {
  Rate r;
  for (const Render& x : renders)
    if (!x.seen.occluded && select(x)) ++r.renders, r.found += peer ? x.peer.found : x.ours.found;
  return r;
}

struct Row {
  std::string label;
  bool peer;
  const std::vector<Render>* renders;
};

/// One family's renders: all that follows from their numbers.
struct Family {
  std::string name;
  calib::TargetDesign design;
  calib::TargetDetector detector;
  std::uint64_t seed;

  Family(const std::string& family, std::uint64_t of_renders)
      : name(family), design(make_design(family)), detector(set_of(design), smallest()), seed(of_renders) {}

  static calib::TargetDesign make_design(const std::string& family) {
    calib::TargetDesign d;
    d.family = calib::TargetFamily::by_name(family);
    if (d.family.kind() == calib::TargetKind::square) d.ink = {25, 25, 25}, d.paper = {215, 215, 215};
    return test::sized(d, .09);
  }
  static calib::TargetSet set_of(const calib::TargetDesign& d) {
    calib::TargetSet set;
    set.designs = {d};
    return set;
  }
  static calib::DetectOptions smallest() {
    calib::DetectOptions options;
    options.min_circle_px = 3;
    return options;
  }

  test::TargetShot shot(std::size_t i, test::Seen& seen) const {
    const std::uint64_t own = test::Dice(seed * 0x100000001ull + i).next();
    seen = draw(own);
    const auto ids = design.family.ids();
    return test::photograph_target(design, ids[std::size_t(own >> 7) % ids.size()], seen, own);
  }
};

/// Writes a render and says what was made of it.
void show(const Family& family, std::size_t i, const fs::path& out) {
  test::Seen seen;
  const test::TargetShot shot = family.shot(i, seen);
  std::string stem = family.name + "_" + std::to_string(i);
  std::replace(stem.begin(), stem.end(), ':', '_');
  write_png(out / (stem + ".png"), shot.photo);
  Job job({}, 1);
  const calib::Detections found = family.detector.detect(shot.photo, job);
  write_png(out / (stem + "_drawn.png"), calib::draw_detections(shot.photo, Family::set_of(family.design), found));
  std::printf("%s %zu: id %d, minor axis %.2f px, tilt %.1f°, blur %.2f px, noise %.4f%s%s%s%s\n", family.name.c_str(),
              i, shot.id, seen.minor_px, seen.tilt_rad / kDegree, seen.blur_px, seen.noise, seen.wide ? ", 10 mm" : "",
              seen.bayer ? ", Bayer" : "", seen.jpeg ? ", JPEG" : "", seen.occluded ? ", hidden" : "");
  for (const calib::Detection& t : found.targets)
    std::printf("  id %d, %zu features, corrected %d, erased %d, rms %.3f px\n", t.id, t.features.size(), t.corrected,
                t.erased, t.rms_px);
  const char* reasons[] = {"no code", "homography", "duplicate", "too few features", "unknown id", "overexposed"};
  for (const calib::RefusedTarget& t : found.refused)
    std::printf("  refused: %s at (%.1f, %.1f), %.1f px, id %d\n", reasons[std::size_t(t.reason)], t.pixel.x(),
                t.pixel.y(), t.size_px, t.id);
}

std::vector<Render> study(const Family& family, std::size_t count, Job& job) {
  std::vector<Render> renders(count);
  job.begin(family.name, count);
  parallel_chunks(
      job, count, kChunk,
      [&](std::size_t first, std::size_t last) {
        Job own({}, 1);
        std::unique_ptr<AprilTagPeer> april;
        if (family.name == "apriltag:36h11") april = std::make_unique<AprilTagPeer>();
        for (std::size_t i = first; i < last; ++i) {
          Render& render = renders[i];
          const test::TargetShot shot = family.shot(i, render.seen);
          render.width = shot.photo.width(), render.height = shot.photo.height();
          double start = cpu_ms();
          const calib::Detections found = family.detector.detect(shot.photo, own);
          render.ms = cpu_ms() - start;
          const test::Verdict verdict = test::judge(shot, family.design, found.targets);
          render.ours = {verdict.found, verdict.wrong};
          if (verdict.wrong)
            for (const calib::Detection& t : found.targets)
              std::fprintf(stderr,
                           "wrong: %s --seed %llu --only %zu: id %d for %d, corrected %d, erased %d, rms %.3f px\n",
                           family.name.c_str(), static_cast<unsigned long long>(family.seed), i, t.id, shot.id,
                           t.corrected, t.erased, t.rms_px);
          if (!april && family.name != "aruco:6x6_250") continue;
          const Image grey = converted(shot.photo, PixelType::u8, 1);
          start = cpu_ms();
          render.peer = judge_tags(shot, april ? (*april)(grey) : aruco_tags(grey), render.seen.minor_px);
          render.peer_ms = cpu_ms() - start;
        }
      },
      true);
  job.end();
  return renders;
}

bool sharp(const Render& r) { return r.seen.blur_px <= 1; }
double degrees(const Render& r) { return r.seen.tilt_rad / kDegree; }

void print_table(const std::string& title, const std::vector<Row>& rows, const std::vector<double>& edges,
                 const std::function<double(const Render&)>& value, const std::function<bool(const Render&)>& among) {
  std::printf("\n%s\n%-28s", title.c_str(), "");
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) std::printf(" %5g-%-5g", edges[i], edges[i + 1]);
  std::printf("\n");
  for (const Row& row : rows) {
    std::printf("%-28s", row.label.c_str());
    for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
      const Rate r = rate(*row.renders, row.peer,
                          [&](const Render& x) { return among(x) && value(x) >= edges[i] && value(x) < edges[i + 1]; });
      r.renders ? std::printf(" %11.2f", r.percent()) : std::printf(" %11s", "-");
    }
    std::printf("\n");
  }
}

void write_plot(const fs::path& file, const std::string& title, const std::string& x_label,
                const std::vector<Row>& rows, const std::vector<double>& edges,
                const std::function<double(const Render&)>& value, const std::function<bool(const Render&)>& among) {
  bench::Plot plot{title, x_label, "found, %", {}, {}};
  for (const Row& row : rows) {
    bench::Curve curve{row.label, {}};
    for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
      const Rate r = rate(*row.renders, row.peer,
                          [&](const Render& x) { return among(x) && value(x) >= edges[i] && value(x) < edges[i + 1]; });
      if (r.renders) curve.points.push_back({.5 * (edges[i] + edges[i + 1]), r.percent(), ""});
    }
    if (!curve.points.empty()) plot.curves.push_back(curve);
  }
  write_file(file, bench::svg(plot));
}

void run(const Settings& s) {
  Job job(
      [](const Progress& p) {
        std::fprintf(stderr, "\r  %-24s %3.0f %%\r", p.stage.c_str(), 100. * double(p.done) / double(p.total));
      },
      s.threads);
  cv::setNumThreads(1);
  std::vector<std::vector<Render>> all;
  all.reserve(s.families.size());
  for (const std::string& name : s.families) {
    const Family family(name, s.seed);
    if (s.only)
      show(family, *s.only, s.out);
    else
      all.push_back(study(family, s.renders / s.families.size(), job));
  }
  if (s.only) return;

  std::vector<Row> rows;
  std::string csv =
      "family,detector,minor_px,tilt_deg,blur_px,noise,wide,bayer,jpeg,occluded,width,height,found,wrong,ms\n";
  for (std::size_t k = 0; k < s.families.size(); ++k) {
    const std::string& name = s.families[k];
    const std::string peer = name == "apriltag:36h11" ? "libapriltag" : name == "aruco:6x6_250" ? "OpenCV" : "";
    rows.push_back({name, false, &all[k]});
    if (!peer.empty()) rows.push_back({name + ", " + peer, true, &all[k]});
    for (const Render& r : all[k])
      for (const bool by_peer : {false, true}) {
        if (by_peer && peer.empty()) continue;
        const Outcome& o = by_peer ? r.peer : r.ours;
        char line[200];
        std::snprintf(line, sizeof line, "%s,%s,%.3f,%.2f,%.3f,%.4f,%d,%d,%d,%d,%d,%d,%d,%d,%.2f\n", name.c_str(),
                      by_peer ? peer.c_str() : "lumihull", r.seen.minor_px, degrees(r), r.seen.blur_px, r.seen.noise,
                      r.seen.wide, r.seen.bayer, r.seen.jpeg, r.seen.occluded, r.width, r.height, o.found, o.wrong,
                      by_peer ? r.peer_ms : r.ms);
        csv += line;
      }
  }
  write_file(s.out / "detection.csv", csv);

  std::printf("%-28s %9s %7s %9s %22s %14s\n", "", "renders", "wrong", "wrong", "goal: >= 5 px, <= 60°", "CPU, ms a");
  std::printf("%-28s %9s %7s %9s %22s %14s\n", "", "", "", "hidden", "blur <= 1 px: found, %", "megapixel");
  for (const Row& row : rows) {
    std::size_t wrong = 0, hidden = 0;
    double ms = 0, pixels = 0;
    for (const Render& r : *row.renders) {
      (r.seen.occluded ? hidden : wrong) += std::size_t(row.peer ? r.peer.wrong : r.ours.wrong);
      ms += row.peer ? r.peer_ms : r.ms, pixels += double(r.width) * r.height;
    }
    const Rate goal = rate(*row.renders, row.peer,
                           [](const Render& r) { return r.seen.minor_px >= 5 && degrees(r) <= 60 && sharp(r); });
    std::printf("%-28s %9zu %7zu %9zu %13.2f (%6zu) %14.0f\n", row.label.c_str(), row.renders->size(), wrong, hidden,
                goal.percent(), goal.renders, 1e6 * ms / pixels);
  }
  const auto minor = [](const Render& r) { return r.seen.minor_px; };
  const auto blur = [](const Render& r) { return r.seen.blur_px; };
  const std::vector<double> sizes{3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 10, 12, 20, 40},
      tilts{0, 15, 30, 40, 50, 60, 65, 70, 75}, blurs{0, .25, .5, .75, 1, 1.25, 1.5, 1.75, 2, 2.5, 3};
  print_table("found, %, by the circles' minor axis, px (tilt <= 60°, blur <= 1 px)", rows, sizes, minor,
              [](const Render& r) { return degrees(r) <= 60 && sharp(r); });
  print_table("found, %, by tilt, degrees (minor axis 5 ... 12 px, blur <= 1 px)", rows, tilts, degrees,
              [](const Render& r) { return r.seen.minor_px >= 5 && r.seen.minor_px < 12 && sharp(r); });
  print_table("found, %, by blur, px (minor axis 5 ... 8 px, tilt <= 60°)", rows, blurs, blur,
              [](const Render& r) { return degrees(r) <= 60 && r.seen.minor_px >= 5 && r.seen.minor_px < 8; });
  print_table("found, %, by blur, px (minor axis 8 ... 12 px, tilt <= 60°)", rows, blurs, blur,
              [](const Render& r) { return degrees(r) <= 60 && r.seen.minor_px >= 8 && r.seen.minor_px < 12; });
  const auto split = [&](const char* title, const std::function<bool(const Render&)>& which) {
    std::printf("\n%s, found, %% (>= 5 px, <= 60°, blur <= 1 px)\n", title);
    for (const Row& row : rows) {
      const auto goal = [&](bool with) {
        return rate(*row.renders, row.peer, [&](const Render& r) {
          return r.seen.minor_px >= 5 && degrees(r) <= 60 && sharp(r) && which(r) == with;
        });
      };
      std::printf("%-28s without %7.2f (%zu)   with %7.2f (%zu)\n", row.label.c_str(), goal(false).percent(),
                  goal(false).renders, goal(true).percent(), goal(true).renders);
    }
  };
  split("10 mm lens", [](const Render& r) { return r.seen.wide; });
  split("Bayer mosaic", [](const Render& r) { return r.seen.bayer; });
  split("JPEG", [](const Render& r) { return r.seen.jpeg; });

  write_plot(s.out / "detection_size.svg", "Found, by size (tilt to 60°, blur to 1 px)", "minor axis of a circle, px",
             rows, {3.5, 4, 4.5, 5, 5.5, 6, 6.5, 7, 8, 9, 10, 12}, minor,
             [](const Render& r) { return degrees(r) <= 60 && sharp(r); });
  write_plot(s.out / "detection_tilt.svg", "Found, by tilt (minor axis 5 to 12 px, blur to 1 px)", "tilt, degrees",
             rows, tilts, degrees,
             [](const Render& r) { return r.seen.minor_px >= 5 && r.seen.minor_px < 12 && sharp(r); });
  write_plot(s.out / "detection_blur.svg", "Found, by blur (minor axis 8 to 12 px, tilt to 60°)", "blur (sigma), px",
             rows, blurs, blur,
             [](const Render& r) { return degrees(r) <= 60 && r.seen.minor_px >= 8 && r.seen.minor_px < 12; });
}

}  // namespace

int main(int argc, char** argv) {
  Settings s;
  CLI::App app("Rates at which targets are found, and wrong ids, by size, tilt and blur");
  app.add_option("out", s.out, "folder for detection.csv and detection_{size,tilt,blur}.svg")->capture_default_str();
  app.add_option("--renders", s.renders, "of all families together")->capture_default_str();
  app.add_option("--families", s.families, "names of families")->delimiter(',')->capture_default_str();
  app.add_option("--only", s.only, "number of the one render that is shown");
  app.add_option("--seed", s.seed, "of the renders")->capture_default_str();
  app.add_option("--threads", s.threads, "0: one for each core")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    fs::create_directories(s.out);
    run(s);
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "%s\n", e.what()), 1;
  }
}
