#pragma once

#include <lumihull/calib/detect_targets.h>

#include <memory>

namespace lumihull::calib {

/// Finds, reads and measures the targets of a set's square families. Holds their tables; immutable: any number of threads
/// may detect.
///
/// Rough corners and ids come from libapriltag. Each corner is the intersection of two sides that were fitted to the
/// photograph's pixels (fit_side), and its covariance that of their fits. A target is accepted where all cells, the border
/// and the paper around it look as the id's cells do through the blur that its sides have.
class LUMIHULL_API SquareDetector {
 public:
  /// set: kept by reference to nothing; designs of circle families and point grids are passed over.
  explicit SquareDetector(const TargetSet& set);
  SquareDetector(SquareDetector&&) noexcept;
  ~SquareDetector();

  bool empty() const;  ///< there is nothing to look for
  /// Appends to `found`, by design, then id. photo as for TargetDetector::detect.
  void detect(const Image& photo, const DetectOptions& options, Job& job, Detections& found) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// The same for one photograph.
LUMIHULL_API void detect_squares(const Image& photo, const TargetSet& set, const DetectOptions& options, Job& job,
                    Detections& found);

}  // namespace lumihull::calib
