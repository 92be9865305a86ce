// The pose of one photograph: a start from all matches, least squares; where they do not agree, a search from minimal
// samples, a robust loss, and least squares on those that agree.
#include <lumihull/base/error.h>
#include <lumihull/calib/resect.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "lens/linear_pose.h"
#include "lens/pose_fit.h"
#include "lens/pose_search.h"

namespace lumihull::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

[[noreturn]] void degenerate(const char* message) { throw Error(ErrorCode::degenerate, message, "resect"); }

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Points nearer to a plane than this (RMS over their extent) start as a plane; up to the other, a plane's second tilt
/// is tried too.
constexpr double kFlat = 0.02, kNearlyFlat = 0.2;
/// Matches agree if their residuals' scale is below this share of the picture that they cover.
constexpr double kAgreement = 0.02;
/// Residuals that are larger than their covariances say by this factor may be those of many wrong matches.
constexpr double kSuspicious = 3;
/// Twice the logarithm of the odds beyond which another pose is not mentioned.
constexpr double kRefuted = 25;
/// log10 of the number of false alarms below which matches agree by more than chance.
constexpr double kCertain = -3;

double angle_between(const LocalPose& a, const LocalPose& b) {
  return Eigen::AngleAxisd(Matrix3d(a.rotation.transpose() * b.rotation)).angle();
}

/// A fit to some of the matches.
struct Selection {
  PoseFit fit;
  std::vector<double> weights;  ///< 1 for those that count, whole blocks
  int count = 0;
  double scale = 1;  ///< robust, of their residuals in standard deviations
};

class Resecting {
 public:
  Resecting(const Camera& camera, std::span<const PointMatch> matches, const ResectOptions& options)
      : options_(options), matches_(matches), points_(camera, matches), robust_(options.robust && matches.size() >= 5) {
    for (const double s : points_.seen) seen_ += s > 0;
    for (const PointMatch& m : matches) sigma_px_ += m.covariance.trace() / 2;
    sigma_px_ = std::sqrt(sigma_px_ / double(matches.size()));
    if (seen_ < (robust_ ? 4 : int(matches.size())))
      throw Error(ErrorCode::degenerate, "pixels lie beyond the domain of the lens model: no ray leads there",
                  "resect");
  }

  Resection run() {
    Selection best;
    if (!from_all(best) && !from_samples(best) && fallback_) best = std::move(*fallback_), renew_ = true;
    if (best.count == 0) {
      if (reflected_)
        degenerate(
            "the points lie behind the camera, or the world is mirrored: expected a right-handed world, z forward");
      degenerate(robust_ ? "no pose agrees with more matches than chance would"
                         : "no pose has all points in front of the camera where they were seen");
    }
    other_tilt(best);
    return result(best);
  }

 private:
  double limit_of(double scale) const { return options_.outlier_sigma * scale; }

  /// From the median of d² (2 ln 2 for a unit normal in two dimensions), with Rousseeuw & Leroy's (1987) correction for
  /// few points; never below what rounding leaves.
  double scale_of(const std::vector<double>& weights) {
    ordered_.clear();
    for (std::size_t i = 0; i < points_.count; ++i)
      if (weights[i] > 0) ordered_.push_back(d2_[i]);
    if (ordered_.empty()) return kInfinity;
    const auto middle = ordered_.begin() + std::ptrdiff_t(ordered_.size() / 2);
    std::nth_element(ordered_.begin(), middle, ordered_.end());
    const double freedom = std::max(1.0, 2.0 * double(ordered_.size()) - 6);
    return std::max(std::sqrt(*middle / 1.3863) * (1 + 5 / freedom), 1e-6 / sigma_px_);
  }

  int select(double scale, std::vector<double>& weights) const {
    int count = 0;
    for (std::size_t i = 0; i < points_.count; ++i) {
      weights[i] = points_.seen[i] > 0 && d2_[i] <= limit_of(scale) * limit_of(scale);
      count += weights[i] > 0;
    }
    return count;
  }

  /// Least squares over all matches from the linear start; with robust, those that don't fit are left out as long as
  /// they are few. true if the answer can be trusted.
  bool from_all(Selection& answer) {
    Selection s;
    s.weights = points_.seen;
    s.count = seen_;
    std::array<LocalPose, 2> starts;
    int count = 0;
    if (points_.extent[2] < kFlat * points_.extent[0])
      count = planar_poses(points_, starts);
    else
      count = linear_pose(points_, starts[0], reflected_) && !reflected_;
    double cost = kInfinity;
    for (int i = 0; i < count; ++i) {
      const NormalEquations at = normal_equations(points_, starts[std::size_t(i)], s.weights, 0);
      if (at.cost < cost) cost = at.cost, s.fit.pose = starts[std::size_t(i)];
    }
    if (!(cost < kInfinity)) return false;
    minimise(points_, s.weights, 0, options_.max_iterations, true, s.fit);
    squared_distances(points_, s.fit.pose, d2_);
    s.scale = scale_of(s.weights);
    if (!agrees(s)) return false;
    if (!robust_) return answer = std::move(s), true;
    fallback_ = s;
    if (s.scale > kSuspicious * (1 + 5 / std::max(1.0, 2.0 * s.count - 6))) return false;
    std::vector<double> weights(s.weights.size(), 0);
    if (select(s.scale, weights) == s.count) return answer = std::move(s), true;
    Selection robust = s;
    return settle(robust, s.scale) && robust.count >= 0.85 * double(matches_.size()) && agrees(robust) &&
           log_false_alarms(robust) < kCertain && (answer = std::move(robust), true);
  }

  /// Residuals are small beside the picture, or as small as their covariances say (with few points the scale has a
  /// factor for its uncertainty).
  bool agrees(const Selection& s) const {
    return s.scale * sigma_px_ <= kAgreement * points_.spread_px ||
           s.scale <= 2 * (1 + 5 / std::max(1.0, 2.0 * s.count - 6));
  }

  /// Robust loss from a pose near the answer, then least squares on the matches that agree until they stay the same.
  bool settle(Selection& s, double scale) {
    squared_distances(points_, s.fit.pose, d2_);
    s.weights.assign(points_.seen.size(), 0);
    if (select(scale, s.weights) < 4) return false;
    s.scale = std::min(scale, scale_of(s.weights));
    for (int round = 0; round < 6; ++round) {
      minimise(points_, points_.seen, 2 * s.scale, options_.max_iterations, true, s.fit);
      squared_distances(points_, s.fit.pose, d2_);
      if (select(s.scale, s.weights) < 4) return false;
      const double before = std::exchange(s.scale, scale_of(s.weights));
      if (std::abs(s.scale - before) <= 1e-3 * before) break;
    }
    std::vector<double> before;
    for (int round = 0; round < 12; ++round) {
      s.count = select(s.scale, s.weights);
      if (s.count < 4) return false;
      if (s.weights == before) break;
      minimise(points_, s.weights, 0, options_.max_iterations, true, s.fit);
      squared_distances(points_, s.fit.pose, d2_);
      // From all their residuals: less uncertain than a median, which has done its work.
      const double freedom = 2.0 * s.count - 6;
      s.scale = std::max(std::sqrt(s.fit.at.cost / freedom) * (1 + 5 / freedom), 1e-6 / sigma_px_);
      before = s.weights;
    }
    return std::isfinite(s.fit.at.cost);
  }

  /// log10 of how many poses from samples would meet as many matches by chance (Moisan & Stival 2004).
  double log_false_alarms(const Selection& s) const {
    const double n = double(matches_.size()), k = s.count - 3;
    const auto choose = [](double a, double b) {
      return std::lgamma(a + 1) - std::lgamma(b + 1) - std::lgamma(a - b + 1);
    };
    const double share = std::min(1.0, std::pow(limit_of(s.scale) * sigma_px_ / (2 * points_.spread_px), 2));
    return (std::log(4.0) + choose(n, 3) + choose(n - 3, k) + k * std::log(share)) / std::log(10.0);
  }

  bool from_samples(Selection& best) {
    for (auto& b : points_.blocks) b.ex.setZero(), b.ey.setZero();
    // What the lens does to ellipses is not yet known.
    const double slack_px = points_.circles && !points_.lens.empty() ? 0.3 : 0;
    const double least = std::hypot(1.0, slack_px / sigma_px_ / options_.outlier_sigma);
    const double most = std::max(kAgreement * points_.spread_px / sigma_px_, 1.0);
    bool found = false;
    for (double scale = std::min(least, most); scale <= most; scale *= 5) {
      const auto candidates = search_pose(points_, limit_of(scale), options_.seed, matches_.size() <= 7 ? 4 : 2);
      for (const PoseCandidate& candidate : candidates) {
        Selection s;
        s.fit.pose = candidate.pose;
        bool good = robust_ ? settle(s, scale) : all_from(s);
        // Few matches: leaving one out is no better than chance, but all of them may agree.
        if (!good || (s.count < int(matches_.size()) && log_false_alarms(s) > kCertain)) {
          // Few matches: leaving one out is no better than chance, but all of them may agree.
          s.fit.pose = candidate.pose;
          good = matches_.size() <= 7 && seen_ == int(matches_.size()) && all_from(s);
        }
        if (!good || !s.fit.regular) continue;
        if (!agrees(s)) continue;
        const bool same_matches = found && s.weights == best.weights;
        const bool better =
            !found || (same_matches ? s.fit.at.cost < best.fit.at.cost
                                    : s.count > 1.3 * best.count || (s.count >= best.count && s.scale < best.scale));
        if (same_matches && angle_between(s.fit.pose, best.fit.pose) > 0.01)
          runner_up_ = better ? best.fit.pose : s.fit.pose;
        if (better) best = std::move(s), found = true;
        renew_ = true;
      }
      if (found && best.count >= 0.5 * double(matches_.size())) break;
    }
    return found;
  }

  bool all_from(Selection& s) {
    s.weights = points_.seen;
    s.count = seen_;
    minimise(points_, s.weights, 0, options_.max_iterations, true, s.fit);
    squared_distances(points_, s.fit.pose, d2_);
    s.scale = scale_of(s.weights);
    return std::isfinite(s.fit.at.cost);
  }

  /// The other minimum: of a plane's two tilts the better one becomes the answer.
  void other_tilt(Selection& best) {
    const bool nearly_flat = points_.extent[2] < kNearlyFlat * points_.extent[0];
    if (!nearly_flat && !runner_up_) return;
    Selection other = best;
    other.fit.pose = nearly_flat ? mirrored(points_, best.fit.pose) : *runner_up_;
    other.fit.iterations = 0;
    const double freedom = 2.0 * best.count - 6;
    for (const bool lens : {false, true}) {  // most are refuted before the lens makes a difference
      renew_ = renew_ || lens;
      minimise(points_, other.weights, 0, options_.max_iterations, lens, other.fit);
      if (!std::isfinite(other.fit.at.cost) || !other.fit.regular ||
          angle_between(other.fit.pose, best.fit.pose) < 0.01)
        return;
      if (!lens && freedom * std::log(other.fit.at.cost / std::max(best.fit.at.cost, 1e-300)) > 4 * kRefuted) return;
    }
    if (other.fit.at.cost < best.fit.at.cost) {
      std::swap(other.fit, best.fit);
      if (robust_ && best.count < int(matches_.size())) {
        Selection again = best;
        if (settle(again, best.scale) && again.count >= best.count) best = std::move(again);
      }
    }
    const double ratio = std::max(1.0, other.fit.at.cost / std::max(best.fit.at.cost, 1e-300));
    if (freedom * std::log(ratio) > kRefuted) return;
    alternative_ = other.fit.pose;
    alternative_ratio_ = ratio;
  }

  Resection result(Selection& best) {
    if (renew_) points_.renew_lens_terms(best.fit.pose);
    const NormalEquations at = normal_equations(points_, best.fit.pose, best.weights, 0);
    if (!best.fit.regular || !std::isfinite(at.cost)) degenerate("the matches don't determine a pose");
    Resection r;
    r.cam_from_world = points_.pose(best.fit.pose);
    r.iterations = best.fit.iterations;
    if (alternative_) r.alternative = points_.pose(*alternative_), r.alternative_chi2_ratio = alternative_ratio_;
    const double freedom = 2.0 * best.count - 6;
    const double variance = at.cost / freedom;
    r.sigma0 = std::sqrt(variance);

    // From (rotation about the points' centre, its shift in units) to (rotation about the camera, translation).
    const Vector3d c = points_.unit * best.fit.pose.center;
    Matrix6d to = Matrix6d::Identity();
    to.bottomRightCorner<3, 3>() *= points_.unit;
    to.bottomLeftCorner<3, 3>() << 0, -c.z(), c.y(), c.z(), 0, -c.x(), -c.y(), c.x(), 0;
    // Scaled to a unit diagonal before it is inverted: the six are of very different size.
    const Vector6d scale = at.information.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix6d inverse = Matrix6d(scale.asDiagonal() * at.information * scale.asDiagonal()).inverse();
    r.covariance = to * (scale.asDiagonal() * inverse * scale.asDiagonal()) * to.transpose();
    // Wilson & Hilferty: chi² / freedom is beyond its 99.9 % quantile.
    const double third = 2 / (9 * freedom);
    if (variance > std::pow(1 - third + 3.0902 * std::sqrt(third), 3)) r.covariance *= variance;
    r.covariance = 0.5 * (r.covariance + r.covariance.transpose()).eval();
    if (!r.covariance.allFinite()) degenerate("the matches don't determine a pose");

    double sum = 0;
    for (std::size_t i = 0; i < points_.count; ++i) {
      if (best.weights[i] == 0) {
        r.outliers.push_back(std::uint32_t(i));
        continue;
      }
      const auto o = BlockResidual::at<true>(points_.blocks[i / kLanes], best.fit.pose);
      const auto lane = Eigen::Index(i % kLanes);
      const Eigen::Matrix2d& v = matches_[i].covariance;
      const double c00 = std::sqrt(v(0, 0)), c10 = 0.5 * (v(0, 1) + v(1, 0)) / c00,
                   c11 = std::sqrt(v(1, 1) - c10 * c10);
      sum += std::pow(c00 * o.rx[lane], 2) + std::pow(c10 * o.rx[lane] + c11 * o.ry[lane], 2);
    }
    r.rms_px = std::sqrt(sum / best.count);
    if (r.rms_px > 0.25 * points_.spread_px) degenerate("no pose fits the matches");
    return r;
  }

  const ResectOptions& options_;
  std::span<const PointMatch> matches_;
  ResectionPoints points_;
  bool robust_;
  int seen_ = 0;
  double sigma_px_ = 0;  ///< RMS of the matches' standard deviations
  bool reflected_ = false;
  bool renew_ = false;  ///< the lens terms are those of another pose
  std::vector<double> d2_, ordered_;
  std::optional<Selection> fallback_;  ///< all matches, where leaving some out can't be justified
  std::optional<LocalPose> runner_up_, alternative_;
  double alternative_ratio_ = 0;
};

}  // namespace

void ResectOptions::validate() const {
  const auto check = [](bool good, const char* message) {
    if (!good) throw Error(ErrorCode::invalid_argument, message, "ResectOptions");
  };
  check(outlier_sigma >= 2 && outlier_sigma <= 100, "outlier_sigma must be 2 … 100");
  check(max_iterations >= 1 && max_iterations <= 1000, "max_iterations must be 1 … 1000");
}

Resection resect(const Camera& camera, std::span<const PointMatch> matches, const ResectOptions& options) {
  options.validate();
  camera.validate();
  return Resecting(camera, matches, options).run();
}

}  // namespace lumihull::calib
