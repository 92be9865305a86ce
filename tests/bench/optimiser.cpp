// Our CMA-ES and pagmo's on the paper's objective: 240 poses, six free attachment points (19 unknowns).
//
// A program of its own, built without AVX: pagmo's classes hold Eigen matrices that its library allocates and this
// program frees, Debian's library is built without AVX, and Eigen's allocation depends on it (with AVX the program
// crashes). It takes nothing from Lumihull's libraries that Eigen allocated.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "design/cma_es.h"
#include "design/objective.h"

using namespace lumihull::capture;

namespace {

struct PhiProblem {
  Mechanism base;
  DesignOptions options;

  int dimensions() const { return design::unknowns(base, options); }
  double phi(const Eigen::VectorXd& x) const { return design::objective(design::decoded(base, options, x), options); }
  pagmo::vector_double fitness(const pagmo::vector_double& x) const {
    return {phi(Eigen::Map<const Eigen::VectorXd>(x.data(), Eigen::Index(x.size())))};
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(std::size_t(dimensions()), 0), pagmo::vector_double(std::size_t(dimensions()), 1)};
  }
  template <class Archive>
  void serialize(Archive&, unsigned) {}
};

double cpu_s() { return double(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
  PhiProblem problem{paper_mechanism(), {}};
  problem.options.goals.reset();
  problem.options.paired = false;
  lumihull::Job job({}, 1);
  for (int seed = 1; seed <= seeds; ++seed) {
    double start = cpu_s();
    design::CmaOptions cma;
    cma.dimensions = problem.dimensions();
    cma.seed = std::uint64_t(seed);
    cma.target = -240;
    const design::CmaResult ours = design::cma_es(
        cma, [&](const Eigen::VectorXd& x) { return problem.phi(x); }, job, "ours");
    const double our_time = cpu_s() - start;
    start = cpu_s();
    double theirs = 0;
    std::size_t evaluations = 0;
    for (unsigned restart = 0; evaluations < cma.evaluations && theirs > -240; ++restart) {
      const unsigned their_seed = unsigned(seed) + 1000 * restart;
      pagmo::population population(pagmo::problem(problem), 50, their_seed);
      population = pagmo::cmaes(60, -1, -1, -1, -1, 0.3, 1e-6, 1e-6, false, true, their_seed).evolve(population);
      theirs = std::min(theirs, population.champion_f()[0]);
      evaluations += std::size_t(population.get_problem().get_fevals());
    }
    std::printf("seed %d: ours %.0f after %zu (%.1f s of CPU), pagmo %.0f after %zu (%.1f s)\n", seed, ours.value,
                ours.evaluations, our_time, theirs, evaluations, cpu_s() - start);
    std::fflush(stdout);
  }
}
