#include "lens/pose_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "lens/p3p.h"

namespace lumihull::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

class Search {
 public:
  Search(ResectionPoints& points, double limit, std::uint64_t seed, std::size_t keep)
      : points_(points), limit_(limit), keep_(keep), random_(seed), weights_(points.seen.size()) {
    for (std::size_t i = 0; i < points.count; ++i)
      if (points.seen[i] > 0) usable_.push_back(i);
    sample_.circles = points.circles;
    sample_.blocks.resize(1);
    sample_.count = 3;
  }

  std::vector<PoseCandidate> run() {
    const std::size_t n = usable_.size();
    if (n < 3) return {};
    if (n <= 7) {
      for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = a + 1; b < n; ++b)
          for (std::size_t c = b + 1; c < n; ++c) try_sample({usable_[a], usable_[b], usable_[c]});
      return std::move(best_);
    }
    constexpr int kMost = 2000, kLeast = 8;
    double needed = kMost;
    for (int i = 0; i < kMost && (i < kLeast || i < needed); ++i) {
      std::array<std::size_t, 3> sample;
      for (std::size_t k = 0; k < 3;) {
        // Multiply and shift: the same numbers with every standard library.
        const auto at = std::size_t((std::uint64_t(std::uint32_t(random_() >> 32)) * n) >> 32);
        if (std::find(sample.begin(), sample.begin() + k, usable_[at]) == sample.begin() + k) sample[k++] = usable_[at];
      }
      if (try_sample(sample)) {
        improve();
        const double share = double(best_.front().score.inliers) / double(n);
        const double good = std::pow(share, 3);
        // Twice as many as exact samples need: noise makes some of the good ones useless.
        needed = good < 1 - 1e-9 ? 2 * std::log(1e-5) / std::log1p(-good) : 0;
      }
    }
    return std::move(best_);
  }

 private:
  /// true if it is the best one so far
  bool try_sample(const std::array<std::size_t, 3>& sample) {
    std::array<Vector3d, 3> rays, world;
    for (std::size_t k = 0; k < 3; ++k)
      rays[k] = points_.corrected(sample[k]).homogeneous(), world[k] = points_.world(sample[k]);
    const int n = p3p(rays, world, rotations_, translations_);
    bool best = false;
    for (int i = 0; i < n; ++i) {
      LocalPose pose{rotations_[std::size_t(i)], translations_[std::size_t(i)]};
      if (points_.circles) meet_ellipses(sample, pose);
      best = offer(pose) || best;
    }
    return best;
  }

  /// Newton on the three samples' six equations, for ellipses' centres.
  void meet_ellipses(const std::array<std::size_t, 3>& sample, LocalPose& pose) {
    auto& to = sample_.blocks[0];
    for (int k = 0; k < kLanes; ++k) {
      const std::size_t i = sample[std::size_t(std::min(k, 2))];
      const auto& from = points_.blocks[i / kLanes];
      const auto lane = Eigen::Index(i % kLanes);
      for (const auto field : {&ResectionPoints::Block::x, &ResectionPoints::Block::y, &ResectionPoints::Block::z,
                               &ResectionPoints::Block::cx, &ResectionPoints::Block::cy, &ResectionPoints::Block::w00,
                               &ResectionPoints::Block::w01, &ResectionPoints::Block::w10, &ResectionPoints::Block::w11,
                               &ResectionPoints::Block::ex, &ResectionPoints::Block::ey, &ResectionPoints::Block::r2,
                               &ResectionPoints::Block::nx, &ResectionPoints::Block::ny, &ResectionPoints::Block::nz})
        (to.*field)[k] = (from.*field)[lane];
    }
    constexpr std::array<double, kLanes> kWeights{1, 1, 1, 0};
    for (int i = 0; i < 2; ++i) {
      const NormalEquations at = normal_equations(sample_, pose, kWeights, 0);
      const Vector6d step = -at.information.ldlt().solve(at.gradient);
      if (!std::isfinite(at.cost) || !(step.head<3>().norm() < 0.3)) return;
      pose = moved(pose, step);
    }
  }

  /// Takes a pose into the list. true if it became the first.
  bool offer(const LocalPose& pose) {
    const double worst = best_.size() < keep_ ? std::numeric_limits<double>::infinity() : best_.back().score.cost;
    const Score score = truncated_score(points_, pose, limit_, worst);
    if (!(score.cost < worst)) return false;
    for (PoseCandidate& other : best_) {
      const double cosine = ((other.pose.rotation.transpose() * pose.rotation).trace() - 1) / 2;
      if (cosine < 0.9998) continue;  // 1.1 degrees
      if (!(score.cost < other.score.cost)) return false;
      other = {pose, score};
      const bool first = &other == &best_.front();
      sort();
      return first || best_.front().score.cost == score.cost;
    }
    if (best_.size() == keep_) best_.pop_back();
    best_.push_back({pose, score});
    sort();
    return best_.front().score.cost == score.cost;
  }

  void sort() {
    std::stable_sort(best_.begin(), best_.end(),
                     [](const PoseCandidate& a, const PoseCandidate& b) { return a.score.cost < b.score.cost; });
  }

  /// Least squares on the best one's inliers.
  void improve() {
    if (best_.front().score.inliers < 4) return;
    PoseFit fit;
    fit.pose = best_.front().pose;
    for (int round = 0; round < 2; ++round) {
      squared_distances(points_, fit.pose, d2_);
      std::fill(weights_.begin(), weights_.end(), 0.0);
      for (std::size_t i = 0; i < points_.count; ++i) weights_[i] = d2_[i] < limit_ * limit_;
      minimise(points_, weights_, 0, 3, false, fit);
      offer(fit.pose);
    }
  }

  ResectionPoints& points_;
  double limit_;
  std::size_t keep_;
  std::mt19937_64 random_;
  std::vector<std::size_t> usable_;
  std::vector<double> weights_, d2_;
  ResectionPoints sample_;
  std::array<Matrix3d, 4> rotations_;
  std::array<Vector3d, 4> translations_;
  std::vector<PoseCandidate> best_;
};

}  // namespace

std::vector<PoseCandidate> search_pose(ResectionPoints& points, double limit, std::uint64_t seed, std::size_t keep) {
  return Search(points, limit, seed, keep).run();
}

}  // namespace lumihull::calib
