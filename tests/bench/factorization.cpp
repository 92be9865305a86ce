// Factorisation: how fast the matrix of a vertex is factored, and how well, against Eigen's decompositions cut off
// after the same terms. Synthetic: a mean, terms that fall off, noise. One thread; milliseconds a matrix.
//
//     bench_factorization [matrices = 40]

#include <lumihull/slf/factorization.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <vector>

using namespace lumihull;
using Eigen::MatrixXd, Eigen::MatrixXf;

namespace {

/// Milliseconds a matrix; the fastest of three rounds.
double fastest(int count, const std::function<void(int)>& body) {
  double best = 1e30;
  for (int round = 0; round < 3; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < count; ++i) body(i);
    best = std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  return best / count;
}

struct Vertex {
  MatrixXf truth, samples, weights;
};

/// Twelve terms, each `falling` times the one before, the first with a mean; noise as a share of the mean.
Vertex vertex(unsigned seed, int n, int m, double falling, double noise, double fill) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  MatrixXd g(n, 12), h(12, m);
  for (double& x : g.reshaped()) x = uniform(random);
  for (double& x : h.reshaped()) x = normal(random);
  for (int k = 0; k < 12; ++k) g.col(k) *= std::pow(falling, k);
  h.row(0).array() += 3;
  Vertex v{(g * h).cast<float>(), {}, MatrixXf::Ones(n, m)};
  v.samples = v.truth;
  for (float& x : v.samples.reshaped()) x += float(1.5 * noise * normal(random));
  for (float& x : v.weights.reshaped()) x = uniform(random) < fill;
  return v;
}

double difference(const MatrixXd& x, const MatrixXd& truth) { return (x - truth).norm() / truth.norm(); }
MatrixXd product(const slf::Factors& f) { return f.surface.cast<double>() * f.view.cast<double>(); }

template <typename Svd>
MatrixXd cut(const Svd& svd, int terms) {
  return svd.matrixU().leftCols(terms) * svd.singularValues().head(terms).asDiagonal() *
         svd.matrixV().leftCols(terms).transpose();
}

void complete(int count, int n, int m, int terms, double falling) {
  std::vector<Vertex> vertices;
  for (int i = 0; i < count; ++i) vertices.push_back(vertex(unsigned(i), n, m, falling, 0.02, 1));
  const auto at = [&](int i) -> const MatrixXf& { return vertices[std::size_t(i)].samples; };
  std::vector<MatrixXd> ours(vertices.size()), bdc(ours), jacobi(ours), gram(ours);
  const double t_ours = fastest(count, [&](int i) { ours[std::size_t(i)] = product(slf::pca(at(i), terms, 1)); });
  const double t_bdc = fastest(count, [&](int i) {
    bdc[std::size_t(i)] =
        cut(Eigen::BDCSVD<MatrixXd>(at(i).cast<double>(), Eigen::ComputeThinU | Eigen::ComputeThinV), terms);
  });
  const double t_jacobi = fastest(count, [&](int i) {
    jacobi[std::size_t(i)] =
        cut(Eigen::JacobiSVD<MatrixXd>(at(i).cast<double>(), Eigen::ComputeThinU | Eigen::ComputeThinV), terms);
  });
  const double t_gram = fastest(count, [&](int i) {  // n >= m
    const MatrixXd x = at(i).cast<double>();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(x.transpose() * x);
    const MatrixXd v = solver.eigenvectors().rightCols(terms);
    gram[std::size_t(i)] = (x * v) * v.transpose();
  });
  double worst = 0, worst_gram = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    worst = std::max(worst, difference(ours[i], bdc[i]));
    worst_gram = std::max(worst_gram, difference(gram[i], bdc[i]));
  }
  std::printf(
      "%4d x %3d, %d terms, falling by %.1f: pca %.3f ms; BDCSVD %.2f (x %.1f), JacobiSVD %.2f (x %.1f), Gram + "
      "SelfAdjointEigenSolver %.3f (x %.2f); from BDCSVD %.1e, Gram %.1e\n",
      n, m, terms, falling, t_ours, t_bdc, t_bdc / t_ours, t_jacobi, t_jacobi / t_ours, t_gram, t_gram / t_ours, worst,
      worst_gram);
}

void incomplete(int count, int n, int m, int terms, double noise, double fill) {
  std::vector<Vertex> vertices;
  for (int i = 0; i < count; ++i) vertices.push_back(vertex(unsigned(i), n, m, 0.3, noise, fill));
  const auto error = [&](const std::vector<slf::Factors>& factors) {  // root mean square over the vertices
    double sum = 0;
    for (std::size_t i = 0; i < factors.size(); ++i)
      sum += std::pow(difference(product(factors[i]), vertices[i].truth.cast<double>()), 2);
    return std::sqrt(sum / double(factors.size()));
  };
  std::vector<slf::Factors> low(vertices.size()), zeros(low), nmf(low);
  const auto at = [&](int i) -> const Vertex& { return vertices[std::size_t(i)]; };
  const double t_low =
      fastest(count, [&](int i) { low[std::size_t(i)] = slf::low_rank(at(i).samples, at(i).weights, terms, {}, 1); });
  const double t_zeros = fastest(count, [&](int i) {  // what is missing taken for 0, scaled up
    zeros[std::size_t(i)] = slf::pca(at(i).samples.cwiseProduct(at(i).weights) / float(fill), terms, 1);
  });
  const double t_nmf = fastest(count, [&](int i) {
    slf::NmfOptions options;
    options.weights = &at(i).weights;
    nmf[std::size_t(i)] = slf::nmf(at(i).samples.cwiseMax(0), terms, options, 1);
  });
  std::printf(
      "%4d x %3d, %d terms, %.0f %% filled, noise %.0f %%: low_rank %.2f ms, error %.2f %%; pca with zeros %.2f ms, "
      "%.1f %%; nmf %.2f ms, %.2f %%\n",
      n, m, terms, 100 * fill, 100 * noise, t_low, 100 * error(low), t_zeros, 100 * error(zeros), t_nmf,
      100 * error(nmf));
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 40;
  if (count < 1 || count > 100000) return std::fprintf(stderr, "bad arguments\n"), 2;
  for (const auto& [n, m] : {std::pair{192, 48}, {600, 100}, {192, 192}})
    for (const double falling : {0.3, 0.9}) complete(count, n, m, 3, falling);
  for (const auto& [n, m] : {std::pair{192, 48}, {600, 100}})
    for (const double noise : {0.0, 0.02, 0.2}) incomplete(count, n, m, 3, noise, 0.4);
}
