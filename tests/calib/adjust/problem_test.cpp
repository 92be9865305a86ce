// Derivatives through the whole problem, its gauge, and the solver's linear algebra against dense matrices.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <random>

#include "adjust/bundle_problem.h"
#include "adjust/normal_equations.h"
#include "kinds.h"

namespace lumihull {
namespace {

using namespace calib::bundle;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// All residuals and the dense Jacobian at the state moved to.
struct Dense {
  VectorXd residuals;
  MatrixXd jacobian;
};

Dense dense(const LeastSquares& problem, const NormalEquations& equations) {
  Index rows = 0;
  for (const Term& term : problem.terms) rows += term.rows;
  Dense d{VectorXd(rows), MatrixXd::Zero(rows, equations.unknowns())};
  double residual[kTermRows], jacobian[kTermRows * kTermColumns];
  rows = 0;
  for (std::size_t t = 0; t < problem.terms.size(); ++t) {
    const Term& term = problem.terms[t];
    EXPECT_GE(problem.evaluate(t, residual, jacobian), 0);
    int width = 0, column = 0;
    for (int i = 0; i < term.blocks; ++i) width += problem.sizes[std::size_t(term.block[std::size_t(i)])];
    for (int i = 0; i < term.blocks; ++i) {
      const auto block = std::size_t(term.block[std::size_t(i)]);
      for (int r = 0; r < term.rows; ++r)
        for (int k = 0; k < problem.sizes[block]; ++k)
          d.jacobian(rows + r, equations.offset(block) + k) = jacobian[r * width + column + k];
      column += problem.sizes[block];
    }
    for (int r = 0; r < term.rows; ++r) d.residuals[rows++] = residual[r];
  }
  return d;
}

test::SceneMaker small(test::SceneMaker maker) {
  maker.shots = std::min(maker.shots, 5);
  maker.bodies = std::min(maker.bodies, 4);
  maker.side = 3;
  maker.pitch = 0.05;
  maker.off = 0.3;
  maker.seen = 1;
  return maker;
}

TEST(AdjustProblem, DerivativesAreThoseOfDifferences) {
  for (const test::Kind& kind : test::kinds())
    for (const double robust : {0.0, 3.0}) {
      SCOPED_TRACE(kind.name);
      const test::Scene scene = test::make_scene(small(kind.maker), 3);
      const calib::AdjustOptions options{.robust_sigma = robust};
      BundleProblem problem(scene.start, options);
      const NormalEquations equations(problem);
      const Dense at = dense(problem, equations);
      // Circles' derivatives neglect a thousandth of themselves, of free bodies some more: how their normals turn.
      const bool is_free = kind.maker.model == calib::BodyModel::free;
      const double neglected = kind.maker.radius > 0 ? (is_free ? 1e-2 : 1e-3) : 1e-6;
      if (robust > 0) {
        // The weights change, too: jacobianᵀ residual is half the gradient of the cost.
        Job job({}, 1);
        const VectorXd gradient = 2 * at.jacobian.transpose() * at.residuals;
        for (Index k = 0; k < equations.unknowns(); ++k) {
          VectorXd step = VectorXd::Zero(equations.unknowns());
          const double h = 1e-5 / std::max(1.0, at.jacobian.col(k).norm());
          step[k] = h;
          ASSERT_TRUE(problem.move(step));
          const double above = *equations.cost(problem, job);
          ASSERT_TRUE(problem.move(-step));
          const double below = *equations.cost(problem, job);
          EXPECT_NEAR((above - below) / (2 * h), gradient[k],
                      std::max(2e-3, neglected) * at.jacobian.col(k).norm() * std::sqrt(double(problem.terms.size())))
              << k;
        }
        continue;
      }
      for (Index k = 0; k < equations.unknowns(); ++k) {
        VectorXd step = VectorXd::Zero(equations.unknowns());
        const double h = 1e-2 / at.jacobian.col(k).norm();
        step[k] = h;
        ASSERT_TRUE(problem.move(step));
        const VectorXd above = dense(problem, equations).residuals;
        ASSERT_TRUE(problem.move(-step));
        const VectorXd below = dense(problem, equations).residuals;
        const VectorXd difference = (above - below) / (2 * h);
        EXPECT_LT((difference - at.jacobian.col(k)).norm(), neglected * difference.norm()) << k;
        EXPECT_GT(difference.norm(), 0) << k;
      }
    }
}

TEST(AdjustProblem, TheGaugeChangesNoResidual) {
  for (const test::Kind& kind : test::kinds()) {
    SCOPED_TRACE(kind.name);
    const test::Scene scene = test::make_scene(small(kind.maker), 4);
    const calib::AdjustOptions options;
    BundleProblem problem(scene.start, options);
    const NormalEquations equations(problem);
    const Dense at = dense(problem, equations);
    const MatrixXd gauge = problem.gauge();
    const bool free_scale = kind.maker.model == calib::BodyModel::free && kind.maker.bars == 0;
    EXPECT_EQ(problem.scale_is_free(), free_scale);
    ASSERT_EQ(gauge.cols(), free_scale ? 7 : 6);
    for (Index i = 0; i < gauge.cols(); ++i) {
      const double size =
          at.jacobian.cwiseAbs().colwise().sum().cwiseProduct(gauge.col(i).cwiseAbs().transpose()).sum();
      EXPECT_LT((at.jacobian * gauge.col(i)).norm(), 1e-9 * size) << i;
    }
    // And there are no more of them.
    const VectorXd unit = at.jacobian.colwise().norm().cwiseInverse();
    Eigen::ColPivHouseholderQR<MatrixXd> qr(at.jacobian * unit.asDiagonal());
    qr.setThreshold(1e-10);
    EXPECT_EQ(qr.rank(), equations.unknowns() - gauge.cols());
    // The datum's constraints hold the gauge.
    EXPECT_GT(std::abs((problem.datum().transpose() * gauge).determinant()), 0);
  }
}

TEST(NormalEquationsTest, SolvesAsADenseSolverDoes) {
  for (const test::Kind& kind : test::kinds()) {
    SCOPED_TRACE(kind.name);
    test::SceneMaker maker = small(kind.maker);
    maker.seen = 0.8;
    maker.shots = 8;
    const test::Scene scene = test::make_scene(maker, 7);
    const calib::AdjustOptions options;
    BundleProblem problem(scene.start, options);
    NormalEquations equations(problem);
    Job job({}, 2);
    ASSERT_TRUE(equations.linearize(problem, job));
    const Dense at = dense(problem, equations);
    const MatrixXd h = at.jacobian.transpose() * at.jacobian;
    const VectorXd g = at.jacobian.transpose() * at.residuals;
    EXPECT_LT((equations.gradient() - g).norm(), 1e-11 * at.jacobian.norm() * at.residuals.norm());
    for (std::size_t b = 0; b < problem.sizes.size(); ++b) {
      const Index o = equations.offset(b), n = problem.sizes[b];
      EXPECT_LT((equations.diagonal_block(b) - h.block(o, o, n, n)).norm(), 1e-12 * h.block(o, o, n, n).norm());
    }
    // Damped, the solution is that of H + λ diag(H) + MMᵀ: as a least-squares problem, for accuracy.
    const double lambda = 1e-3;
    ASSERT_FALSE(equations.factorize(lambda, problem.gauge(), 0, job));
    const VectorXd x = equations.solve(-equations.gradient(), job);
    const VectorXd left = h * x + lambda * h.diagonal().cwiseProduct(x);
    MatrixXd held(equations.unknowns(), problem.gauge().cols());
    for (Index k = 0; k < equations.unknowns(); ++k)
      held.row(k) = equations.along_gauge(VectorXd::Unit(equations.unknowns(), k)).transpose();
    const VectorXd off = left + held * equations.along_gauge(x) + g;
    EXPECT_LT(off.norm(), 1e-8 * g.norm());
  }
}

TEST(NormalEquationsTest, CovariancesAreThoseOfADenseInverseInTheDatum) {
  for (const test::Kind& kind : test::kinds()) {
    SCOPED_TRACE(kind.name);
    test::SceneMaker maker = small(kind.maker);
    maker.shots = 6;
    const test::Scene scene = test::make_scene(maker, 5);
    const calib::AdjustOptions options;
    BundleProblem problem(scene.start, options);
    NormalEquations equations(problem);
    Job job({}, 2);
    ASSERT_TRUE(equations.linearize(problem, job));
    const MatrixXd gauge = problem.gauge(), datum = problem.datum();
    ASSERT_FALSE(equations.factorize(0, gauge, 1e-12, job));
    const BlockCovariances got =
        equations.covariances(gauge, datum, std::vector<char>(problem.sizes.size(), 1), problem.print_block(), job);
    // Bordered by the constraints: [H B; Bᵀ 0]⁻¹ (Triggs et al. 2000, section 9), scaled to a unit diagonal.
    const Dense at = dense(problem, equations);
    const Index n = equations.unknowns(), c = datum.cols();
    const VectorXd unit = at.jacobian.colwise().norm().cwiseInverse();
    MatrixXd bordered = MatrixXd::Zero(n + c, n + c);
    const MatrixXd scaled = at.jacobian * unit.asDiagonal();
    bordered.topLeftCorner(n, n) = scaled.transpose() * scaled;
    MatrixXd border = unit.asDiagonal() * datum;
    for (Index i = 0; i < c; ++i) border.col(i).normalize();
    bordered.topRightCorner(n, c) = border, bordered.bottomLeftCorner(c, n) = border.transpose();
    const MatrixXd inverse = unit.asDiagonal() * bordered.fullPivLu().inverse().topLeftCorner(n, n) * unit.asDiagonal();
    for (std::size_t b = 0; b < problem.sizes.size(); ++b) {
      const Index o = equations.offset(b), size = problem.sizes[b];
      const MatrixXd want = inverse.block(o, o, size, size);
      const VectorXd d = want.diagonal().cwiseSqrt().cwiseInverse();
      EXPECT_LT((d.asDiagonal() * (got.of[b] - want) * d.asDiagonal()).norm(), 1e-5) << problem.name(b);
      if (problem.print_block() < 0) continue;
      const Index p = equations.offset(std::size_t(problem.print_block()));
      const MatrixXd cross = inverse.block(o, p, size, 2);
      const VectorXd e = inverse.block(p, p, 2, 2).diagonal().cwiseSqrt().cwiseInverse();
      EXPECT_LT((d.asDiagonal() * (got.with[b] - cross) * e.asDiagonal()).norm(), 1e-5) << problem.name(b);
    }
  }
}

TEST(TiledCholesky, FactorsAndFindsTheFirstBadPivot) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  const Tiles tiles{0, 7, 60, 130, 131, 200};
  MatrixXd a(200, 220);
  for (Index i = 0; i < a.size(); ++i) a.data()[i] = normal(engine);
  const MatrixXd spd = a * a.transpose();
  for (const unsigned threads : {1u, 3u}) {
    Job job({}, threads);
    MatrixXd l = spd;
    ASSERT_FALSE(factorize(l, tiles, VectorXd::Zero(200), job));
    l = l.triangularView<Eigen::Lower>();
    EXPECT_LT((l * l.transpose() - spd).norm(), 1e-13 * spd.norm());
    // Column 140 a sum of two others.
    MatrixXd b = a;
    b.row(140) = b.row(3) + b.row(90);
    MatrixXd bad = b * b.transpose();
    const auto column = factorize(bad, tiles, 1e-12 * bad.diagonal(), job);
    ASSERT_TRUE(column);
    EXPECT_EQ(*column, 140);
  }
}

}  // namespace
}  // namespace lumihull
