#include <gtest/gtest.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <limits>
#include <random>

namespace lumihull::internal {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

template <int N>
Eigen::Matrix<double, N, 1> random_vector(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Matrix<double, N, 1>::NullaryExpr([&] { return normal(random); });
}

Matrix3d random_matrix(std::mt19937& random) {
  return Eigen::Map<const Matrix3d>(random_vector<9>(random).eval().data());
}

TEST(SmallMatrices, ARotationIsTheNearestToItsProductWithAStretch) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> stretch(0.1, 3);
  for (int k = 0; k < 100; ++k) {
    const Matrix3d axes = Eigen::Quaterniond(random_vector<4>(random).normalized()).toRotationMatrix();
    const Matrix3d rotation = Eigen::Quaterniond(random_vector<4>(random).normalized()).toRotationMatrix();
    Vector3d s(stretch(random), stretch(random), stretch(random));
    // R P with P symmetric and positive is the polar decomposition.
    const NearestRotation found = nearest_rotation(rotation * axes * s.asDiagonal() * axes.transpose());
    EXPECT_FALSE(found.reflected);
    EXPECT_LT((found.rotation - rotation).norm(), 1e-12);
    std::sort(s.data(), s.data() + 3, std::greater<>());
    EXPECT_LT((found.singular_values - s).norm(), 1e-12);
  }
}

TEST(SmallMatrices, NoRotationIsNearerToAReflection) {
  std::mt19937 random(2);
  int reflections = 0;
  for (int k = 0; k < 50; ++k) {
    const Matrix3d m = random_matrix(random);
    const NearestRotation found = nearest_rotation(m);
    EXPECT_EQ(found.reflected, m.determinant() < 0);
    reflections += found.reflected;
    EXPECT_LT((found.rotation * found.rotation.transpose() - Matrix3d::Identity()).norm(), 1e-13);
    EXPECT_NEAR(found.rotation.determinant(), 1, 1e-13);
    const double best = (found.rotation.transpose() * m).trace();
    for (int other = 0; other < 200; ++other) {
      // Half of them anywhere, half beside what was found.
      const Vector3d turn = (other % 2 ? 0.05 : 3.0) * random_vector<3>(random);
      const Matrix3d r = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * found.rotation;
      EXPECT_LE((r.transpose() * m).trace(), best + 1e-12);
    }
  }
  EXPECT_GT(reflections, 10);
}

TEST(SmallMatrices, AxesRebuildTheMatrixAndAscend) {
  std::mt19937 random(3);
  for (int k = 0; k < 50; ++k) {
    const Matrix3d m = random_matrix(random), a = m + m.transpose();
    Matrix3d lower = a;
    lower.triangularView<Eigen::StrictlyUpper>().setConstant(std::numeric_limits<double>::quiet_NaN());
    const SymmetricAxes axes = symmetric_axes(lower);
    EXPECT_LT((axes.vectors * axes.values.asDiagonal() * axes.vectors.transpose() - a).norm(), 1e-12);
    EXPECT_LE(axes.values[0], axes.values[1]);
    EXPECT_LE(axes.values[1], axes.values[2]);
  }
}

TEST(SmallMatrices, ACovarianceHasNoNegativeEigenvalue) {
  Eigen::MatrixXd c = Eigen::MatrixXd::Identity(6, 6);
  c(0, 0) = 1e-12, c(5, 5) = 1e12;  // units do not matter
  EXPECT_TRUE(is_covariance(c));
  c(5, 0) = c(0, 5) = 0.999;
  EXPECT_TRUE(is_covariance(c));
  c(5, 0) = c(0, 5) = 1.001;  // a correlation above 1
  EXPECT_FALSE(is_covariance(c));
  c(5, 0) = c(0, 5) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(is_covariance(c));
  EXPECT_TRUE(is_covariance(Eigen::MatrixXd::Zero(3, 3)));
}

}  // namespace
}  // namespace lumihull::internal
