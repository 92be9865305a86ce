// The chain from a photograph to its targets.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/detect_targets.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "circle_blobs.h"
#include "circle_lattice.h"
#include "circle_targets.h"
#include "grey_pyramid.h"
#include "square_targets.h"

namespace lumihull::calib {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

// Solid light circles that are this little lighter than their paper, over the ink's contrast, and less are not told
// from it.
constexpr double kLeastLightContrast = 0.15;

// Designs that are looked for on one plane of the photograph, with one pitch in radii of their circles.
struct Search {
  Vector3f weights{0, 0, 0};
  double pitch_in_radii = 4;
  bool solid_light = false;
  std::vector<int> designs;  // one a family
};

std::vector<Search> searches_of(const TargetSet& set) {
  std::vector<Search> searches;
  const auto add = [&](const Vector3f& weights, int design) {
    const TargetDesign& d = set.designs[std::size_t(design)];
    const double pitch = d.size_m / d.circle_radius_m();
    for (Search& s : searches) {
      if (weights.dot(s.weights) < 0.97f * weights.norm() * s.weights.norm()) continue;
      if (pitch > 1.1 * s.pitch_in_radii || s.pitch_in_radii > 1.1 * pitch) continue;
      if (s.solid_light != d.solid_light) continue;
      // Equal targets of several sizes look the same: the board tells them apart.
      const bool known = std::any_of(s.designs.begin(), s.designs.end(),
                                     [&](int other) { return set.designs[std::size_t(other)].family == d.family; });
      if (!known) s.designs.push_back(design);
      return;
    }
    searches.push_back({weights, pitch, d.solid_light, {design}});
  };
  for (int i = 0; i < int(set.designs.size()); ++i) {
    const TargetDesign& d = set.designs[std::size_t(i)];
    if (d.family.kind() != TargetKind::circles) continue;
    const Vector3f weights = circle_weights(d);
    add(weights, i);
    // The same pattern in black on white is not seen on a difference of channels.
    if (weights.sum() < 0.6f * weights.cwiseAbs().sum()) add(Vector3f(.25f, .5f, .25f), i);
  }
  return searches;
}

std::array<Vector2d, 4> outline(const TargetSet& set, const Detection& d) {
  const TargetDesign& design = set.designs[std::size_t(d.design)];
  const double half = 0.5 * design.family.grid() * design.size_m - 0.1 * design.size_m;
  std::array<Vector2d, 4> corners;
  for (int i = 0; i < 4; ++i)
    corners[std::size_t(i)] =
        (d.pixel_from_target * Eigen::Vector3d(i == 0 || i == 3 ? -half : half, i < 2 ? -half : half, 1)).hnormalized();
  return corners;
}

// Convex quadrilaterals: an edge of one of them separates them, or they overlap.
bool overlap(const std::array<Vector2d, 4>& a, const std::array<Vector2d, 4>& b) {
  for (const auto* q : {&a, &b})
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector2d edge = (*q)[(i + 1) % 4] - (*q)[i], normal(-edge.y(), edge.x());
      double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
      for (std::size_t k = 0; k < 4; ++k) {
        const double p[2] = {normal.dot(a[k]), normal.dot(b[k])};
        for (int s = 0; s < 2; ++s) low[s] = std::min(low[s], p[s]), high[s] = std::max(high[s], p[s]);
      }
      if (high[0] <= low[1] || high[1] <= low[0]) return false;
    }
  return true;
}

// An id stands once in a photograph, and a place holds one target. Of two that contradict each other a clean reading
// stands against a corrected one; else neither does.
void resolve(const TargetSet& set, std::vector<WindowResult>& results) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < results.size(); ++i)
    if (results[i].found) found.push_back(i);
  std::vector<std::array<Vector2d, 4>> outlines;
  for (const std::size_t i : found) outlines.push_back(outline(set, results[i].target));
  std::vector<bool> out(found.size(), false);
  for (std::size_t a = 0; a < found.size(); ++a)
    for (std::size_t b = a + 1; b < found.size(); ++b) {
      const Detection &p = results[found[a]].target, &q = results[found[b]].target;
      const bool same = p.design == q.design && p.id == q.id;
      if (!same && !overlap(outlines[a], outlines[b])) continue;
      const bool p_clean = p.corrected + p.erased == 0, q_clean = q.corrected + q.erased == 0;
      // The same target, found on two planes.
      if (same && (results[found[a]].refused.pixel - results[found[b]].refused.pixel).norm() <
                      0.1 * results[found[a]].refused.size_px) {
        out[p.features.size() >= q.features.size() ? b : a] = true;
        continue;
      }
      if (!p_clean || p_clean == q_clean) out[a] = true;
      if (!q_clean || p_clean == q_clean) out[b] = true;
    }
  for (std::size_t k = 0; k < found.size(); ++k)
    if (out[k]) {
      results[found[k]].found = false;
      results[found[k]].refused.reason = RefusedTarget::Reason::duplicate;
    }
}

}  // namespace

void DetectOptions::validate() const {
  const auto refuse = [](const char* message) {
    throw Error(ErrorCode::invalid_argument, message, "target detection");
  };
  if (!(min_circle_px >= 3 && min_circle_px < 1e5)) refuse("smallest circle: expected 3 px or more");
  if (!(correct >= 0 && correct <= 1)) refuse("correction: expected 0 to 1");
  ellipse.validate();
}

struct TargetDetector::Impl {
  TargetSet set;
  DetectOptions options;
  std::vector<Search> searches;
  SquareDetector squares;

  Impl(TargetSet s, DetectOptions o)
      : set(std::move(s)), options(std::move(o)), searches(searches_of(set)), squares(set) {}

  void find_circles(const Image& photo, Job& job, Detections& found) const;
};

TargetDetector::TargetDetector(TargetSet set, DetectOptions options) {
  set.validate();
  options.validate();
  for (const TargetDesign& d : set.designs)
    if (d.solid_light && look_of(d).light_contrast < kLeastLightContrast)
      throw Error(
          ErrorCode::unsupported,
          "light circles without rings are hardly lighter than their paper: print rings, or a darker paper colour",
          d.family.name());
  impl_ = std::make_unique<const Impl>(std::move(set), std::move(options));
}
TargetDetector::TargetDetector(TargetDetector&&) noexcept = default;
TargetDetector::~TargetDetector() = default;
const TargetSet& TargetDetector::set() const { return impl_->set; }

void TargetDetector::Impl::find_circles(const Image& photo, Job& job, Detections& found) const {
  Image storage;
  const Image& bytes = eight_bit(photo, storage);
  if (options.ink_key && bytes.channels() != 3)
    throw Error(ErrorCode::invalid_argument, "a key for ink needs a colour photograph (3 channels)",
                "target detection");
  std::vector<WindowResult> results;
  std::vector<Blob> blobs;
  GreyPyramid ink;
  LightPlane plane;
  for (std::size_t s = 0; s < searches.size(); ++s) {
    const Search& search = searches[s];
    if (s == 0 || search.weights != searches[s - 1].weights || search.solid_light != searches[s - 1].solid_light) {
      plane = {};
      const GreyPyramid grey = grey_pyramid(bytes, {search.weights[0], search.weights[1], search.weights[2]}, job);
      if (options.ink_key && s == 0) ink = key_pyramid(bytes, *options.ink_key, job);
      BlobOptions blob_options;
      blob_options.min_circle_px = options.min_circle_px;
      blob_options.both_kinds = search.solid_light;
      blobs = find_blobs(grey, options.ink_key ? &ink : nullptr, blob_options, job);
      if (search.solid_light) {
        const std::vector<Blob> light = find_blobs(negative(grey, job), nullptr, blob_options, job);
        blobs.insert(blobs.end(), light.begin(), light.end());
      }
    }
    int least = 1000;
    for (const int d : search.designs) least = std::min(least, set.designs[std::size_t(d)].family.grid());
    const std::vector<CircleLattice> lattices = find_lattices(blobs, search.pitch_in_radii, least);
    if (lattices.empty()) continue;
    if (plane.values.empty()) plane = light_plane(photo, search.weights, job);

    std::vector<std::vector<Window>> windows_of(lattices.size());
    parallel_for(job, lattices.size(), [&](std::size_t i) {
      windows_of[i] = find_windows(plane, blobs, lattices[i], set, search.designs, options.correct);
    });
    std::vector<const Window*> windows;
    for (const auto& list : windows_of)
      for (const Window& w : list) windows.push_back(&w);
    const std::size_t before = results.size();
    results.resize(before + windows.size());
    parallel_for(job, windows.size(),
                 [&](std::size_t i) { results[before + i] = read_window(plane, blobs, *windows[i], set, options); });
  }
  resolve(set, results);
  for (WindowResult& r : results) {
    if (r.found)
      found.targets.push_back(std::move(r.target));
    else
      found.refused.push_back(r.refused);
  }
}

Detections TargetDetector::detect(const Image& photo, Job& job) const {
  if (photo.empty()) throw Error(ErrorCode::invalid_argument, "the picture is empty", "target detection");
  Detections found;
  if (!impl_->searches.empty()) impl_->find_circles(photo, job, found);
  if (!impl_->squares.empty()) impl_->squares.detect(photo, impl_->options, job, found);
  std::stable_sort(found.targets.begin(), found.targets.end(), [](const Detection& a, const Detection& b) {
    return a.design != b.design ? a.design < b.design : a.id < b.id;
  });
  return found;
}

}  // namespace lumihull::calib
