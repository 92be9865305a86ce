// Resection against OpenCV's solvers on the same points in the same run: CPU time, and error over the bound.
//
// Error over the bound: sqrt(mean Mahalanobis² / 6) of the pose against its truth, in the metric of the Cramér-Rao
// bound (the inverse Fisher information at the truth): 1 is the best an unbiased estimator can do.
#include <lumihull/calib/resect.h>

#include <Eigen/Dense>
#include <cstdio>
#include <ctime>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "../calib/lens/resect_scenes.h"

namespace {

using lumihull::Pose;
using lumihull::calib::PointMatch;
using lumihull::calib::Resection;
using lumihull::test::ResectScene;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kNoise = 0.1;

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

struct Job {
  ResectScene scene;
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> pixels;
  Matrix6 information = Matrix6::Zero();  // at the truth
};

Job make_job(std::uint64_t seed, int points, bool planar) {
  Job job;
  ResectScene& s = job.scene =
      lumihull::test::resect_scene(seed, {.points = points, .planar = planar, .distorted = false});
  s.camera.skew = 0;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, kNoise);
  for (PointMatch& m : s.matches) {
    const Eigen::Vector3d p = s.cam_from_world * m.world;
    lumihull::Matrix23d by_point;
    m.pixel = *s.camera.project(p, &by_point) + Eigen::Vector2d(noise(random), noise(random));
    m.covariance = kNoise * kNoise * Eigen::Matrix2d::Identity();
    Eigen::Matrix<double, 3, 6> motion;
    motion << 0, p.z(), -p.y(), 1, 0, 0, -p.z(), 0, p.x(), 0, 1, 0, p.y(), -p.x(), 0, 0, 0, 1;
    const Eigen::Matrix<double, 2, 6> j = by_point * motion / kNoise;
    job.information += j.transpose() * j;
    job.world.push_back({m.world.x(), m.world.y(), m.world.z()});
    job.pixels.push_back({m.pixel.x() - 0.5, m.pixel.y() - 0.5});
  }
  return job;
}

struct Result {
  double milliseconds = 0, ratio = 0;
  int failed = 0;
};

Result measure(const std::vector<Job>& jobs, const std::function<Pose(const Job&)>& solve) {
  Result result;
  std::vector<Pose> poses;
  solve(jobs[0]);
  const double start = cpu_seconds();
  for (const Job& job : jobs) poses.push_back(solve(job));
  result.milliseconds = 1e3 * (cpu_seconds() - start) / double(jobs.size());
  int good = 0;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const Vector6 m = lumihull::test::motion_between(poses[i], jobs[i].scene.cam_from_world);
    const double d2 = m.dot(jobs[i].information * m);
    if (!(d2 < 1e4)) {  // a wrong pose, not an inexact one
      ++result.failed;
      continue;
    }
    ++good, result.ratio += d2;
  }
  result.ratio = std::sqrt(result.ratio / (6 * good));
  return result;
}

Pose solve_with_opencv(const Job& job, int method) {
  const lumihull::Camera& c = job.scene.camera;
  const cv::Mat k = (cv::Mat_<double>(3, 3) << c.s * c.f, 0, c.u0 - 0.5, 0, c.f, c.v0 - 0.5, 0, 0, 1);
  cv::Mat rotation, translation, r;
  if (!cv::solvePnP(job.world, job.pixels, k, cv::noArray(), rotation, translation, false, method)) return {};
  cv::Rodrigues(rotation, r);
  Eigen::Matrix3d m;
  for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = r.at<double>(i / 3, i % 3);
  return Pose::from_matrix(m, {translation.at<double>(0), translation.at<double>(1), translation.at<double>(2)});
}

}  // namespace

int main() {
  cv::setNumThreads(1);
  std::printf("%-8s %6s  %-22s %9s %8s %7s\n", "body", "points", "solver", "ms (CPU)", "/ bound", "failed");
  for (const bool planar : {false, true})
    for (const int points : {6, 20, 200, 1000}) {
      std::vector<Job> jobs;
      for (int i = 0; i < (points > 500 ? 300 : 1000); ++i) jobs.push_back(make_job(std::uint64_t(i), points, planar));
      const auto row = [&](const char* name, const std::function<Pose(const Job&)>& solve) {
        const Result r = measure(jobs, solve);
        std::printf("%-8s %6d  %-22s %9.4f %8.3f %7d\n", planar ? "plane" : "space", points, name, r.milliseconds,
                    r.ratio, r.failed);
      };
      row("resect", [](const Job& j) { return resect(j.scene.camera, j.scene.matches).cam_from_world; });
      row("resect, through a lens", [](const Job& j) {  // a lens that distorts by nothing, to the same points
        lumihull::Camera camera = j.scene.camera;
        camera.k1 = 1e-12;
        return resect(camera, j.scene.matches).cam_from_world;
      });
      row("resect, not robust",
          [](const Job& j) { return resect(j.scene.camera, j.scene.matches, {.robust = false}).cam_from_world; });
      row("OpenCV iterative", [](const Job& j) { return solve_with_opencv(j, cv::SOLVEPNP_ITERATIVE); });
      row("OpenCV SQPnP", [](const Job& j) { return solve_with_opencv(j, cv::SOLVEPNP_SQPNP); });
      row("OpenCV EPnP", [](const Job& j) { return solve_with_opencv(j, cv::SOLVEPNP_EPNP); });
    }
}
