// Squares in a photograph: from libapriltag's quadrangles to measured and checked targets.
#include "square_targets.h"

#include <lumihull/base/parallel.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "square_check.h"
#include "square_corners.h"
#include "square_quads.h"

namespace lumihull::calib {
namespace {

// A target is refused where its cells differ from what they should look like by more than this share of the contrast:
// all together (more for each module that the blur is wide), and any of them. Real prints: 0.04, at most 0.06, and 0.19.
constexpr double kMostRms = 0.09, kMostRmsBlurred = 0.1, kMostOff = 0.4;
constexpr double kLeastSide = 8;             // px
constexpr double kMostCornerDeviation = 0.5;  // px: a corner that is known no better than this is none

/// Curvature (1/px) that lenses give to straight lines in a picture of this size: k1 = 0.1 of a lens as long as the
/// picture is wide bends a line a quarter of the picture off its centre by 2 k1 (0.25) / width.
double curvature_sd(const Image& picture) { return 0.15 / std::max(picture.width(), picture.height()); }

/// How much smaller quadrangles are looked for in: pictures of up to 3 megapixels as they are, at most 6 megapixels.
double decimation(const Image& photo) {
  const double megapixels = 1e-6 * photo.width() * photo.height();
  return megapixels <= 3 ? 1 : std::max(2.0, std::ceil(std::sqrt(megapixels / 6)));
}

/// Edges that are blurred over many pixels are lost where tiles of a few pixels are judged: a second look, so much coarser.
constexpr double kCoarser = 4;

struct Candidate {
  SquareQuad quad;
  int design = -1;  ///< < 0: no board has this id
  double decimate = 1;
};

struct Answer {
  std::optional<Detection> target;
  RefusedTarget::Reason reason = RefusedTarget::Reason::no_code;
  Quad corners;
  double rms = 1;
};

double size_of(const Quad& c) { return 0.5 * ((c[2] - c[0]).norm() + (c[3] - c[1]).norm()); }
Eigen::Vector2d middle_of(const Quad& c) { return 0.25 * (c[0] + c[1] + c[2] + c[3]); }

Eigen::Vector3f linear(const Rgb& c) {
  return {linear_from_srgb(float(c[0]) / 255), linear_from_srgb(float(c[1]) / 255), linear_from_srgb(float(c[2]) / 255)};
}

Answer measure_candidate(const LightPlane& plane, const TargetSet& set, const Candidate& candidate,
                         const DetectOptions& options) {
  Answer answer;
  answer.corners = candidate.quad.corners;
  const TargetDesign& design = set.designs[std::size_t(candidate.design)];
  const int grid = design.family.grid();
  const double size = size_of(answer.corners), module = size / (std::sqrt(2.0) * grid);
  const Quad& rough = answer.corners;
  const double bend = curvature_sd(plane.values), sag = bend * size * size / 16;
  const double reach = std::max(1.5, std::min(0.7 * module, 1 + candidate.decimate + sag));
  auto first = measure_square(plane, rough, reach, grid, bend);
  answer.reason = RefusedTarget::Reason::homography;
  if (!first) return answer;
  const auto pixel_from_grid = homography_of_square(first->corners, grid);
  if (!pixel_from_grid || !(first->levels.light > first->levels.dark)) return answer;

  const std::vector<Cell> cells = design.family.cells(candidate.quad.id);
  SquareReading reading =
      read_square(plane, *pixel_from_grid, first->levels, first->blur_px, grid, cells);
  answer.reason = RefusedTarget::Reason::no_code;
  const double most_wrong = options.correct * correctable_cells(design.family);
  const double most_rms = kMostRms + kMostRmsBlurred * std::min(1.0, first->blur_px / module);
  if (reading.wrong > most_wrong || reading.rms > most_rms || reading.worst > kMostOff) return answer;

  const auto measured = options.refine ? measure_square_again(plane, *first, grid,
                                                              turned(cells, grid, reading.quarter_turns), bend)
                                       : first;
  answer.reason = RefusedTarget::Reason::homography;
  if (!measured) return answer;
  Detection d;
  d.design = candidate.design;
  d.id = candidate.quad.id;
  d.corrected = reading.wrong;
  std::array<Eigen::Vector2d, 4> places;
  Quad upright;
  for (int i = 0; i < 4; ++i) {
    const std::size_t k = std::size_t((i - reading.quarter_turns + 4) % 4);
    if (measured->covariance[k].trace() > 2 * kMostCornerDeviation * kMostCornerDeviation) return answer;
    Feature f;
    f.index = i;
    f.pixel = measured->corners[k];
    f.covariance = measured->covariance[k];
    upright[std::size_t(i)] = f.pixel;
    d.features.push_back(f);
  }
  const auto h = homography_of_square(upright, 1);
  if (!h) return answer;
  // The unit square from the target's plane: top left is feature 0, bottom right feature 2.
  const Eigen::Vector2d low = design.feature(0), extent = design.feature(2) - low;
  Eigen::Matrix3d unit;
  unit << 1 / extent.x(), 0, -low.x() / extent.x(), 0, 1 / extent.y(), -low.y() / extent.y(), 0, 0, 1;
  d.pixel_from_target = *h * unit;
  d.pixel_from_target /= d.pixel_from_target(2, 2);
  answer.corners = upright;
  answer.rms = reading.rms;
  answer.target = std::move(d);
  return answer;
}

bool overlap(const Quad& a, const Quad& b) {
  const double nearest = 0.5 * std::min(size_of(a), size_of(b));
  return (middle_of(a) - middle_of(b)).norm() < nearest;
}

}  // namespace

struct SquareDetector::Impl {
  TargetSet set;
  std::vector<std::string> families;       ///< of the finder
  std::vector<std::vector<int>> designs;   ///< by family: of that family, ascending
  std::set<std::pair<int, int>> on_boards;  ///< (design, id)
  std::vector<Eigen::Vector3f> weights;    ///< by design: of the colours that tell its ink from its paper
  std::optional<SquareFinder> finder;

  int design_of(const SquareQuad& quad) const {
    const auto& all = designs[std::size_t(quad.family)];
    if (set.boards.empty()) return all.front();
    for (const int design : all)
      if (on_boards.count({design, quad.id})) return design;
    return -1;
  }
};

SquareDetector::SquareDetector(const TargetSet& set) {
  auto impl = std::make_unique<Impl>();
  impl->set = set;
  std::vector<TargetFamily> families;
  for (std::size_t i = 0; i < set.designs.size(); ++i) {
    const TargetFamily& family = set.designs[i].family;
    impl->weights.push_back(contrast_weights(linear(set.designs[i].ink), linear(set.designs[i].paper)));
    if (family.kind() != TargetKind::square) continue;
    const auto known = std::find(families.begin(), families.end(), family);
    if (known == families.end()) families.push_back(family), impl->designs.emplace_back();
    impl->designs[std::size_t(std::find(families.begin(), families.end(), family) - families.begin())].push_back(int(i));
  }
  for (const Board& board : set.boards)
    for (const BoardTarget& t : board.targets) impl->on_boards.insert({t.design, t.id});
  if (!families.empty()) impl->finder.emplace(families);
  impl_ = std::move(impl);
}
SquareDetector::SquareDetector(SquareDetector&&) noexcept = default;
SquareDetector::~SquareDetector() = default;

bool SquareDetector::empty() const { return !impl_->finder; }

void SquareDetector::detect(const Image& photo, const DetectOptions& options, Job& job, Detections& found) const {
  if (empty() || photo.empty()) return;
  const bool grey_already = photo.type() == PixelType::u8 && photo.channels() == 1;
  const Image made = grey_already ? Image() : converted(photo, PixelType::u8, 1);
  const Image& grey = grey_already ? photo : made;
  std::vector<Candidate> candidates;
  for (const double decimate : {decimation(photo), kCoarser * decimation(photo)}) {
    job.check();
    for (const SquareQuad& quad : impl_->finder->find(grey, decimate)) {
      const Quad& c = quad.corners;
      const double side =
          std::min({(c[1] - c[0]).norm(), (c[2] - c[1]).norm(), (c[3] - c[2]).norm(), (c[0] - c[3]).norm()});
      const bool known = std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& other) {
        return other.decimate != decimate && other.quad.family == quad.family && other.quad.id == quad.id &&
               overlap(other.quad.corners, c);
      });
      if (side >= kLeastSide && !known) candidates.push_back({quad, impl_->design_of(quad), decimate});
    }
  }
  // Designs of the same colours share a plane.
  std::vector<std::pair<Eigen::Vector3f, LightPlane>> planes;
  const auto plane_of = [&](int design) -> const LightPlane& {
    const Eigen::Vector3f weights = impl_->weights[std::size_t(design)];
    return std::find_if(planes.begin(), planes.end(), [&](const auto& p) { return p.first == weights; })->second;
  };
  for (const Candidate& c : candidates) {
    if (c.design < 0) continue;
    const Eigen::Vector3f weights = impl_->weights[std::size_t(c.design)];
    if (std::none_of(planes.begin(), planes.end(), [&](const auto& p) { return p.first == weights; }))
      planes.emplace_back(weights, light_plane(photo, weights, job));
  }

  std::vector<Answer> answers(candidates.size());
  parallel_for(job, candidates.size(), [&](std::size_t i) {
    if (candidates[i].design >= 0)
      answers[i] = measure_candidate(plane_of(candidates[i].design), impl_->set, candidates[i], options);
    else
      answers[i].corners = candidates[i].quad.corners, answers[i].reason = RefusedTarget::Reason::unknown_id;
  });

  const auto refuse = [&](std::size_t i, RefusedTarget::Reason reason) {
    found.refused.push_back(
        {reason, middle_of(answers[i].corners), size_of(answers[i].corners) / std::sqrt(2.0), candidates[i].quad.id});
  };
  // What lies on the same place is one target, read by several families, or twice: the best of them stays. The same id at
  // different places says nothing: none of them is to be trusted.
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < answers.size(); ++i)
    if (answers[i].target)
      order.push_back(i);
    else
      refuse(i, answers[i].reason);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Detection &x = *answers[a].target, &y = *answers[b].target;
    return std::tuple(x.corrected, answers[a].rms, x.design, x.id) < std::tuple(y.corrected, answers[b].rms, y.design, y.id);
  });
  std::vector<std::size_t> kept;
  for (const std::size_t i : order) {
    const bool covered =
        std::any_of(kept.begin(), kept.end(), [&](std::size_t k) { return overlap(answers[k].corners, answers[i].corners); });
    if (covered)
      refuse(i, RefusedTarget::Reason::duplicate);
    else
      kept.push_back(i);
  }
  std::map<std::pair<int, int>, int> times;
  for (const std::size_t i : kept) ++times[{answers[i].target->design, answers[i].target->id}];
  const std::size_t begin = found.targets.size();
  for (const std::size_t i : kept)
    if (times[{answers[i].target->design, answers[i].target->id}] > 1)
      refuse(i, RefusedTarget::Reason::duplicate);
    else
      found.targets.push_back(std::move(*answers[i].target));
  std::sort(found.targets.begin() + std::ptrdiff_t(begin), found.targets.end(),
            [](const Detection& a, const Detection& b) { return std::pair(a.design, a.id) < std::pair(b.design, b.id); });
}

void detect_squares(const Image& photo, const TargetSet& set, const DetectOptions& options, Job& job, Detections& found) {
  SquareDetector(set).detect(photo, options, job, found);
}

}  // namespace lumihull::calib
