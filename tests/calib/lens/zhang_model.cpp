#include "zhang_model.h"

#include <Eigen/Dense>

namespace lumihull::test {
namespace {

using Eigen::VectorXd;

VectorXd packed(const ZhangModel& m) {
  VectorXd p(7 + 6 * Eigen::Index(m.cam_from_board.size()));
  p.setZero();
  p.head<7>() << m.alpha, m.gamma, m.beta, m.u0, m.v0, m.k1, m.k2;
  return p;
}

/// Poses change by a rotation vector and a translation after those of `base`.
ZhangModel unpacked(const ZhangModel& base, const VectorXd& p) {
  ZhangModel m = base;
  m.alpha = p(0), m.gamma = p(1), m.beta = p(2), m.u0 = p(3), m.v0 = p(4), m.k1 = p(5), m.k2 = p(6);
  for (std::size_t i = 0; i < m.cam_from_board.size(); ++i) {
    const Eigen::Vector3d w = p.segment<3>(7 + 6 * Eigen::Index(i));
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(w.norm(), w.norm() > 0 ? w.normalized() : Eigen::Vector3d::UnitX()));
    m.cam_from_board[i] = Pose{turn, p.segment<3>(10 + 6 * Eigen::Index(i))} * m.cam_from_board[i];
  }
  return m;
}

VectorXd residuals(std::span<const calib::BoardView> views, const ZhangModel& m) {
  std::vector<double> r;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (const calib::BoardMatch& match : views[i].matches) {
      const Eigen::Vector3d p = m.cam_from_board[i] * match.board;
      const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y, lens = 1 + m.k1 * r2 + m.k2 * r2 * r2;
      r.push_back(m.u0 + (m.alpha * x + m.gamma * y) * lens - match.pixel.x());
      r.push_back(m.v0 + m.beta * y * lens - match.pixel.y());
    }
  return Eigen::Map<VectorXd>(r.data(), Eigen::Index(r.size()));
}

}  // namespace

ZhangModel adjust_zhang_model(std::span<const calib::BoardView> views, const ZhangModel& start) {
  ZhangModel model = start;
  VectorXd r = residuals(views, model);
  double damping = 1e-4;
  for (int iteration = 0; iteration < 100; ++iteration) {
    const VectorXd p = packed(model);
    Eigen::MatrixXd j(r.size(), p.size());
    for (Eigen::Index i = 0; i < p.size(); ++i) {
      const double h = i < 5 ? 1e-4 : 1e-7;
      const VectorXd step = h * VectorXd::Unit(p.size(), i);
      j.col(i) = (residuals(views, unpacked(model, p + step)) - residuals(views, unpacked(model, p - step))) / (2 * h);
    }
    const Eigen::MatrixXd normal = j.transpose() * j;
    const double before = r.squaredNorm();
    bool better = false;
    for (int attempt = 0; attempt < 12 && !better; ++attempt) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() *= 1 + damping;
      const ZhangModel next = unpacked(model, p - damped.ldlt().solve(j.transpose() * r));
      const VectorXd next_r = residuals(views, next);
      better = next_r.squaredNorm() < before;
      if (better) model = next, r = next_r;
      damping = better ? std::max(1e-12, damping / 10) : damping * 10;
    }
    if (!better || before - r.squaredNorm() < 1e-14 * before) break;
  }
  model.rms_px = std::sqrt(2 * r.squaredNorm() / double(r.size()));
  return model;
}

}  // namespace lumihull::test
