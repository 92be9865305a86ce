#pragma once

// Sections of the report's page, each of them appended to it.

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/evaluate.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace lumihull::slf {

/// Pictures that add_light_field makes beside the turntable's: two strips of so many.
inline constexpr int kFanPictures = 7;

/// What light_field.glb is, a turn around it, and how one place of it looks from a fan of directions. Counts a step of
/// the job for each picture. Errors: those of read_light_field.
void add_light_field(std::string& page, const std::filesystem::path& file, std::span<const View> photographs,
                     const TurntableOptions& turn, Job& job);

/// Figures of the test views.
void add_test_views(std::string& page, const TestViewEvaluation& t);

/// Figures and comparison pictures of the held-out photographs. Errors: bad_input, io (a picture in evaluate/).
void add_evaluation(std::string& page, const Capture& capture, const Evaluation& evaluation, Job& job);

}  // namespace lumihull::slf
