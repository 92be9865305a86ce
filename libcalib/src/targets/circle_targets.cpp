// Circle targets: from places of a lattice to ids and measured features.
#include "circle_targets.h"

#include <lumihull/base/error.h>
#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/resect.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "ellipse_starts.h"

namespace lumihull::calib {

namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// How far a cell of a code without check bits may be from what a disc or a ring shows, as a share of the difference:
/// what hides a part of one may make it look like the other.
constexpr double kWorstUnchecked = 0.28;

Eigen::Vector3f linear_color(const Rgb& c) {
  return {linear_from_srgb(float(c[0]) / 255), linear_from_srgb(float(c[1]) / 255),
          linear_from_srgb(float(c[2]) / 255)};
}

// A design's grid before its orientation is known: without the print's scale.
std::vector<Vector2d> plane_points(int grid, double pitch) {
  std::vector<Vector2d> points;
  for (int i = 0; i < grid * grid; ++i)
    points.emplace_back((i % grid - 0.5 * (grid - 1)) * pitch, (i / grid - 0.5 * (grid - 1)) * pitch);
  return points;
}

// The ellipse that a circle of the plane is seen as.
std::optional<Ellipse> seen_circle(const Matrix3d& pixel_from_plane, const Vector2d& center, double radius) {
  const Vector3d c(center.x(), center.y(), 1);
  Matrix3d b = c * c.transpose();
  b(0, 0) -= radius * radius;
  b(1, 1) -= radius * radius;
  Matrix3d dual = pixel_from_plane * b * pixel_from_plane.transpose();
  if (!(std::abs(dual(2, 2)) > 0)) return std::nullopt;
  dual /= dual(2, 2);
  return Ellipse::from_dual_conic(dual);
}

// Ellipses of a whole lattice: of its blobs, and where there is none, from the neighbours' mean.
void lattice_circles(std::span<const Blob> blobs, const CircleLattice& lattice, std::vector<Ellipse>& circles,
                     std::vector<EllipseState>& states) {
  const std::size_t n = lattice.blob.size();
  circles.assign(n, {});
  states.assign(n, EllipseState::no_fit);
  for (std::size_t i = 0; i < n; ++i)
    if (lattice.blob[i] >= 0) {
      circles[i] = ellipse_of(blobs[std::size_t(lattice.blob[i])]);
      states[i] = EllipseState::good;
    }
  for (int y = 0; y < lattice.rows; ++y)
    for (int x = 0; x < lattice.columns; ++x) {
      if (lattice.at(x, y) >= 0) continue;
      // Straight on from two that are found, in the four directions; or between two.
      Vector2d sum(0, 0);
      int count = 0;
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
        const int near = lattice.at(x + dx, y + dy), far = lattice.at(x + 2 * dx, y + 2 * dy);
        const int across = lattice.at(x - dx, y - dy);
        Ellipse& e = circles[std::size_t(y * lattice.columns + x)];
        if (near >= 0 && across >= 0)
          sum += 0.5 * (blobs[std::size_t(near)].center + blobs[std::size_t(across)].center), ++count;
        else if (near >= 0 && far >= 0)
          sum += 2 * blobs[std::size_t(near)].center - blobs[std::size_t(far)].center, ++count;
        if (near >= 0) e = ellipse_of(blobs[std::size_t(near)]);
      }
      Ellipse& e = circles[std::size_t(y * lattice.columns + x)];
      e.center = count > 0 ? Vector2d(sum / count) : Vector2d(-1e6, -1e6);
      if (!(e.a > 0)) e.a = e.b = 1;
    }
}

// What was measured of a window's circles.
struct Contours {
  std::vector<EllipseFit> fits;  // of states that are not asked for: no_fit
  int good = 0;
};

// Whether a contour can be the one that was meant.
bool can_be(const EllipseFit& fit, const Ellipse& guess) {
  const Ellipse& e = fit.ellipse;
  return (e.center - guess.center).norm() <= 0.3 * guess.b + 0.7 && e.a * e.b <= 2 * guess.a * guess.b &&
         2.5 * e.a * e.b >= guess.a * guess.b;
}

// Measures the circles whose state is good; predicted: where the others say that they are; inner_offsets: of a ring's
// inner contour's centre, should it be one. A spot may be larger than
// its circle, where the threshold is close to the paper.
Contours measure(const LightPlane& plane, std::span<const Ellipse> circles,
                 std::span<const std::optional<Ellipse>> predicted, std::span<const Vector2d> inner_offsets,
                 std::span<const EllipseState> states, const CellReading& first, const CircleLook& look,
                 const DetectOptions& options) {
  Contours contours;
  contours.fits.resize(circles.size());
  const double blur = std::sqrt(std::max(0.0, first.blur_px * first.blur_px - 1.0 / 12));  // without the pixel's
  for (std::size_t i = 0; i < circles.size(); ++i) {
    if (states[i] != EllipseState::good) continue;
    const Ellipse& guess = circles[i];
    EllipseOptions fit_options = options.ellipse;
    fit_options.inner_ratio = first.cells[i] == Cell::light && !look.solid_light ? look.ring_ratio : 0;
    fit_options.inner_offset = inner_offsets[i];
    EllipseFit& fit = contours.fits[i];
    fit = options.refine ? fit_ellipse(plane, guess, fit_options, blur) : dual_conic_fit(plane, guess, fit_options);
    if (fit.state != EllipseState::good) continue;
    const bool meant = can_be(fit, guess) || (predicted[i] && can_be(fit, *predicted[i]));
    const bool lighter = look.solid_light && first.cells[i] == Cell::light;
    if (!meant || (lighter ? fit.outside >= fit.inside : fit.outside <= fit.inside)) {
      fit.state = EllipseState::no_fit;
      continue;
    }
    ++contours.good;
  }
  return contours;
}

struct Try {
  Window window;
  int x = 0, y = 0, grid = 0;
  int doubts = 0;  // cells missing, corrected, unread
};

}  // namespace

Eigen::Vector3f circle_weights(const TargetDesign& design) {
  return contrast_weights(linear_color(design.ink),
                          design.solid_light ? Eigen::Vector3f(1, 1, 1) : linear_color(design.paper));
}

CircleLook look_of(const TargetDesign& design) {
  CircleLook look{design.ring_radius_m() / design.circle_radius_m(), design.solid_light};
  if (!design.solid_light) return look;
  const Eigen::Vector3f weights = circle_weights(design), paper = linear_color(design.paper);
  look.light_contrast = double(weights.dot(Eigen::Vector3f(1, 1, 1) - paper)) /
                        std::max(1e-6, double(weights.dot(paper - linear_color(design.ink))));
  return look;
}

Ellipse ellipse_of(const Blob& blob) {
  Ellipse e;
  e.center = blob.center;
  e.a = blob.a, e.b = blob.b;
  e.angle = 0.5 * std::atan2(2 * blob.shape(0, 1), blob.shape(0, 0) - blob.shape(1, 1));
  return e;
}

Matrix3d circle_homography(std::span<const Vector2d> plane, double radius, std::span<const Vector2d> pixels) {
  Matrix3d h = find_homography(plane, pixels);
  std::vector<Vector2d> centers(pixels.size());
  for (int round = 0; round < 3; ++round) {
    // The sign of a homography is free; the predictions need the plane in front.
    if ((h * Vector3d(plane[0].x(), plane[0].y(), 1)).z() < 0) h = -h;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Vector2d offset =
          homography_circle_center(h, plane[i], radius) - (h * Vector3d(plane[i].x(), plane[i].y(), 1)).hnormalized();
      centers[i] = pixels[i] - (offset.allFinite() ? offset : Vector2d(0, 0));
    }
    h = find_homography(plane, centers);
  }
  return (h * Vector3d(plane[0].x(), plane[0].y(), 1)).z() < 0 ? Matrix3d(-h) : h;
}

std::vector<Window> find_windows(const LightPlane& plane, std::span<const Blob> blobs, const CircleLattice& lattice,
                                 const TargetSet& set, std::span<const int> designs, double strength) {
  std::vector<Ellipse> circles;
  std::vector<EllipseState> states;
  std::vector<Try> tries;
  CellReading reading;
  for (const int d : designs) {
    const TargetDesign& design = set.designs[std::size_t(d)];
    const int grid = design.family.grid();
    if (lattice.columns < grid || lattice.rows < grid) continue;
    if (circles.empty()) {
      lattice_circles(blobs, lattice, circles, states);
      reading = read_cells(plane, circles, states, lattice.columns, int(0.3 * double(circles.size())), look_of(design));
    }
    const bool exact = lattice.columns == grid && lattice.rows == grid;
    for (int y0 = 0; y0 + grid <= lattice.rows; ++y0)
      for (int x0 = 0; x0 + grid <= lattice.columns; ++x0) {
        Try t{{d, {}}, x0, y0, grid, 0};
        std::vector<Cell> cells;
        std::vector<int> in_row(std::size_t(grid), 0), in_column(std::size_t(grid), 0);
        for (int y = 0; y < grid; ++y)
          for (int x = 0; x < grid; ++x) {
            const std::size_t i = std::size_t((y0 + y) * lattice.columns + x0 + x);
            t.window.blob.push_back(lattice.blob[i]);
            cells.push_back(reading.cells[i]);
            if (lattice.blob[i] < 0) ++t.doubts;
            if (lattice.blob[i] >= 0) ++in_row[std::size_t(y)], ++in_column[std::size_t(x)];
          }
        // Without two circles in each line at its border it may as well be a place further on.
        const std::size_t last = std::size_t(grid - 1);
        if (std::min({in_row[0], in_row[last], in_column[0], in_column[last]}) < 2) continue;
        if (t.doubts * 10 > 4 * grid * grid) continue;
        const auto decoded = design.family.decode(cells, strength);
        if (decoded) t.doubts += 2 * decoded->corrected + decoded->erased;
        // A lattice that is just large enough gets its chance after measuring.
        if (!decoded && !exact) continue;
        if (!decoded) t.doubts += grid * grid;
        tries.push_back(std::move(t));
      }
  }
  std::stable_sort(tries.begin(), tries.end(), [](const Try& a, const Try& b) { return a.doubts < b.doubts; });

  // The best ones that don't share places; then those go that have neighbours which are nobody's.
  std::vector<Try> kept;
  for (Try& t : tries) {
    const bool overlaps = std::any_of(kept.begin(), kept.end(), [&](const Try& k) {
      return t.x < k.x + k.grid && k.x < t.x + t.grid && t.y < k.y + k.grid && k.y < t.y + t.grid;
    });
    if (!overlaps) kept.push_back(std::move(t));
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < kept.size() && !changed; ++i) {
      const Try& t = kept[i];
      int strangers = 0;
      const auto look = [&](int x, int y) {
        if (lattice.at(x, y) < 0) return;
        const bool owned = std::any_of(kept.begin(), kept.end(), [&](const Try& k) {
          return x >= k.x && y >= k.y && x < k.x + k.grid && y < k.y + k.grid;
        });
        if (!owned) ++strangers;
      };
      for (int k = 0; k < t.grid; ++k)
        look(t.x + k, t.y - 1), look(t.x + k, t.y + t.grid), look(t.x - 1, t.y + k), look(t.x + t.grid, t.y + k);
      if (2 * strangers > t.grid) {
        kept.erase(kept.begin() + std::ptrdiff_t(i));
        changed = true;
      }
    }
  }
  std::vector<Window> windows;
  for (Try& t : kept) windows.push_back(std::move(t.window));
  return windows;
}

WindowResult read_window(const LightPlane& plane, std::span<const Blob> blobs, const Window& window,
                         const TargetSet& set, const DetectOptions& options) {
  const TargetDesign& design = set.designs[std::size_t(window.first_design)];
  const int grid = design.family.grid();
  const std::size_t n = window.blob.size();
  const double radius = design.circle_radius_m();
  const std::vector<Vector2d> points = plane_points(grid, design.size_m);
  const bool checked = design.family.name() != "paper4x4";
  WindowResult result;

  std::vector<Vector2d> from, to;
  std::vector<double> minors;
  for (std::size_t i = 0; i < n; ++i) {
    if (window.blob[i] < 0) continue;
    const Blob& b = blobs[std::size_t(window.blob[i])];
    from.push_back(points[i]);
    to.push_back(b.center);
    minors.push_back(b.b);
  }
  std::nth_element(minors.begin(), minors.begin() + std::ptrdiff_t(minors.size() / 2), minors.end());
  // The pitch where it is seen shortest, px.
  const double pitch_px = minors[minors.size() / 2] * design.size_m / radius;
  for (const Vector2d& p : to) result.refused.pixel += p / double(to.size());
  result.refused.size_px = pitch_px * grid;
  const auto refuse = [&](RefusedTarget::Reason reason) {
    result.refused.reason = reason;
    return result;
  };
  const auto rms_about = [&](const Matrix3d& h, const std::vector<Vector2d>& plane_points_, double r,
                             const std::vector<Vector2d>& pixels, std::vector<double>* each = nullptr) {
    double sum = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double d2 = (homography_circle_center(h, plane_points_[i], r) - pixels[i]).squaredNorm();
      sum += d2;
      if (each) each->push_back(std::sqrt(d2));
    }
    return std::sqrt(sum / double(pixels.size()));
  };

  Matrix3d h;
  try {
    h = circle_homography(from, radius, to);
  } catch (const Error&) {
    return refuse(RefusedTarget::Reason::homography);
  }
  // Seen from the front, a right-handed grid stays right-handed.
  if (!(rms_about(h, from, radius, to) < 0.06 * pitch_px + 0.5) || !(h.determinant() > 0))
    return refuse(RefusedTarget::Reason::homography);

  // Measure; a first reading says which circles are rings.
  std::vector<Ellipse> circles(n);
  std::vector<std::optional<Ellipse>> predicted(n);
  std::vector<Vector2d> inner_offsets(n, Vector2d(0, 0));
  std::vector<EllipseState> states(n, EllipseState::no_fit);
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d offset =
        homography_circle_center(h, points[i], design.ring_radius_m()) - homography_circle_center(h, points[i], radius);
    if (offset.allFinite()) inner_offsets[i] = offset;
    predicted[i] = seen_circle(h, points[i], radius);
    if (window.blob[i] >= 0)
      circles[i] = ellipse_of(blobs[std::size_t(window.blob[i])]);
    else if (predicted[i])
      circles[i] = *predicted[i];
    else
      continue;
    states[i] = EllipseState::good;
  }
  const CircleLook look = look_of(design);
  const CellReading first = read_cells(plane, circles, states, grid, 2 * grid - 1, look);
  const Contours contours = measure(plane, circles, predicted, inner_offsets, states, first, look, options);
  const std::vector<EllipseFit>& fits = contours.fits;
  const int good = contours.good;
  std::vector<EllipseState> readable(n);
  for (std::size_t i = 0; i < n; ++i) {
    states[i] = fits[i].state;
    if (states[i] == EllipseState::good) circles[i] = fits[i].ellipse;
    // A spot with an ellipse's outline can be read even where its contour can't be measured well.
    readable[i] = window.blob[i] >= 0 && (states[i] == EllipseState::no_fit || states[i] == EllipseState::occluded ||
                                          states[i] == EllipseState::saturated)
                      ? EllipseState::good
                      : states[i];
  }
  const auto clipped = std::count(states.begin(), states.end(), EllipseState::saturated);
  const auto too_few =
      2 * clipped > int(n) - good ? RefusedTarget::Reason::overexposed : RefusedTarget::Reason::too_few_features;
  if (good < 6 || good * 5 < 3 * int(n)) return refuse(too_few);

  // Read.
  const CellReading reading = read_cells(plane, circles, readable, grid, 2 * grid - 1, look);
  const std::optional<DecodedTarget> decoded = design.family.decode(reading.cells, options.correct);
  if (!decoded) return refuse(RefusedTarget::Reason::no_code);
  result.refused.id = decoded->id;
  // Where this circle of the window stands in an upright target.
  const auto upright = [&](std::size_t i) {
    int row = int(i) / grid, column = int(i) % grid;
    for (int q = 0; q < decoded->quarter_turns; ++q) {
      const int r = row;
      row = column, column = grid - 1 - r;
    }
    return row * grid + column;
  };
  // A perforated sheet that lacks some holes is dark wherever it can be read: most light circles must have been seen.
  const std::vector<Cell> printed_cells = design.family.cells(decoded->id);
  int light_seen = 0, light_missed = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (printed_cells[std::size_t(upright(i))] == Cell::light)
      ++(reading.cells[i] == Cell::light ? light_seen : light_missed);
  if (light_seen <= light_missed) return refuse(RefusedTarget::Reason::no_code);

  // The board that has this id says which of several designs of the family it is.
  int design_index = -1;
  if (set.boards.empty()) {
    design_index = window.first_design;
  } else {
    for (const Board& board : set.boards)
      for (const BoardTarget& t : board.targets) {
        const TargetDesign& other = set.designs[std::size_t(t.design)];
        const double ratio = other.size_m / other.circle_radius_m() * radius / design.size_m;
        if (t.id == decoded->id && other.family == design.family && ratio > 0.9 && ratio < 1.1 &&
            (design_index < 0 || t.design < design_index))
          design_index = t.design;
      }
    if (design_index < 0) return refuse(RefusedTarget::Reason::unknown_id);
  }
  const TargetDesign& printed = set.designs[std::size_t(design_index)];

  Detection& target = result.target;
  target.design = design_index;
  target.id = decoded->id;
  target.corrected = decoded->corrected;
  target.erased = decoded->erased;
  std::vector<Feature> features;
  for (std::size_t i = 0; i < n; ++i) {
    if (states[i] != EllipseState::good) continue;
    Feature f;
    f.index = upright(i);
    f.pixel = fits[i].ellipse.center;
    f.covariance = fits[i].center_covariance();
    f.dual_conic = fits[i].ellipse.dual_conic();
    features.push_back(f);
  }
  std::sort(features.begin(), features.end(), [](const Feature& a, const Feature& b) { return a.index < b.index; });

  // Without check bits a circle that was read and not measured has to be a whole one where it belongs: a thing that
  // covers a part of it would be read instead.
  const auto all_in_place = [&](const Matrix3d& pixel_from_plane, const std::vector<Feature>& measured) {
    for (std::size_t i = 0; i < n; ++i) {
      const int index = upright(i);
      if (std::any_of(measured.begin(), measured.end(), [&](const Feature& f) { return f.index == index; })) continue;
      const std::optional<Ellipse> expected =
          seen_circle(pixel_from_plane, printed.feature(index), printed.circle_radius_m());
      if (!expected || window.blob[i] < 0) return false;
      const Ellipse seen = ellipse_of(blobs[std::size_t(window.blob[i])]);
      const auto about = [](double axis, double other) { return std::abs(axis - other) < 0.15 * other + 0.6; };
      if (!((seen.center - expected->center).norm() < 0.1 * expected->b + 0.3) || !about(seen.a, expected->a) ||
          !about(seen.b, expected->b))
        return false;
    }
    return true;
  };

  // Features that don't keep to the plane by far (a disturbed contour) go; what is smooth, distortion, stays.
  for (int round = 0; round < 3; ++round) {
    from.clear(), to.clear();
    for (const Feature& f : features) {
      from.push_back(printed.feature(f.index));
      to.push_back(f.pixel);
    }
    try {
      h = circle_homography(from, printed.circle_radius_m(), to);
    } catch (const Error&) {
      return refuse(RefusedTarget::Reason::homography);
    }
    std::vector<double> each;
    target.rms_px = rms_about(h, from, printed.circle_radius_m(), to, &each);
    std::vector<double> sorted = each;
    std::nth_element(sorted.begin(), sorted.begin() + std::ptrdiff_t(sorted.size() / 2), sorted.end());
    const double limit = 5 * sorted[sorted.size() / 2] + 0.01 * pitch_px + 0.05;
    std::vector<Feature> kept;
    for (std::size_t i = 0; i < features.size(); ++i)
      if (each[i] <= limit) kept.push_back(features[i]);
    if (kept.size() == features.size()) break;
    features = std::move(kept);
    if (features.size() * 5 < 3 * n) return refuse(too_few);
  }
  // Smooth distortion leaves an error that grows with the target; without check bits there is less to give away.
  if (!(target.rms_px < (checked ? 0.035 : 0.02) * pitch_px + 0.1)) return refuse(RefusedTarget::Reason::homography);
  if (!checked && !(features.size() * 4 >= 3 * n && all_in_place(h, features)))
    return refuse(RefusedTarget::Reason::too_few_features);
  if (!checked && (reading.dark_spread > 0.15 || reading.worst > kWorstUnchecked))
    return refuse(RefusedTarget::Reason::no_code);
  target.pixel_from_target = h / h.norm();
  target.features = std::move(features);
  result.found = true;
  return result;
}

}  // namespace lumihull::calib
