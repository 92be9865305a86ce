#include <lumihull/base/files.h>
#include <lumihull/hull/auto_key.h>

#include <string>
#include <utility>

#include "stage.h"

namespace lumihull::slf {

namespace {

const hull::KeyOptions kDefaults;

hull::KeyOptions options_of(const Capture& capture) {
  hull::KeyOptions o;
  o.background = effective<std::string>(capture, "key", "background");
  o.regions = effective<std::string>(capture, "key", "regions");
  o.k = int(effective<std::int64_t>(capture, "key", "k"));
  o.foreground_share = effective<double>(capture, "key", "foreground_share");
  o.max_samples = std::size_t(effective<std::int64_t>(capture, "key", "max_samples"));
  o.seed = std::uint64_t(effective<std::int64_t>(capture, "key", "seed"));
  const auto edges = effective<std::string>(capture, "key", "edges");
  o.edges = edges == "hard" ? calib::EdgeMode::hard : edges == "soft" ? calib::EdgeMode::soft : calib::EdgeMode::matte;
  o.clean = effective<bool>(capture, "key", "clean");
  return o;
}

/// Masks that keying leaves alone. Others are compared with them, and where they come and go the rest must be done
/// again.
bool is_given(const Capture& capture, const Shot& shot) {
  const MaskSource state = capture.mask_state(shot);
  return state == MaskSource::imported || state == MaskSource::edited;
}

bool needed(const Capture& capture, std::string& why) {
  for (const Shot& shot : capture.shots)
    if (!is_given(capture, shot)) return true;
  why = "every mask was imported or drawn";
  return false;
}

void inputs(const Capture& capture, InputDigest& digest) {
  add_photos(capture, digest);
  add_cameras(capture, digest);  // the training loop carves
  for (const Shot& shot : capture.shots)
    if (is_given(capture, shot)) digest.add_file("given mask " + shot.name, capture.mask_path(shot));
  const auto background = effective<std::string>(capture, "key", "background");
  if (background != "auto" && background != "enclosure" && background != "photos" && background != "regions")
    digest.add_file("key", background);
}

bool present(const Capture& capture) {
  for (const Shot& shot : capture.shots)
    if (capture.mask_state(shot) == MaskSource::none) return false;
  return true;
}

std::vector<std::string> run(Capture& capture, Job& job) {
  const hull::KeyReport report = hull::key_capture(capture, options_of(capture), job);
  std::vector<std::string> said;
  std::string line = std::to_string(report.keyed) + " masks keyed, background from " + report.source;
  if (report.rounds) line += " in " + std::to_string(report.rounds) + " rounds";
  if (report.mended) line += "; " + std::to_string(report.mended) + " mended, which the others contradict";
  if (report.kept) line += "; " + std::to_string(report.kept) + " imported or drawn masks kept";
  said.push_back(std::move(line));
  for (const std::string& warning : report.warnings) said.push_back("warning: " + warning);
  return said;
}

}  // namespace

const StageDefinition& key_stage() {
  static const StageDefinition stage{
      "key",
      2,
      {
          {"background",
           "where the background's colours come from: auto, enclosure (photographs of the empty enclosure), photos, "
           "regions, or a saved key's file",
           kDefaults.background,
           0,
           0,
           {"auto", "enclosure", "photos", "regions"},
           true},
          {"regions", "rectangles that show background: NAME:x,y,width,height;…", kDefaults.regions},
          {"k", "nearest neighbours asked", std::int64_t(kDefaults.k), 1, calib::kMaxNeighbours},
          {"foreground_share", "uniform foreground samples as a share of the background's", kDefaults.foreground_share,
           1e-4, 10},
          {"max_samples", "background samples kept", std::int64_t(kDefaults.max_samples), 100, 1e6},
          {"seed", "seed of the foreground samples", std::int64_t(kDefaults.seed), 0},
          {"edges",
           "edge pixels: hard, soft (threshold 128 is the pure decision), matte (contour at half coverage)",
           std::string("matte"),
           0,
           0,
           {"hard", "soft", "matte"}},
          {"clean", "remove specks and pinholes, mend what the other views contradict; false: the pure decision",
           kDefaults.clean},
      },
      needed,
      inputs,
      present,
      run};
  return stage;
}

}  // namespace lumihull::slf
