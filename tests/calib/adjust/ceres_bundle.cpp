#include "ceres_bundle.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <memory>

namespace lumihull::test {
namespace {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// Angle-axis and translation.
using Motion = std::array<double, 6>;

Motion motion_of(const Pose& pose) {
  Motion m;
  const Eigen::Quaterniond& q = pose.rotation;
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  ceres::QuaternionToAngleAxis(wxyz, m.data());
  for (int i = 0; i < 3; ++i) m[std::size_t(3 + i)] = pose.translation[i];
  return m;
}

Pose pose_of(const Motion& m) {
  double wxyz[4];
  ceres::AngleAxisToQuaternion(m.data(), wxyz);
  return {Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]), Eigen::Vector3d(m[3], m[4], m[5])};
}

template <class T>
Vector3<T> moved(const T* motion, const Vector3<T>& x) {
  Vector3<T> y;
  ceres::AngleAxisRotatePoint(motion, x.data(), y.data());
  return y + Vector3<T>(motion[3], motion[4], motion[5]);
}

template <class T>
Vector3<T> turned(const T* motion, const Vector3<T>& x) {
  Vector3<T> y;
  ceres::AngleAxisRotatePoint(motion, x.data(), y.data());
  return y;
}

/// Heikkilä's lens, inverted by a fixed number of Newton steps. lens: f, s, skew, u0, v0, k1, k2, k3, p1, p2.
template <class T>
void seen(const T* lens, const T& cx, const T& cy, T* pixel) {
  T x = cx, y = cy;
  for (int i = 0; i < 8; ++i) {
    const T r2 = x * x + y * y, radial = r2 * (lens[5] + r2 * (lens[6] + r2 * lens[7]));
    const T slope = 2.0 * (lens[5] + r2 * (2.0 * lens[6] + r2 * 3.0 * lens[7]));
    const T hx = x + x * radial + 2.0 * lens[8] * x * y + lens[9] * (r2 + 2.0 * x * x) - cx;
    const T hy = y + y * radial + lens[8] * (r2 + 2.0 * y * y) + 2.0 * lens[9] * x * y - cy;
    const T a = 1.0 + radial + x * x * slope + 2.0 * lens[8] * y + 6.0 * lens[9] * x;
    const T d = 1.0 + radial + y * y * slope + 6.0 * lens[8] * y + 2.0 * lens[9] * x;
    const T b = x * y * slope + 2.0 * lens[8] * x + 2.0 * lens[9] * y;
    const T determinant = a * d - b * b;
    x = x - (d * hx - b * hy) / determinant;
    y = y - (a * hy - b * hx) / determinant;
  }
  pixel[0] = lens[1] * lens[0] * x + lens[2] * y + lens[3];
  pixel[1] = lens[0] * y + lens[4];
}

/// Σ^(-1/2), the symmetric root: not the library's choice, the same squares.
Eigen::Matrix2d root_of_inverse(const Eigen::Matrix2d& covariance) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance).operatorInverseSqrt();
}

template <class T>
bool residual(const Pose& rig_offset, bool on_rig, const T* lens, const T* shot, const T* rig, const Vector3<T>& world,
              const Vector3<T>& normal, const T& radius, const Eigen::Vector2d& pixel, const Eigen::Matrix2d& weight,
              T* out) {
  Vector3<T> x = moved(shot, world), n = turned(shot, normal);
  if (on_rig) {
    x = moved(rig, x), n = turned(rig, n);
  } else {
    x = rig_offset.rotation.toRotationMatrix().cast<T>() * x + rig_offset.translation.cast<T>();
    n = rig_offset.rotation.toRotationMatrix().cast<T>() * n;
  }
  // The ellipse's centre from the dual conic B = X Xᵀ - R² (1 - n nᵀ), where nothing distorts.
  const Vector3<T> third = x * x.z() - radius * radius * (Vector3<T>(T(0), T(0), T(1)) - n * n.z());
  T predicted[2];
  seen(lens, T(third.x() / third.z()), T(third.y() / third.z()), predicted);
  const Eigen::Matrix<T, 2, 1> off(predicted[0] - pixel.x(), predicted[1] - pixel.y());
  Eigen::Map<Eigen::Matrix<T, 2, 1>>{out} = weight.cast<T>() * off;
  return true;
}

struct Common {
  Pose rig_offset;
  bool on_rig = false;
  Eigen::Vector2d pixel;
  Eigen::Matrix2d weight;
  calib::BodyPoint point;
  Eigen::Vector3d middle;  ///< of the body's points
};

template <class T>
Vector3<T> in_body(const Eigen::Vector3d& place, const Eigen::Vector3d& middle, const T* bend, const T* print) {
  const T x = print[0] * (place.x() - middle.x()), y = print[1] * (place.y() - middle.y());
  return {print[0] * place.x(), print[1] * place.y(), place.z() + bend[0] * x * x + bend[1] * x * y + bend[2] * y * y};
}

struct PatternCost {
  Common c;
  template <class T>
  bool operator()(const T* lens, const T* shot, const T* rig, const T* body, const T* bend, const T* print,
                  T* out) const {
    const Vector3<T> world = moved(body, in_body(c.point.place, c.middle, bend, print));
    const Vector3<T> normal = turned(body, Vector3<T>(c.point.normal.cast<T>()));
    return residual(c.rig_offset, c.on_rig, lens, shot, rig, world, normal,
                    T(c.point.radius * 0.5 * (print[0] + print[1])), c.pixel, c.weight, out);
  }
};

struct FreeCost {
  Common c;
  Eigen::Vector3d normal;
  template <class T>
  bool operator()(const T* lens, const T* shot, const T* rig, const T* place, T* out) const {
    return residual(c.rig_offset, c.on_rig, lens, shot, rig, Vector3<T>(place[0], place[1], place[2]),
                    Vector3<T>(normal.cast<T>()), T(c.point.radius), c.pixel, c.weight, out);
  }
};

struct FreeBar {
  double length, sigma;
  template <class T>
  bool operator()(const T* a, const T* b, T* out) const {
    out[0] = ((Eigen::Map<const Vector3<T>>(a) - Eigen::Map<const Vector3<T>>(b)).norm() - length) / sigma;
    return true;
  }
};

struct PatternBar {
  double length, sigma;
  Eigen::Vector3d a, middle_a, b, middle_b;
  template <class T>
  bool operator()(const T* body_a, const T* bend_a, const T* body_b, const T* bend_b, const T* print, T* out) const {
    out[0] = ((moved(body_a, in_body(a, middle_a, bend_a, print)) - moved(body_b, in_body(b, middle_b, bend_b, print)))
                  .norm() -
              length) /
             sigma;
    return true;
  }
};

struct BendCost {
  double sigma;
  template <class T>
  bool operator()(const T* bend, T* out) const {
    for (int i = 0; i < 3; ++i) out[i] = bend[i] / sigma;
    return true;
  }
};

struct Unknowns {
  std::vector<std::array<double, 10>> lenses;
  std::vector<Motion> shots, rigs, bodies;
  std::vector<Eigen::Vector3d> bends, middles;
  std::vector<std::vector<Eigen::Vector3d>> places;
  Eigen::Vector2d print;
};

Unknowns unknowns_of(const calib::Adjustment& a) {
  Unknowns x;
  for (const auto& c : a.cameras) {
    const Camera& k = c.camera;
    x.lenses.push_back({k.f, k.s, k.skew, k.u0, k.v0, k.k1, k.k2, k.k3, k.p1, k.p2});
    x.rigs.push_back(motion_of(c.cam_from_rig));
  }
  for (const auto& s : a.shots) x.shots.push_back(motion_of(s.rig_from_world));
  for (const auto& b : a.bodies) {
    x.bodies.push_back(motion_of(b.world_from_body));
    x.bends.push_back(b.bend);
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto& point : b.points) middle += point.place / double(b.points.size());
    x.middles.push_back(middle);
    x.places.emplace_back();
    for (std::size_t i = 0; i < b.points.size(); ++i) x.places.back().push_back(b.point(i));
  }
  x.print = a.print_scale;
  return x;
}

void store(const Unknowns& x, calib::Adjustment& a) {
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    Camera& k = a.cameras[c].camera;
    const auto& l = x.lenses[c];
    k.f = l[0], k.s = l[1], k.skew = l[2], k.u0 = l[3], k.v0 = l[4];
    k.k1 = l[5], k.k2 = l[6], k.k3 = l[7], k.p1 = l[8], k.p2 = l[9];
    if (a.cameras[c].on_rig) a.cameras[c].cam_from_rig = pose_of(x.rigs[c]);
  }
  for (std::size_t s = 0; s < a.shots.size(); ++s) a.shots[s].rig_from_world = pose_of(x.shots[s]);
  for (std::size_t b = 0; b < a.bodies.size(); ++b) {
    if (a.bodies[b].model == calib::BodyModel::free) {
      a.bodies[b].free_places = x.places[b];
      continue;
    }
    a.bodies[b].world_from_body = pose_of(x.bodies[b]);
    a.bodies[b].bend = x.bends[b];
  }
  a.print_scale = x.print;
}

void add_observations(const calib::Adjustment& a, Unknowns& x, ceres::LossFunction* loss, ceres::Problem& problem) {
  for (const calib::Observation& o : a.observations) {
    const calib::AdjustedBody& body = a.bodies[o.body];
    const calib::AdjustedCamera& camera = a.cameras[o.camera];
    const Common common{camera.cam_from_rig,           camera.on_rig,        o.pixel,
                        root_of_inverse(o.covariance), body.points[o.point], x.middles[o.body]};
    double* lens = x.lenses[o.camera].data();
    double* shot = x.shots[o.shot].data();
    double* rig = x.rigs[o.camera].data();
    if (body.model == calib::BodyModel::free) {
      auto* cost = new ceres::AutoDiffCostFunction<FreeCost, 2, 10, 6, 6, 3>(
          new FreeCost{common, body.world_from_body.rotation * common.point.normal});
      problem.AddResidualBlock(cost, loss, lens, shot, rig, x.places[o.body][o.point].data());
    } else {
      auto* cost = new ceres::AutoDiffCostFunction<PatternCost, 2, 10, 6, 6, 6, 3, 2>(new PatternCost{common});
      problem.AddResidualBlock(cost, loss, lens, shot, rig, x.bodies[o.body].data(), x.bends[o.body].data(),
                               x.print.data());
    }
  }
}

void add_bars_and_bends(const calib::Adjustment& a, Unknowns& x, double bend_sigma, ceres::Problem& problem) {
  for (const calib::ScaleBar& bar : a.bars) {
    const calib::AdjustedBody &body_a = a.bodies[bar.body_a], &body_b = a.bodies[bar.body_b];
    if (body_a.model == calib::BodyModel::free) {
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<FreeBar, 1, 3, 3>(new FreeBar{bar.length_m, bar.sigma_m}), nullptr,
          x.places[bar.body_a][bar.point_a].data(), x.places[bar.body_b][bar.point_b].data());
      continue;
    }
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PatternBar, 1, 6, 3, 6, 3, 2>(new PatternBar{
                                 bar.length_m, bar.sigma_m, body_a.points[bar.point_a].place, x.middles[bar.body_a],
                                 body_b.points[bar.point_b].place, x.middles[bar.body_b]}),
                             nullptr, x.bodies[bar.body_a].data(), x.bends[bar.body_a].data(),
                             x.bodies[bar.body_b].data(), x.bends[bar.body_b].data(), x.print.data());
  }
  for (std::size_t b = 0; b < a.bodies.size(); ++b)
    if (a.bodies[b].model == calib::BodyModel::bending)
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<BendCost, 3, 3>(new BendCost{bend_sigma}), nullptr,
                               x.bends[b].data());
}

void hold_what_is_fixed(const calib::Adjustment& a, Unknowns& x, ceres::Problem& problem) {
  const auto hold = [&](double* block) {
    if (problem.HasParameterBlock(block)) problem.SetParameterBlockConstant(block);
  };
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    std::vector<int> fixed;
    for (int i = 0; i < calib::kIntrinsics; ++i)
      if (!a.cameras[c].free[std::size_t(i)]) fixed.push_back(i);
    if (fixed.size() == calib::kIntrinsics)
      hold(x.lenses[c].data());
    else if (!fixed.empty())
      problem.SetManifold(x.lenses[c].data(), new ceres::SubsetManifold(calib::kIntrinsics, fixed));
    if (!a.cameras[c].on_rig) hold(x.rigs[c].data());
  }
  for (std::size_t b = 0; b < a.bodies.size(); ++b)
    if (a.bodies[b].model != calib::BodyModel::bending) hold(x.bends[b].data());
  if (!a.free_print_scale) hold(x.print.data());
}

}  // namespace

CeresAnswer adjust_by_ceres(const calib::Adjustment& start, const calib::AdjustOptions& options,
                            const CeresOptions& ceres_options) {
  Unknowns x = unknowns_of(start);
  std::unique_ptr<ceres::LossFunction> loss;
  if (options.robust_sigma > 0) loss = std::make_unique<ceres::CauchyLoss>(options.robust_sigma);
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  add_observations(start, x, loss.get(), problem);
  add_bars_and_bends(start, x, options.bend_sigma, problem);
  hold_what_is_fixed(start, x, problem);

  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres_options.schur == CeresSchur::dense ? ceres::DENSE_SCHUR : ceres::ITERATIVE_SCHUR;
  if (ceres_options.schur == CeresSchur::iterative) solver.preconditioner_type = ceres::SCHUR_JACOBI;
  solver.max_num_iterations = ceres_options.max_iterations;
  solver.function_tolerance = ceres_options.tolerance;
  solver.gradient_tolerance = 1e-16;
  solver.parameter_tolerance = 1e-16;
  solver.num_threads = ceres_options.threads;
  solver.logging_type = ceres::SILENT;
  solver.minimizer_progress_to_stdout = !ceres_options.silent;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  CeresAnswer answer;
  answer.adjusted = start;
  store(x, answer.adjusted);
  answer.start_cost = 2 * summary.initial_cost, answer.cost = 2 * summary.final_cost;
  answer.iterations = int(summary.iterations.size());
  return answer;
}

}  // namespace lumihull::test
