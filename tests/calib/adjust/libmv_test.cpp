// Real problems with another camera model, by the same solver.
#include <cstdio>

#include "adjust/levenberg_marquardt.h"
#include "libmv_problem.h"
#include "support.h"

namespace lumihull {
namespace {

using namespace calib::bundle;

struct Stored {
  const char* file;
  double rms;  ///< of the state in the file, px
};

TEST(Libmv, StoredAnswersOrBetter) {
  LUMIHULL_NEED_REAL_DATA(folder, "bundle/libmv-ba-problems");
  for (const Stored& stored : {Stored{"problem_01.bin", 1.30}, {"problem_02.bin", 0.79}, {"problem_03.bin", 0.31}})
    for (const bool free_lens : {false, true}) {
      SCOPED_TRACE(stored.file);
      test::LibmvProblem problem(folder / stored.file, free_lens);
      NormalEquations equations(problem);
      Job job({}, 2);
      const double before = problem.rms_px();
      const auto start = equations.linearize(problem, job);
      ASSERT_TRUE(start);
      const MinimizeResult result = minimize(problem, equations, *start, {.max_iterations = 100}, job);
      std::printf("%s: %zu cameras, %zu points, %zu markers, lens %s: %.4f -> %.4f px, %d iterations\n", stored.file,
                  problem.cameras(), problem.points(), problem.markers().size(), free_lens ? "free" : "fixed", before,
                  problem.rms_px(), result.iterations);
      EXPECT_TRUE(result.converged);
      EXPECT_LE(problem.rms_px(), stored.rms + 0.005);
      EXPECT_LE(problem.rms_px(), before);
    }
}

}  // namespace
}  // namespace lumihull
