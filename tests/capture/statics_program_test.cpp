// Tensions against exact linear and quadratic programs (CGAL's solver computes with numbers of any length).
#include <CGAL/Gmpzf.h>
#include <CGAL/QP_functions.h>
#include <CGAL/QP_models.h>
#include <lumihull/capture/statics.h>

#include <optional>

#include "mechanism_support.h"
#include "support.h"

namespace lumihull::capture {
namespace {

using Program = CGAL::Quadratic_program<double>;
using Solution = CGAL::Quadratic_program_solution<CGAL::Gmpzf>;

struct Task {
  WrenchMatrix w;
  Eigen::Matrix<double, 6, 1> load;
  std::vector<double> lower, upper;
};

Task task_of(const Mechanism& m, const Pose& pose) {
  Task task;
  task.w = wrench_matrix(m, pose);
  const Eigen::Vector3d force(0, 0, m.mass_kg * m.gravity_m_s2);
  task.load << force, (pose.rotation * m.center_of_mass).cross(force);
  for (const Cable& cable : m.cables) {
    task.lower.push_back(cable.min_tension_N);
    task.upper.push_back(cable.max_tension_N);
  }
  return task;
}

void set_balance(const Task& task, Program* program) {
  for (int k = 0; k < 6; ++k) {
    for (int i = 0; i < int(task.w.cols()); ++i) program->set_a(i, k, task.w(k, i));
    program->set_b(k, task.load[k]);
    program->set_r(k, CGAL::EQUAL);
  }
}

/// The greatest m with W t = load, lower + m <= t, and t <= upper - m if limited above (lower = 0 if not).
double margin(const Task& task, bool limited) {
  Program program(CGAL::LARGER, false, 0, false, 0);
  const int n = int(task.w.cols());
  set_balance(task, &program);
  int row = 6;
  for (int i = 0; i < n; ++i) {
    program.set_a(i, row, 1), program.set_a(n, row, -1);
    program.set_b(row, limited ? task.lower[std::size_t(i)] : 0);
    program.set_r(row++, CGAL::LARGER);
    if (!limited) continue;
    program.set_a(i, row, 1), program.set_a(n, row, 1);
    program.set_b(row, task.upper[std::size_t(i)]);
    program.set_r(row++, CGAL::SMALLER);
  }
  program.set_u(n, true, 1e3);
  program.set_c(n, -1);
  const Solution solution = CGAL::solve_linear_program(program, CGAL::Gmpzf());
  return solution.is_infeasible() ? -INFINITY : -CGAL::to_double(solution.objective_value());
}

/// The least sum of squares of the tensions within the limits.
double least_norm(const Task& task, bool limited) {
  Program program(CGAL::EQUAL, true, 0, false, 0);
  set_balance(task, &program);
  for (int i = 0; i < int(task.w.cols()); ++i) {
    program.set_d(i, i, 2);
    program.set_l(i, true, limited ? task.lower[std::size_t(i)] : 0);
    if (limited) program.set_u(i, true, task.upper[std::size_t(i)]);
  }
  const Solution solution = CGAL::solve_quadratic_program(program, CGAL::Gmpzf());
  return solution.is_infeasible() ? -INFINITY : CGAL::to_double(solution.objective_value());
}

TEST(TensionsProgram, SameVerdictAndNormAsExactPrograms) {
  test::Random random(11);
  int seen[4] = {}, verges = 0, redundant = 0;
  for (int k = 0; k < 3000; ++k) {
    const int cables = k % 3 == 0 ? 6 : random.integer(7, 12);
    Mechanism m = k % 6 == 0 ? paper_mechanism() : test::random_mechanism(random, cables);
    for (Cable& cable : m.cables) {
      cable.min_tension_N = random.uniform(0, 6);
      cable.max_tension_N = random.uniform(15, 60);
    }
    const Pose pose{random.rotation(0.7), random.vector(2.5)};
    const Task task = task_of(m, pose);
    const double within = margin(task, true), positive = margin(task, false);
    if (std::min(std::abs(within), std::abs(positive)) < 1e-6) {
      ++verges;
      continue;
    }
    const Balance expected = within > 0 ? Balance::controlled : positive > 0 ? Balance::loose : Balance::unbalanced;
    const Tensions found = tensions(m, pose);
    ++seen[int(expected)];
    ASSERT_EQ(found.balance, expected) << k << ' ' << within << ' ' << positive << ' ' << found.smallest_singular;
    ASSERT_EQ(static_test(m, pose), expected);
    if (expected == Balance::unbalanced) {
      ASSERT_GT(found.residual_N, 1e-7);
      ASSERT_GE(found.tension_N.minCoeff(), 0);
      continue;
    }
    ASSERT_LT(found.residual_N, 1e-6);
    redundant += cables > 6;
    if (k % 4 < 2) continue;  // a quarter of a second for some of them
    const double best = least_norm(task, expected == Balance::controlled);
    ASSERT_NEAR(found.tension_N.squaredNorm(), best, 1e-6 * best) << k;
  }
  std::printf("controlled %d, loose %d, unbalanced %d, on the verge %d\n", seen[0], seen[1], seen[3], verges);
  EXPECT_GT(seen[int(Balance::controlled)], 300);
  EXPECT_GT(seen[int(Balance::loose)], 300);
  EXPECT_GT(seen[int(Balance::unbalanced)], 300);
  EXPECT_GT(redundant, 500);
}

}  // namespace
}  // namespace lumihull::capture
