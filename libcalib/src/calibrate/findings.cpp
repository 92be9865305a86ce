// What was left out and why, in words; and whether the whole can be trusted.
#include "findings.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <map>

#include "grow.h"
#include "settle.h"

namespace lumihull::calib::network {
namespace {

std::string formatted(const char* format, ...) __attribute__((format(printf, 1, 2)));
std::string formatted(const char* format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

/// Another body of the same design that stands where a detection was seen; -1: none.
int body_seen_instead(const Network& n, const Sighting& s, int part) {
  const CalibratedBody& body = n.bodies[std::size_t(s.body)];
  if (body.board >= 0) return -1;
  for (std::size_t o = 0; o < n.bodies.size(); ++o) {
    const CalibratedBody& other = n.bodies[o];
    if (int(o) == s.body || n.body_part[o] != part || other.design != body.design) continue;
    double sum = 0;
    int count = 0;
    bool behind = false;
    for (const std::uint32_t k : s.seen) {
      const auto pixel = n.camera_of(s.photo).project(*n.cam_from_world[std::size_t(s.photo)] *
                                                      other.body.point(std::size_t(n.seen[k].point), n.print_scale));
      if (!pixel) {
        behind = true;
        break;
      }
      sum += (*pixel - n.seen[k].pixel).squaredNorm();
      ++count;
    }
    if (!behind && count > 0 && std::sqrt(sum / count) < 0.15 * s.size_px + 1.5) return int(o);
  }
  return -1;
}

}  // namespace

void name_what_was_left_out(Network& n, int part) {
  for (const Sighting& s : n.sightings) {
    if (n.photo_part[std::size_t(s.photo)] != part || n.body_part[std::size_t(s.body)] != part) continue;
    std::map<int, std::vector<std::uint32_t>> detections;
    for (const std::uint32_t k : s.seen) detections[n.seen[k].detection].push_back(k);
    for (const auto& [detection, seen] : detections) {
      std::vector<double> off;
      std::size_t left_out = 0;
      for (const std::uint32_t k : seen) {
        left_out += !n.seen[k].counts;
        const auto error = error_of(n, n.seen[k]);
        off.push_back(error ? error->norm() : 0);
      }
      if (left_out == 0) continue;
      const auto& name = n.bodies[std::size_t(s.body)].features[std::size_t(n.seen[seen[0]].point)];
      Removed r;
      r.photo = s.photo, r.body = s.body, r.design = name.design, r.id = name.id;
      if (left_out == seen.size()) {
        std::nth_element(off.begin(), off.begin() + std::ptrdiff_t(off.size() / 2), off.end());
        r.kind = Removed::Kind::detection;
        r.off_px = off[off.size() / 2];
        const int other = body_seen_instead(n, s, part);
        const std::string what = photo_text(n, s.photo) + ": target " + std::to_string(name.id);
        if (other >= 0) {
          r.why = Removed::Why::wrong_id;
          r.text = what + " was misread: " + body_text(n, other) + " stands there";
        } else if (r.off_px > 0.15 * s.size_px + 1.5) {
          r.why = Removed::Why::wrong_id;
          r.text =
              what + formatted(" is %.0f px from where it should be: misread, or another one with this id", r.off_px);
        } else {
          r.why = Removed::Why::outlier;
          r.text = what + formatted(" is %.2f px off as a whole", r.off_px);
        }
        n.removed.push_back(std::move(r));
        continue;
      }
      for (std::size_t i = 0; i < seen.size(); ++i) {
        if (n.seen[seen[i]].counts) continue;
        r.kind = Removed::Kind::observation;
        r.why = Removed::Why::outlier;
        r.feature = n.bodies[std::size_t(s.body)].features[std::size_t(n.seen[seen[i]].point)].feature;
        r.off_px = off[i];
        r.text = photo_text(n, s.photo) + ": point " + std::to_string(r.feature) + " of target " +
                 std::to_string(name.id) + formatted(" is %.2f px off", r.off_px);
        n.removed.push_back(r);
      }
    }
  }
  for (std::size_t b = 0; b < n.bodies.size(); ++b) {
    if (n.body_part[b] >= 0 || n.by_body[b].empty()) continue;
    Removed r;
    r.kind = Removed::Kind::target;
    r.why = Removed::Why::too_few;
    r.body = int(b), r.design = n.bodies[b].design, r.id = n.bodies[b].id;
    r.text = body_text(n, int(b)) + " is seen in " + std::to_string(n.by_body[b].size()) +
             (n.by_body[b].size() == 1 ? " photograph" : " photographs") + " and could not be placed";
    n.removed.push_back(std::move(r));
  }
}

void name_unplaced_photos(Network& n, int part, std::vector<CalibratedPhoto>& photos) {
  for (std::size_t i = 0; i < photos.size(); ++i) {
    if (n.photo_part[i] == part) continue;
    const bool named = std::any_of(n.removed.begin(), n.removed.end(), [&](const Removed& r) {
      return r.kind == Removed::Kind::photo && r.photo == int(i);
    });
    if (named) {
      for (const Removed& r : n.removed)
        if (r.kind == Removed::Kind::photo && r.photo == int(i)) photos[i].reason = r.text;
      continue;
    }
    int placed = 0, all = 0;
    for (const int s : n.by_photo[i]) {
      ++all;
      placed += n.body_part[std::size_t(n.sightings[std::size_t(s)].body)] == part;
    }
    const std::string photo = photo_text(n, int(i));
    Removed::Why why = Removed::Why::too_few;
    std::string text;
    if (placed >= 2) {
      why = Removed::Why::other_scene;
      text = photo + " shows " + std::to_string(placed) +
             " targets of the model, but not as they lie to each other there: another scene, or they were moved";
    } else if (n.photo_part[i] >= 0) {
      why = Removed::Why::not_connected;
      text = photo + formatted(
                         " belongs to part %d: no chain of shared targets leads from there to the largest part; "
                         "take photographs that show targets of both",
                         n.photo_part[i]);
    } else if (all == 0) {
      text = photo + " shows no target that was found: more light, less blur, or nearer";
    } else if (placed == 1) {
      text = photo + " shows one target of the model, too small or too flat to say from where it is seen";
    } else {
      why = Removed::Why::not_connected;
      text = photo + " shares no target with the model; take photographs in between";
    }
    photos[i].reason = text;
    remove_photo(n, int(i), why, text);
  }
}

int check_bars(const CalibrateOptions& options, Calibration& c) {
  int contradict = 0;
  for (const ScaleBar& bar : options.bars) {
    const CalibratedBody &a = c.bodies[bar.body_a], &b = c.bodies[bar.body_b];
    if (!a.placed || !b.placed) {
      c.warnings.push_back("scale bar " + bar.name + ": " + (a.placed ? b.name : a.name) + " was not placed");
      continue;
    }
    const double length = (a.points[bar.point_a] - b.points[bar.point_b]).norm();
    if (!(std::abs(length - bar.length_m) > 3 * bar.sigma_m)) continue;
    ++contradict;
    c.warnings.push_back(
        "scale bar " + bar.name +
        formatted(": %.3f mm as given, %.3f mm as solved, %.1f standard deviations apart: it contradicts ",
                  1000 * bar.length_m, 1000 * length, std::abs(length - bar.length_m) / bar.sigma_m) +
        (options.free_print_scale ? "another bar"
                                  : "the targets' size, unless the print's scale is free, or another bar"));
  }
  return contradict;
}

void judge_calibration(Calibration& c, std::span<const PhotoTargets> photos, int contradicting_bars) {
  std::size_t placed = 0, few = 0;
  for (const CalibratedPhoto& p : c.photos) placed += p.part == 0;
  for (const CalibratedPhoto& p : c.photos) few += p.part == 0 && p.points < 8;
  std::vector<std::string> doubts;
  if (placed < photos.size())
    doubts.push_back(formatted("%zu of %zu photographs have no pose", photos.size() - placed, photos.size()));
  if (c.share < 0.95)
    doubts.push_back(formatted("%.1f %% of the observations had to be left out", 100 * (1 - c.share)));
  if (c.cross_validation_sigma > 3)
    doubts.push_back(
        formatted("two halves of the photographs differ by %.1f times what is expected", c.cross_validation_sigma));
  if (c.sigma0 > 3)
    doubts.push_back(formatted(
        "residuals are %.1f times what the measurements' noise explains: rough or bent paper, a print that is "
        "not to scale, or a lens that is not of this model; the uncertainties given are enlarged as much",
        c.sigma0));
  if (contradicting_bars > 0)
    doubts.push_back(formatted("%d of the scale bars can't be true together with the rest", contradicting_bars));
  if (few > 0) doubts.push_back(formatted("%zu photographs rest on fewer than eight points", few));
  if (c.rms_px > 1) doubts.push_back(formatted("the residuals are %.2f px", c.rms_px));
  for (std::size_t k = 0; k < c.cameras.size(); ++k) {
    const double sd = std::sqrt(std::max(0.0, c.camera_covariances[k](0, 0))) / c.cameras[k].f;
    if (sd > 0.005) {
      c.warnings.push_back(
          formatted("the focal length of camera %zu is uncertain by %.1f %%: photographs of tilted "
                    "targets, from near and from far, would settle it",
                    k, 100 * sd));
      doubts.push_back("the focal length is weak");
    }
  }
  for (const int times : {2, 1}) {
    std::string rare;
    int count = 0;
    for (const CalibratedBody& b : c.bodies)
      if (b.placed && b.photos == times && ++count <= 5) rare += (count > 1 ? ", " : "") + b.name;
    if (count > 0)
      c.warnings.push_back(std::string(times == 2 ? "seen only twice" : "seen only once") +
                           ": can't be checked, a misread number would not show: " + rare +
                           (count > 5 ? formatted(" and %d more", count - 5) : ""));
  }
  std::string figures = formatted("%zu of %zu photographs placed, %.3f px RMS over %.1f %% of the observations", placed,
                                  photos.size(), c.rms_px, 100 * c.share);
  if (c.cross_validation_m >= 0) figures += formatted(", halves agree to %.3f mm", 1000 * c.cross_validation_m);
  if (doubts.empty()) {
    c.verdict = "Good: " + figures + ".";
  } else {
    c.verdict = (placed * 2 < photos.size() || c.rms_px > 2 ? "Not good: " : "Usable with care: ") + figures + "; but ";
    for (std::size_t i = 0; i < doubts.size(); ++i) c.verdict += (i ? "; " : "") + doubts[i];
    c.verdict += ".";
  }
}

}  // namespace lumihull::calib::network
