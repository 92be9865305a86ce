#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/rig/flat_print.h>

#include <Eigen/Core>
#include <memory>
#include <span>

namespace lumihull::rig {

/// Linear light of sheets before a background, 3 channels: every value is the mean over a pixel's part, of which there
/// are `parts` x `parts` in each pixel. By rows of tiles, so that large pictures with many parts need little memory.
class FlatCoverage {
 public:
  static constexpr int kTile = 16;  ///< px

  /// lines: scan lines a pixel where edges pass. view and prints are valid; prints outlive the object.
  FlatCoverage(const View& view, std::span<const FlatPrint> prints, const Eigen::Vector3f& background, int lines,
               int parts);
  FlatCoverage(FlatCoverage&&) noexcept;
  ~FlatCoverage();

  /// Pixel rows first_row … first_row + kTile - 1, or up to the picture's end; first_row is a multiple of kTile.
  /// out: (rows · parts) x (width · parts) x 3.
  void tile_row(int first_row, float* out);

 private:
  class Renderer;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace lumihull::rig
