#include "libmv_problem.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>

#include "lens/point_term.h"

namespace lumihull::test {
namespace {

using Eigen::Vector3d;

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : in_(file, std::ios::binary) { swap_ = byte() == 'V'; }
  char byte() {
    char c = 0;
    if (!in_.get(c)) throw std::runtime_error("the file ends too early");
    return c;
  }
  template <class T>
  T read() {
    static_assert(sizeof(T) == 4);
    char bytes[4];
    for (char& b : bytes) b = byte();
    if (swap_) std::reverse(bytes, bytes + 4);
    T value;
    std::memcpy(&value, bytes, 4);
    return value;
  }
  int count() {
    const int n = read<std::int32_t>();
    if (n < 0 || n > 10'000'000) throw std::runtime_error("a count is out of range");
    return n;
  }
  Vector3d vector() {
    const float x = read<float>(), y = read<float>(), z = read<float>();
    return {x, y, z};
  }

 private:
  std::ifstream in_;
  bool swap_ = false;
};

}  // namespace

LibmvProblem::LibmvProblem(const std::filesystem::path& file, bool free_lens) : free_lens_(free_lens) {
  Reader in(file);
  pixels_ = in.byte() == 'P';
  for (int i = 0; i < 8; ++i) kept_.lens[i] = in.read<float>();
  std::map<int, int> camera_of, point_of;
  for (int i = in.count(); i > 0; --i) {
    camera_of[in.read<std::int32_t>()] = int(kept_.cameras.size());
    Eigen::Matrix3d rotation;
    for (int k = 0; k < 3; ++k) rotation.col(k) = in.vector();
    const Vector3d translation = in.vector();
    kept_.cameras.push_back(Pose::from_matrix(rotation, translation));
  }
  std::vector<Vector3d> all_points;
  for (int i = in.count(); i > 0; --i) {
    point_of[in.read<std::int32_t>()] = int(all_points.size());
    all_points.push_back(in.vector());
  }
  std::vector<int> seen(all_points.size(), 0);
  for (int i = in.count(); i > 0; --i) {
    const int image = in.read<std::int32_t>(), track = in.read<std::int32_t>();
    const float x = in.read<float>(), y = in.read<float>();
    if (!camera_of.count(image) || !point_of.count(track)) continue;
    markers_.push_back({camera_of[image], point_of[track], {x, y}});
    ++seen[std::size_t(point_of[track])];
  }
  std::vector<int> renamed(all_points.size(), -1);
  for (std::size_t i = 0; i < all_points.size(); ++i) {
    if (seen[i] < 2) continue;
    renamed[i] = int(kept_.points.size());
    kept_.points.push_back(all_points[i]);
  }
  std::erase_if(markers_, [&](const Marker& m) { return renamed[std::size_t(m.point)] < 0; });
  for (Marker& m : markers_) m.point = renamed[std::size_t(m.point)];
  moved_ = kept_;

  const std::int32_t cameras = std::int32_t(kept_.cameras.size()), points = std::int32_t(kept_.points.size());
  sizes.assign(kept_.cameras.size(), 6);
  sizes.insert(sizes.end(), kept_.points.size(), 3);
  eliminated.assign(sizes.size(), 0);
  const bool eliminate_points = 2 * cameras < points;  // leaves the smaller system
  for (std::size_t b = 0; b < eliminated.size(); ++b) eliminated[b] = (std::int32_t(b) >= cameras) == eliminate_points;
  if (free_lens) sizes.push_back(3), eliminated.push_back(0);
  for (const Marker& m : markers_) {
    calib::bundle::Term term;
    term.block = {m.camera, cameras + m.point, free_lens ? cameras + points : -1, -1, -1};
    term.blocks = free_lens ? 3 : 2;
    terms.push_back(term);
  }
}

double LibmvProblem::evaluate(std::size_t t, double* residual, double* jacobian) const {
  const Marker& m = markers_[t];
  const Pose& pose = moved_.cameras[std::size_t(m.camera)];
  const Vector3d point = pose * moved_.points[std::size_t(m.point)];
  if (!(point.z() != 0)) return -1;
  const double iz = 1 / point.z(), x = point.x() * iz, y = point.y() * iz;
  const double f = moved_.lens[0], k1 = moved_.lens[3], k2 = moved_.lens[4], k3 = moved_.lens[5];
  const double p1 = moved_.lens[6], p2 = moved_.lens[7];
  const double r2 = x * x + y * y, radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const Eigen::Vector2d d(x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                          y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y));
  Eigen::Map<Eigen::Vector2d> r(residual);
  r = f * d + moved_.lens.segment<2>(1) - m.pixel;
  if (!pixels_) r = d - m.pixel;
  if (jacobian) {
    const double slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3)), off = x * y * slope + 2 * p1 * x + 2 * p2 * y;
    Eigen::Matrix2d lens;
    lens << radial + x * x * slope + 2 * p1 * y + 6 * p2 * x, off, off,
        radial + y * y * slope + 2 * p2 * x + 6 * p1 * y;
    Eigen::Matrix<double, 2, 3> normalised;
    normalised << iz, 0, -x * iz, 0, iz, -y * iz;
    const double scale = pixels_ ? f : 1;
    const Eigen::Matrix<double, 2, 3> by_point = scale * lens * normalised;
    const int width = free_lens_ ? 12 : 9;
    Eigen::Map<Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>> j(jacobian, 2, width);
    j.leftCols<3>() = -by_point * calib::lens::cross_matrix(point);
    j.middleCols<3>(3) = by_point;
    j.middleCols<3>(6) = by_point * pose.rotation.toRotationMatrix();
    if (free_lens_) {
      j.col(9) = pixels_ ? d : Eigen::Vector2d(0, 0);
      j.col(10) = scale * r2 * Eigen::Vector2d(x, y);
      j.col(11) = scale * r2 * r2 * Eigen::Vector2d(x, y);
    }
  }
  return r.squaredNorm();
}

bool LibmvProblem::move(const Eigen::VectorXd& step) {
  moved_ = kept_;
  Eigen::Index at = 0;
  for (Pose& pose : moved_.cameras) {
    pose = calib::lens::moved(pose, step.segment<6>(at));
    at += 6;
  }
  for (Vector3d& point : moved_.points) {
    point += step.segment<3>(at);
    at += 3;
  }
  if (free_lens_) moved_.lens[0] += step[at], moved_.lens[3] += step[at + 1], moved_.lens[4] += step[at + 2];
  return true;
}

Eigen::MatrixXd LibmvProblem::gauge() const {
  const Eigen::Index cameras = Eigen::Index(kept_.cameras.size());
  Eigen::MatrixXd g =
      Eigen::MatrixXd::Zero(6 * cameras + 3 * Eigen::Index(kept_.points.size()) + (free_lens_ ? 3 : 0), 7);
  for (Eigen::Index c = 0; c < cameras; ++c) {
    const Pose& pose = kept_.cameras[std::size_t(c)];
    const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
    g.block<3, 3>(6 * c + 3, 0) = -rotation;
    g.block<3, 3>(6 * c, 3) = -rotation;
    g.block<3, 3>(6 * c + 3, 3) = -calib::lens::cross_matrix(pose.translation) * rotation;
    g.block<3, 1>(6 * c + 3, 6) = pose.translation;
  }
  for (std::size_t i = 0; i < kept_.points.size(); ++i) {
    const Eigen::Index at = 6 * cameras + 3 * Eigen::Index(i);
    g.block<3, 3>(at, 0).setIdentity();
    g.block<3, 3>(at, 3) = -calib::lens::cross_matrix(kept_.points[i]);
    g.block<3, 1>(at, 6) = kept_.points[i];
  }
  return g;
}

double LibmvProblem::rms_px() const {
  double sum = 0, residual[2];
  for (std::size_t t = 0; t < terms.size(); ++t) sum += evaluate(t, residual, nullptr);
  return std::sqrt(sum / double(terms.size()));
}

}  // namespace lumihull::test
