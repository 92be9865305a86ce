#pragma once

// The parts of compare_with_truth, each of them a file.

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/truth.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "alignment.h"
#include "truth_files.h"

namespace lumihull::slf::truth {

/// A positioned shot of the capture and its true view.
struct Pair {
  std::size_t shot = 0;
  View truth;
};

/// Shots that have a pose on both sides; what has none is named in `poses`. Errors: bad_input (no name in common).
std::vector<Pair> paired_shots(const Capture& capture, const TrueCameras& cameras, PoseTruth& poses);

/// All errors of `poses`; its consistency by the targets' alignment, where that is known.
void compare_poses(const Capture& capture, std::span<const Pair> pairs, const CameraAlignment& alignment,
                   const std::optional<Similarity>& by_targets, PoseTruth& poses);

/// Errors: bad_input (a size that differs).
std::vector<LensTruth> compare_lenses(const Capture& capture, std::span<const Pair> pairs);

/// The targets that the capture solved beside the true ones.
struct TargetPairs {
  struct Target {
    std::string name;
    int design = 0, id = 0;
    std::vector<Eigen::Vector3d> solved, truth;  ///< points; the capture's and the truth's world
  };
  std::vector<Target> known;
  TargetTruth truth;  ///< wrong_ids that do not exist, and not_solved
};
/// Errors: those of calib::TargetModel::of; bad_input (a design that the capture's targets do not have).
TargetPairs paired_targets(const Capture& capture, std::span<const TrueTarget> targets);
/// nullopt where there are fewer than three points.
std::optional<Similarity> align_targets(const TargetPairs& pairs, bool rigid);
TargetTruth compare_targets(TargetPairs pairs, const Similarity& truth_from_capture);

/// An 8-bit mask of the same size as another one. Errors: not_found, bad_input.
Image true_mask(const std::filesystem::path& file, const Image& like);
/// nullopt where no shot has both masks. Errors: bad_input.
std::optional<MaskTruth> compare_masks(const Capture& capture, const std::filesystem::path& folder, Job& job);

/// The hull in the capture's world, the true mesh in the truth's. Errors: bad_input.
SurfaceTruth compare_surface(const Capture& capture, hull::Mesh hull, const hull::Mesh& truth,
                             const Similarity& truth_from_capture, std::span<const Pair> pairs,
                             const TruthOptions& options, Job& job);

}  // namespace lumihull::slf::truth
