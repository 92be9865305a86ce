// The one file that includes Ceres.

#include "refine_lens.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <memory>

namespace lumihull::calib::lens {
namespace {

/// A pose as seven numbers: quaternion x, y, z, w, translation.
Pose loaded(const double* x) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(x)), Eigen::Vector3d(x[4], x[5], x[6])};
}

void store(const Pose& pose, double* x) {
  const Eigen::Vector4d& q = pose.rotation.coeffs();
  std::copy_n(q.data(), 4, x);
  std::copy_n(pose.translation.data(), 3, x + 4);
}

/// Poses are 7 numbers, changed by 6: a small motion in the camera's frame. Cost functions write derivatives by that
/// motion into the first six columns, so that PlusJacobian only has to pick these.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    using Map = Eigen::Map<const Eigen::Matrix<double, 6, 1>>;
    const Pose next = moved(loaded(x), Map(delta));
    store(next, x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>{jacobian}.setIdentity();
    return true;
  }
  // Only needed for solution covariances in ambient space, which nobody asks for.
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};

class PointCost final : public ceres::SizedCostFunction<2, kIntrinsics, 7> {
 public:
  PointCost(const Camera& frame, const BoardMatch& match)
      : frame_(frame), match_(match), whiten_(whitening(match.covariance)) {}

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    Camera camera = frame_;
    set_parameters(camera, Eigen::Map<const Vector10d>(x[0]));
    if (!(camera.f > 0) || !(camera.s > 0)) return false;
    const Pose pose = loaded(x[1]);
    Eigen::Vector2d pixel;
    Matrix2x10d by_camera;
    Matrix26d by_pose;
    double* to_camera = jacobians ? jacobians[0] : nullptr;
    double* to_pose = jacobians ? jacobians[1] : nullptr;
    if (!predict(camera, pose, match_, &pixel, to_camera ? &by_camera : nullptr, to_pose ? &by_pose : nullptr))
      return false;
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = whiten_ * (pixel - match_.pixel);
    if (to_camera)
      Eigen::Map<Eigen::Matrix<double, 2, kIntrinsics, Eigen::RowMajor>>(to_camera, 2, kIntrinsics) =
          whiten_ * by_camera;
    if (to_pose) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> j(to_pose, 2, 7);
      j.leftCols<6>() = whiten_ * by_pose;
      j.col(6).setZero();
    }
    return true;
  }

 private:
  const Camera& frame_;
  const BoardMatch& match_;
  Eigen::Matrix2d whiten_;
};

class StopOnRequest final : public ceres::IterationCallback {
 public:
  explicit StopOnRequest(const Job& job) : job_(job) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return job_.cancelled() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const Job& job_;
};

}  // namespace

int refine_lens(Camera& camera, std::vector<FittedView>& views, const RefineOptions& options, const Job& job) {
  const Camera frame = camera;
  Vector10d intrinsics = parameters_of(camera);
  std::vector<std::array<double, 7>> poses(views.size());
  std::vector<std::unique_ptr<PointCost>> costs;
  std::unique_ptr<ceres::LossFunction> loss;
  if (options.cauchy > 0) loss = std::make_unique<ceres::CauchyLoss>(options.cauchy);
  PoseManifold on_poses;

  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();

  problem.AddParameterBlock(intrinsics.data(), kIntrinsics);
  std::vector<int> fixed;
  for (int i = 0; i < kIntrinsics; ++i)
    if (!options.free[std::size_t(i)]) fixed.push_back(i);
  std::unique_ptr<ceres::SubsetManifold> on_camera;
  if (int(fixed.size()) == kIntrinsics) {
    problem.SetParameterBlockConstant(intrinsics.data());
  } else if (!fixed.empty()) {
    on_camera = std::make_unique<ceres::SubsetManifold>(kIntrinsics, fixed);
    problem.SetManifold(intrinsics.data(), on_camera.get());
  }
  ordering->AddElementToGroup(intrinsics.data(), 1);

  for (std::size_t i = 0; i < views.size(); ++i) {
    store(views[i].cam_from_board, poses[i].data());
    problem.AddParameterBlock(poses[i].data(), 7, &on_poses);
    ordering->AddElementToGroup(poses[i].data(), 0);
    const auto& matches = views[i].view->matches;
    for (std::size_t k = 0; k < matches.size(); ++k) {
      if (!views[i].counts[k]) continue;
      costs.push_back(std::make_unique<PointCost>(frame, matches[k]));
      problem.AddResidualBlock(costs.back().get(), loss.get(), intrinsics.data(), poses[i].data());
    }
  }

  StopOnRequest stop(job);
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.linear_solver_ordering = ordering;
  solver.num_threads = 1;  // sums in one order
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.tolerance;
  solver.gradient_tolerance = 1e-16;
  solver.parameter_tolerance = 1e-14;
  solver.max_num_consecutive_invalid_steps = 30;
  solver.logging_type = ceres::SILENT;
  solver.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  job.check();
  if (!summary.IsSolutionUsable()) return 0;

  set_parameters(camera, intrinsics);
  for (std::size_t i = 0; i < views.size(); ++i) views[i].cam_from_board = loaded(poses[i].data());
  return int(summary.iterations.size());
}

}  // namespace lumihull::calib::lens
