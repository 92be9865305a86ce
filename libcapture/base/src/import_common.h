#pragma once

// What the importers share: text tokens, and the way from a list of photographs to a complete capture on disk.

#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/base/import.h>

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::internal {

/// Splits a text into lines without line ends ('\n' or '\r\n').
std::vector<std::string_view> lines_of(std::string_view text);
/// Splits a line at blanks and tabs.
std::vector<std::string_view> words_of(std::string_view line);
/// A whole word as a finite number; nullopt for anything else. Independent of the locale.
std::optional<double> finite_number(std::string_view word);

[[noreturn]] void fail_at_line(const std::string& file, std::size_t line, const std::string& what);

/// A photograph as an importer found it.
struct ImportedPhoto {
  std::filesystem::path file;
  int camera = 0;
  std::optional<Pose> cam_from_world;
};

struct Imported {
  std::vector<Camera> cameras;
  std::vector<ImportedPhoto> photos;
  std::vector<std::string> notes;
  bool alpha_is_mask = false;
};

/// Headers of pictures, read in parallel. Errors: of the first picture (by time) that can't be read.
std::vector<ImageInfo> read_infos(const std::vector<std::filesystem::path>& files, Job& job);

/// Throws invalid_argument where `output` is in use. Called first, so that no work is lost.
void check_output(const std::filesystem::path& output);

/// Makes a folder and those above it; nothing where it is there. Errors: io.
void make_folder(const std::filesystem::path& folder);

/// A photograph's stem, or its folder's name, extension or a number added until no other of `taken` has it. What is no
/// printable UTF-8 becomes '_'.
std::string unique_name(const std::filesystem::path& file, std::set<std::string>& taken);
/// What the copy of a photograph that is called `name` is called: the name and the file's extension.
std::string copy_name(const std::string& name, const std::filesystem::path& file);
/// The path by which a capture refers to a photograph where it is. Errors: io, unsupported (not UTF-8).
std::string reference_to(const std::filesystem::path& file);

/// Writes the capture: `infos` belong to imported.photos.
Capture build_capture(Imported imported, const std::vector<ImageInfo>& infos, const ImportOptions& options, Job& job);

/// The rotation nearest to a matrix (orthogonal Procrustes by SVD); nullopt where it is farther than `tolerance` from
/// one in any entry, or mirrored.
std::optional<Eigen::Matrix3d> rotation_within(const Eigen::Matrix3d& m, double tolerance);

/// K of a 3 x 3 upper triangular matrix with K(2,2) = 1; `shift` is added to the principal point.
Camera camera_from_matrix(const Eigen::Matrix3d& k, double shift, int width, int height);

/// Makes one camera of those whose sizes are the same and whose parameters agree to 1e-10 of the larger of the value
/// and the picture's side: the rounding of a decomposition.
void merge_equal_cameras(Imported& imported);

// ---- the formats' structure, from text in memory; exported for tests and the fuzzer ------------------------------

struct ProjectionLine {
  std::string name;
  Eigen::Matrix<double, 3, 4> matrix;
  std::size_t line = 0;  ///< counted from 1
};
LUMIHULL_API std::vector<ProjectionLine> parse_projections(std::string_view text, const std::string& file);

struct MiddleburyLine {
  std::string name;
  Eigen::Matrix3d k, r;
  Eigen::Vector3d t;
  std::size_t line = 0;
};
LUMIHULL_API std::vector<MiddleburyLine> parse_middlebury(std::string_view text, const std::string& file);

}  // namespace lumihull::internal
