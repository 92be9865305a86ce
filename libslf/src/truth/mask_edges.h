#pragma once

// The edges of a soft mask, and how far they are from another one's.

#include <lumihull/base/image.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lumihull::slf::truth {

/// The 127.5 level of a mask, bilinear between the centres of pixels (marching squares): a segment or two in each
/// square of four centres. The picture's border is no edge.
class MaskEdges {
 public:
  struct Segment {
    Eigen::Vector2f a, b;
    float length() const { return (b - a).norm(); }
    Eigen::Vector2f middle() const { return 0.5f * (a + b); }
  };

  /// 8-bit, 1 channel.
  explicit MaskEdges(const Image& mask);

  const std::vector<Segment>& segments() const { return segments_; }
  double length() const;
  /// From the nearest edge, px; at most `reach`.
  float distance(const Eigen::Vector2f& p, float reach) const;

 private:
  int columns_, rows_;                 // squares
  std::vector<Segment> segments_;      // by square, row-major
  std::vector<std::uint32_t> starts_;  // of each square in segments_, and the end
};

/// Lengths, gathered with weights in steps of 1/64 px up to kReach: bounded memory, sums that do not depend on the
/// order.
class DistanceHistogram {
 public:
  static constexpr float kReach = 64;

  void add(float distance, float weight);
  void add(const DistanceHistogram& other);
  /// Share of the weight at most so far away.
  double within(double distance) const;
  std::size_t count() const { return count_; }
  double mean() const;
  double rms() const;
  double quantile(double q) const;  ///< the upper end of its step
  double max() const { return max_; }

 private:
  static constexpr int kSteps = 64;
  std::vector<std::uint64_t> bins_ = std::vector<std::uint64_t>(std::size_t(kSteps * int(kReach)) + 1);
  std::uint64_t total_ = 0, sum_ = 0, squares_ = 0;  // weights in 1/256 px, distances in steps
  std::size_t count_ = 0;
  float max_ = 0;
};

/// Connected parts of a mask (>= 128, by eight neighbours) or of what is left (by four), as far as the truth is mostly
/// the other: islands and holes. Background that reaches the picture's border is no hole.
struct FalseParts {
  std::size_t holes = 0, hole_px = 0, islands = 0, island_px = 0;
};
FalseParts false_parts(const Image& mask, const Image& truth);

}  // namespace lumihull::slf::truth
