// lumihull detect PHOTO… --targets WORD|FILE: printed targets in photographs, with ids, places and covariances.

#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/detections_json.h>
#include <lumihull/calib/ink_key.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <optional>

#include "program.h"

namespace lumihull::program {

namespace {

using calib::Detection;
using calib::Detections;

struct Arguments {
  std::vector<std::string> photos;
  std::string targets, ink_key, learn_ink_key, draw;
  double magnify = 100;
};

struct Seen {
  calib::PhotoDetections of;
  std::string drawing;
};

std::vector<int> count_reasons(const Detections& found) {
  std::vector<int> counts(calib::refusal_names().size(), 0);
  for (const auto& r : found.refused) ++counts.at(std::size_t(r.reason));
  return counts;
}

void detect(Program& program, const Arguments& a) {
  Job& job = program.job();
  calib::DetectOptions options{};
  if (!a.ink_key.empty()) options.ink_key = calib::ColorKey::load(a.ink_key, job);
  const calib::TargetDetector detector(calib::TargetSet::from_text(a.targets), options);
  std::vector<std::string> drawings;
  if (!a.draw.empty()) drawings = drawing_names(a.draw, a.photos);

  std::optional<calib::InkSamples> ink;
  if (!a.learn_ink_key.empty()) ink.emplace();
  std::vector<Seen> seen(a.photos.size());
  const auto look = [&](std::size_t i, Job& inner) {
    const Image photo = read_image(a.photos[i]);
    seen[i].of = {a.photos[i], photo.width(), photo.height(), detector.detect(photo, inner)};
    if (ink) ink->add(photo, detector.set(), seen[i].of.found);
    if (drawings.empty()) return;
    write_png(drawings[i], draw_detections(photo, detector.set(), seen[i].of.found, a.magnify));
    seen[i].drawing = drawings[i];
  };
  // Many photographs: a thread each. Few: all threads work on one of them.
  job.begin("detecting targets", a.photos.size());
  if (a.photos.size() >= job.threads()) {
    parallel_for(
        job, a.photos.size(),
        [&](std::size_t i) {
          Job inner({}, 1);
          look(i, inner);
        },
        true);
  } else {
    for (std::size_t i = 0; i < a.photos.size(); ++i) {
      job.check();
      look(i, job);
      job.advance();
    }
  }
  job.end();
  if (ink) {
    constexpr int kNeighbours = 7;
    ink->train(kNeighbours, job).save(a.learn_ink_key);
    program.say(a.learn_ink_key + ": a key of the ink, from " + std::to_string(ink->ink_pixels()) + " pixels");
  }

  std::size_t targets = 0, features = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Detections& found = seen[i].of.found;
    targets += found.targets.size();
    for (const Detection& d : found.targets) features += d.features.size();
    std::string line = a.photos[i] + ": " + std::to_string(found.targets.size()) + " targets";
    const auto counts = count_reasons(found);
    for (std::size_t k = 0; k < counts.size(); ++k)
      if (counts[k] > 0)
        line += "; refused as " + std::string(calib::refusal_names()[k]) + ": " + std::to_string(counts[k]);
    if (counts[std::size_t(calib::RefusedTarget::Reason::overexposed)] > 0)
      line += ": the paper is white beyond what the file holds, expose less";
    program.say(line);
  }
  program.say(std::to_string(targets) + " targets, " + std::to_string(features) + " points in " +
              std::to_string(seen.size()) + " photographs");
  if (!program.json) return;
  std::cout << "{\"targets\": " << targets << ", \"features\": " << features << ", \"photos\": [";
  for (std::size_t i = 0; i < seen.size(); ++i) {
    std::string one = detections_json(detector.set(), seen[i].of);
    if (!seen[i].drawing.empty()) one.replace(one.size() - 1, 1, ", \"drawing\": " + json_text(seen[i].drawing) + "}");
    std::cout << (i ? ",\n" : "\n") << one;
  }
  std::cout << "]}\n";
}

}  // namespace

void add_detect(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.verb("detect", "find printed targets in photographs and measure them",
                                [&program, a] { detect(program, *a); });
  verb->add_option("photos", a->photos, "photographs")->required();
  verb->add_option("--targets", a->targets,
                   "what was printed: a file that describes it, or words as matrix5x5:18mm, apriltag:36h11:50mm, "
                   "aruco:6x6_250:35mm, joined by commas")
      ->required();
  verb->add_option("--ink-key", a->ink_key, "a trained colour key: target ink against everything else");
  verb->add_option(
      "--learn-ink-key", a->learn_ink_key,
      "a file for such a key, learned from the targets that were found: for photographs in which other dark "
      "things disturb");
  verb->add_option("--draw", a->draw, "folder for the photographs with what was found drawn in");
  verb->add_option("--magnify", a->magnify, "how much larger residuals are drawn")->check(CLI::Range(0.0, 1e6));
}

}  // namespace lumihull::program
