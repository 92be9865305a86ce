// Middlebury multi-view camera files (Seitz, Curless, Diebel, Scharstein, Szeliski 2006: `*_par.txt`).

#include <lumihull/base/files.h>

#include <cmath>

#include "import_common.h"

namespace lumihull {
namespace internal {

std::vector<MiddleburyLine> parse_middlebury(std::string_view text, const std::string& file) {
  std::vector<MiddleburyLine> result;
  std::optional<double> count;
  std::size_t number = 0;
  for (const std::string_view line : lines_of(text)) {
    ++number;
    const auto words = words_of(line);
    if (words.empty()) continue;
    if (!count) {
      count = words.size() == 1 ? finite_number(words[0]) : std::nullopt;
      if (!count || *count < 1 || *count > 100'000 || *count != std::floor(*count))
        fail_at_line(file, number, "expected the number of photographs (1 to 100000) alone on the first line");
      continue;
    }
    if (words.size() != 22)
      fail_at_line(
          file, number,
          "expected a photograph's name and 21 numbers (K, R, t), found " + std::to_string(words.size()) + " words");
    double value[21];
    for (int i = 0; i < 21; ++i) {
      const auto x = finite_number(words[std::size_t(i) + 1]);
      if (!x) fail_at_line(file, number, "number " + std::to_string(i + 1) + " is not a finite number");
      value[i] = *x;
    }
    MiddleburyLine entry;
    entry.name = std::string(words[0]);
    if (entry.name.find('\0') != std::string::npos) fail_at_line(file, number, "a NUL in the photograph's name");
    entry.line = number;
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    entry.k = Eigen::Map<const RowMajor>(value);
    entry.r = Eigen::Map<const RowMajor>(value + 9);
    entry.t = Eigen::Map<const Eigen::Vector3d>(value + 18);
    if (entry.k(1, 0) != 0 || entry.k(2, 0) != 0 || entry.k(2, 1) != 0 || !(entry.k(0, 0) > 0) ||
        !(entry.k(1, 1) > 0) || !(std::abs(entry.k(2, 2)) > 1e-12))
      fail_at_line(file, number, "K is not an upper triangular camera matrix of positive focal lengths");
    const auto rotation = rotation_within(entry.r, 1e-4);
    if (!rotation) fail_at_line(file, number, "R is not a rotation (orthogonal, determinant 1)");
    entry.r = *rotation;
    result.push_back(std::move(entry));
  }
  if (!count) throw Error(ErrorCode::bad_input, "an empty file: expected the number of photographs", file);
  if (double(result.size()) != *count)
    throw Error(ErrorCode::bad_input,
                "the first line promises " + std::to_string(std::int64_t(*count)) + " photographs, the file has " +
                    std::to_string(result.size()),
                file);
  return result;
}

}  // namespace internal

Capture import_middlebury(const std::filesystem::path& par_file, const ImportOptions& options, Job& job) {
  using namespace internal;
  check_output(options.output);
  const auto lines = parse_middlebury(read_file(par_file, std::size_t(64) << 20), par_file.string());
  std::vector<std::filesystem::path> photos;
  for (const auto& line : lines) photos.push_back(par_file.parent_path() / line.name);
  const std::vector<ImageInfo> infos = read_infos(photos, job);
  Imported imported;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    imported.cameras.push_back(camera_from_matrix(lines[i].k / lines[i].k(2, 2), 0.5, infos[i].width, infos[i].height));
    imported.photos.push_back({photos[i], int(i), Pose::from_matrix(lines[i].r, lines[i].t)});
  }
  imported.notes.push_back("pixel centres were whole numbers: 0.5 px was added to the principal point");
  merge_equal_cameras(imported);
  return build_capture(std::move(imported), infos, options, job);
}

}  // namespace lumihull
