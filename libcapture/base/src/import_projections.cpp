// Listings of projection matrices.

#include <lumihull/base/files.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "import_common.h"

namespace lumihull {
namespace internal {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {
constexpr std::size_t kMaxListing = 100'000;  // photographs
}

std::vector<ProjectionLine> parse_projections(std::string_view text, const std::string& file) {
  std::vector<ProjectionLine> result;
  std::size_t number = 0;
  for (const std::string_view line : lines_of(text)) {
    ++number;
    const auto words = words_of(line);
    if (words.empty() || words[0][0] == '#') continue;
    // A name may hold blanks: the matrix is the last twelve words.
    if (words.size() < 13)
      fail_at_line(file, number,
                   "expected a photograph's name and 12 numbers, found " + std::to_string(words.size()) + " words");
    if (words.size() > 13 && finite_number(words[words.size() - 13]))
      fail_at_line(file, number, "expected a photograph's name and 12 numbers, found more numbers");
    ProjectionLine entry;
    entry.line = number;
    const std::size_t first = words.size() - 12;
    entry.name = std::string(words[0].data(), words[first - 1].data() + words[first - 1].size());
    if (entry.name.find('\0') != std::string::npos) fail_at_line(file, number, "a NUL in the photograph's name");
    for (int i = 0; i < 12; ++i) {
      const auto value = finite_number(words[first + std::size_t(i)]);
      if (!value)
        fail_at_line(file, number, "value " + std::to_string(i + 1) + " of the matrix is not a finite number");
      entry.matrix(i / 4, i % 4) = *value;
    }
    if (result.size() == kMaxListing) fail_at_line(file, number, "more than 100000 photographs");
    // Scale is arbitrary: make the largest entry 1, so that singular is not a question of units.
    const double largest = entry.matrix.cwiseAbs().maxCoeff();
    if (largest > 0) entry.matrix /= largest;
    const Vector3d sizes = internal::nearest_rotation(entry.matrix.leftCols<3>()).singular_values;
    if (!(largest > 0) || !(sizes(2) > 1e-13 * sizes(0)))
      fail_at_line(file, number, "the matrix is singular: its left 3 x 3 block has no inverse, so it is no camera");
    result.push_back(std::move(entry));
  }
  if (result.empty()) throw Error(ErrorCode::bad_input, "expected lines \"NAME p11 … p34\", found none", file);
  return result;
}

namespace {

/// M = K R with K upper triangular and of positive diagonal; det M > 0, so that R is a rotation. By QR of the
/// column- and row-reversed transpose.
void rq(const Matrix3d& m, Matrix3d& k, Matrix3d& r) {
  const Matrix3d reverse = Matrix3d::Identity().rowwise().reverse();
  const Eigen::HouseholderQR<Matrix3d> qr((reverse * m).transpose());
  const Matrix3d q = qr.householderQ(), upper = qr.matrixQR().triangularView<Eigen::Upper>();
  k = reverse * upper.transpose() * reverse;
  r = reverse * q.transpose();
  const Vector3d sign = k.diagonal().array().sign();
  k = k * sign.asDiagonal();
  r = sign.asDiagonal() * r;
}

/// The point nearest to all rays through the pictures' centres. The principal point would not do: it may lie far
/// outside the picture. nullopt where the rays are (nearly) parallel.
std::optional<Vector3d> point_looked_at(const std::vector<ProjectionLine>& lines, const std::vector<ImageInfo>& infos,
                                        double shift) {
  Matrix3d a = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Matrix3d inverse = lines[i].matrix.leftCols<3>().inverse();
    const Vector3d center = -inverse * lines[i].matrix.col(3);
    const Vector3d ray =
        (inverse * Vector3d(infos[i].width / 2.0 - shift, infos[i].height / 2.0 - shift, 1)).normalized();
    const Matrix3d across = Matrix3d::Identity() - ray * ray.transpose();
    a += across;
    b += across * center;
  }
  const internal::SymmetricAxes axes = internal::symmetric_axes(a);
  if (!(axes.values(0) > 1e-9 * double(lines.size()))) return std::nullopt;
  return axes.vectors * (axes.vectors.transpose() * b).cwiseQuotient(axes.values);
}

std::string some_names(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(names.size(), 5); ++i) text += (i ? ", " : "") + names[i];
  return names.size() > 5 ? text + " and " + std::to_string(names.size() - 5) + " more" : text;
}

}  // namespace
}  // namespace internal

Capture import_projections(const std::filesystem::path& listing, const ProjectionImportOptions& options, Job& job) {
  using namespace internal;
  check_output(options.output);
  if (!std::isfinite(options.first_pixel_center))
    throw Error(ErrorCode::invalid_argument, "the first pixel's centre must be a finite number");
  const std::string file = listing.string();
  std::vector<ProjectionLine> lines = parse_projections(read_file(listing, std::size_t(64) << 20), file);
  std::vector<std::filesystem::path> photos;
  for (const auto& line : lines) photos.push_back(listing.parent_path() / line.name);
  const std::vector<ImageInfo> infos = read_infos(photos, job);

  const double shift = 0.5 - options.first_pixel_center;
  const auto target = point_looked_at(lines, infos, shift);
  if (!target && lines.size() > 1)
    throw Error(ErrorCode::degenerate,
                "all cameras look in one direction, so the matrices' signs and the world's handedness can't be told",
                file);
  std::vector<std::string> left, right;
  for (auto& line : lines) {
    // A single camera shows no handedness: take it as it can be.
    const double sign = target ? (line.matrix * target->homogeneous()).z() : line.matrix.leftCols<3>().determinant();
    if (sign < 0) line.matrix = -line.matrix;
    (line.matrix.leftCols<3>().determinant() < 0 ? left : right).push_back(line.name);
  }
  if (!left.empty() && !right.empty()) {
    const bool fewer_left = left.size() <= right.size();
    throw Error(ErrorCode::bad_input,
                "the matrices do not share one world: " + some_names(fewer_left ? left : right) +
                    (fewer_left ? " would be left-handed, the others right-handed"
                                : " would be right-handed, the others left-handed"),
                file);
  }

  Imported imported;
  if (!left.empty())
    imported.notes.push_back(
        "the matrices' world is left-handed: it was mirrored by reversing its z axis, (x, y, z) became (x, y, -z)");
  if (shift != 0)
    imported.notes.push_back("the matrices put the first pixel's centre at " +
                             std::to_string(options.first_pixel_center) + "; principal points were moved by " +
                             std::to_string(shift) + " px");
  for (std::size_t i = 0; i < lines.size(); ++i) {
    Eigen::Matrix<double, 3, 4> p = lines[i].matrix;
    if (!left.empty()) p.col(2) = -p.col(2);
    Matrix3d k, r;
    rq(p.leftCols<3>(), k, r);
    const Vector3d t = k.triangularView<Eigen::Upper>().solve(p.col(3));
    Camera camera = camera_from_matrix(k / k(2, 2), shift, infos[i].width, infos[i].height);
    try {
      camera.validate();
    } catch (const Error& e) {
      fail_at_line(file, lines[i].line, "the matrix makes no camera: " + e.message());
    }
    imported.cameras.push_back(camera);
    imported.photos.push_back({photos[i], int(i), Pose::from_matrix(r, t)});
  }
  merge_equal_cameras(imported);
  return build_capture(std::move(imported), infos, options, job);
}

}  // namespace lumihull
