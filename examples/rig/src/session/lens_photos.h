#pragma once

#include <lumihull/base/job.h>
#include <lumihull/rig/rig_camera.h>

#include <cstdint>
#include <filesystem>

namespace lumihull::rig {

/// Photographs a printed chessboard `n` times by hand, for `lumihull intrinsics`: folder/board_0001.jpg … and, last,
/// folder/board.json. Files that are there stay.
void photograph_board(const std::filesystem::path& folder, const RigLens& lens, int n, double from_s,
                      std::uint64_t seed, Job& job);

}  // namespace lumihull::rig
