// Refitting lens models; see lens_models.h. Models: OpenCV's documentation of calib3d ("Detailed Description") and of
// its fisheye namespace; COLMAP's models are special cases of these two.

#include "lens_models.h"

#include <lumihull/base/error.h>

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

namespace lumihull::internal {

using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

Vector2d ForwardCamera::project(const Vector2d& ray) const {
  double x = ray.x(), y = ray.y();
  const double r2 = x * x + y * y;
  if (lens == Lens::opencv) {
    const double radial = (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]))) / (1 + r2 * (k[3] + r2 * (k[4] + r2 * k[5])));
    const double xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    x = xd;
  } else if (lens == Lens::fisheye && r2 > 0) {
    const double r = std::sqrt(r2), theta = std::atan(r), t2 = theta * theta;
    const double scale = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])))) / r;
    x *= scale;
    y *= scale;
  }
  return {fx * x + cx, fy * y + cy};
}

namespace {

/// d project / d ray by central differences: refits need no more, and one formula serves every model.
Matrix2d slope(const ForwardCamera& camera, const Vector2d& ray) {
  const double h = 1e-6 * std::max(1.0, ray.norm());
  Matrix2d j;
  for (int i = 0; i < 2; ++i) {
    Vector2d step = Vector2d::Zero();
    step(i) = h;
    j.col(i) = (camera.project(ray + step) - camera.project(ray - step)) / (2 * h);
  }
  return j;
}

}  // namespace

std::optional<Vector2d> ForwardCamera::ray(const Vector2d& pixel) const {
  const Vector2d d((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (lens == Lens::none) return d;
  // From the axis outwards along the picture: the branch that contains the principal point, and no other, is followed.
  Vector2d ray = Vector2d::Zero();
  const int steps = 1 + int(std::min(20.0, 8 * d.norm()));
  for (int step = 1; step <= steps; ++step) {
    const Vector2d center(cx, cy), target = center + (pixel - center) * (double(step) / steps);
    double error = (project(ray) - target).norm();
    for (int i = 0; i < 30 && error > 1e-10; ++i) {
      const Matrix2d j = slope(*this, ray);
      if (!(j.determinant() > 1e-6 * fx * fy)) return std::nullopt;
      const Vector2d delta = j.inverse() * (target - project(ray));
      double part = 1;
      while (part > 1e-3 && !((project(ray + part * delta) - target).norm() < error)) part /= 2;
      if (part <= 1e-3) break;
      ray += part * delta;
      error = (project(ray) - target).norm();
    }
    if (!(error < 1e-6) || !ray.allFinite()) return std::nullopt;
  }
  return slope(*this, ray).determinant() > 0 ? std::optional(ray) : std::nullopt;
}

namespace {

/// Pixels of a grid over the whole picture, its border included.
std::vector<Vector2d> grid(int width, int height, int columns, int rows) {
  std::vector<Vector2d> pixels;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x)
      pixels.emplace_back(width * double(x) / (columns - 1), height * double(y) / (rows - 1));
  return pixels;
}

constexpr int kFitColumns = 33, kFitRows = 25, kCheckColumns = 65, kCheckRows = 49;

/// Levenberg-Marquardt with a Jacobian by central differences. `residuals` returns false where the parameters make no
/// sense; it ends when a step gains less than `least_gain` of the cost. Small problems only: about 10 parameters, 1000
/// residuals.
void minimise(const std::function<bool(const VectorXd&, VectorXd&)>& residuals, VectorXd& parameters,
              const VectorXd& scale, double least_gain) {
  VectorXd r, plus, minus;
  if (!residuals(parameters, r)) return;
  double cost = r.squaredNorm(), damping = 1e-6;
  const Eigen::Index n = parameters.size();
  for (int iteration = 0; iteration < 60; ++iteration) {
    MatrixXd j(r.size(), n);
    for (Eigen::Index i = 0; i < n; ++i) {
      VectorXd p = parameters;
      const double h = 1e-5 * scale(i);
      p(i) = parameters(i) + h;
      const bool good = residuals(p, plus);
      p(i) = parameters(i) - h;
      if (!good || !residuals(p, minus)) return;
      j.col(i) = (plus - minus) / (2 * h) * scale(i);
    }
    const MatrixXd normal = j.transpose() * j;
    const VectorXd gradient = j.transpose() * r;
    bool better = false;
    double gain = 0;
    for (int attempt = 0; attempt < 12 && !better; ++attempt) {
      MatrixXd damped = normal;
      damped.diagonal() += damping * normal.diagonal() + VectorXd::Constant(n, 1e-300);
      const VectorXd step = damped.ldlt().solve(-gradient).cwiseProduct(scale);
      const VectorXd next = parameters + step;
      if (step.allFinite() && residuals(next, plus) && plus.squaredNorm() < cost) {
        gain = cost - plus.squaredNorm();
        cost = plus.squaredNorm();
        parameters = next;
        r = plus;
        damping = std::max(damping / 10, 1e-12);
        better = true;
      } else {
        damping *= 10;
      }
    }
    if (!better || gain < least_gain * cost || cost < 1e-18) return;
  }
}

/// Least squares first, then the eighth powers of the samples' distances: a refit is judged by its largest error, which
/// least squares alone leaves in the picture's corners. Residuals: u, v, u, v, …
void minimise_largest(const std::function<bool(const VectorXd&, VectorXd&)>& residuals, VectorXd& parameters,
                      const VectorXd& scale) {
  minimise(residuals, parameters, scale, 1e-9);
  const auto largest = [&](const VectorXd& p) {
    VectorXd r;
    return residuals(p, r) ? Eigen::Map<const Eigen::Matrix2Xd>(r.data(), 2, r.size() / 2).colwise().norm().maxCoeff()
                           : INFINITY;
  };
  const double unit = largest(parameters);
  if (!(unit > 1e-4) || !std::isfinite(unit)) return;
  VectorXd polished = parameters;
  minimise(
      [&](const VectorXd& p, VectorXd& r) {
        if (!residuals(p, r)) return false;
        for (Eigen::Index i = 0; i < r.size(); i += 2) r.segment<2>(i) *= std::pow(r.segment<2>(i).norm() / unit, 3);
        return true;
      },
      polished, scale, 1e-3);
  if (largest(polished) < unit) parameters = polished;
}

std::string px(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g px", value);
  return text;
}

std::string size_text(double share) { return std::to_string(int(std::lround(100 * share))) + " %"; }

}  // namespace

Refit refit_camera(const ForwardCamera& theirs, double limit_px, const std::string& name) {
  Camera camera;
  camera.width = theirs.width;
  camera.height = theirs.height;
  camera.f = theirs.fy;
  camera.s = theirs.fx / theirs.fy;
  camera.u0 = theirs.cx;
  camera.v0 = theirs.cy;
  camera.validate();
  if (theirs.lens == ForwardCamera::Lens::none) return {camera, 0};

  struct Sample {
    Vector2d pixel;
    Eigen::Vector3d ray;
  };
  const auto samples_of = [&](int columns, int rows) {
    std::vector<Sample> samples;
    std::size_t lost = 0;
    for (const Vector2d& pixel : grid(theirs.width, theirs.height, columns, rows)) {
      const auto ray = theirs.ray(pixel);
      if (ray)
        samples.push_back({pixel, ray->homogeneous()});
      else
        ++lost;
    }
    if (lost > 0)
      throw Error(ErrorCode::unsupported,
                  "its lens model has no unique ray for " + size_text(double(lost) / double(samples.size() + lost)) +
                      " of the picture (at the border): it can't be refitted",
                  name);
    return samples;
  };
  const std::vector<Sample> samples = samples_of(kFitColumns, kFitRows);

  // Start: K as it is, and the polynomial by linear least squares: corrected - distorted = F(distorted).
  {
    MatrixXd a(2 * samples.size(), 5);
    VectorXd b(2 * samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Vector2d d = camera.distorted_from_pixel(samples[i].pixel);
      const double x = d.x(), y = d.y(), r2 = d.squaredNorm();
      const Eigen::Index row = 2 * Eigen::Index(i);
      a.row(row) << x * r2, x * r2 * r2, x * r2 * r2 * r2, 2 * x * y, r2 + 2 * x * x;
      a.row(row + 1) << y * r2, y * r2 * r2, y * r2 * r2 * r2, r2 + 2 * y * y, 2 * x * y;
      b.segment<2>(row) = samples[i].ray.head<2>() - d;
    }
    const VectorXd start = a.colPivHouseholderQr().solve(b);
    camera.k1 = start(0);
    camera.k2 = start(1);
    camera.k3 = start(2);
    camera.p1 = start(3);
    camera.p2 = start(4);
  }
  const auto unpack = [&](const VectorXd& p) {
    Camera c = camera;
    c.f = p(0);
    c.s = p(1);
    c.u0 = p(2);
    c.v0 = p(3);
    c.k1 = p(4);
    c.k2 = p(5);
    c.k3 = p(6);
    c.p1 = p(7);
    c.p2 = p(8);
    return c;
  };
  VectorXd parameters(9), scale(9);
  parameters << camera.f, camera.s, camera.u0, camera.v0, camera.k1, camera.k2, camera.k3, camera.p1, camera.p2;
  scale << camera.f, 1, camera.f, camera.f, 1, 1, 1, 1, 1;
  minimise_largest(
      [&](const VectorXd& p, VectorXd& r) {
        const Camera c = unpack(p);
        if (!(c.f > 0) || !(c.s > 0)) return false;
        r.resize(2 * Eigen::Index(samples.size()));
        for (std::size_t i = 0; i < samples.size(); ++i) {
          const auto pixel = c.project(samples[i].ray);
          if (!pixel) return false;
          r.segment<2>(2 * Eigen::Index(i)) = *pixel - samples[i].pixel;
        }
        return true;
      },
      parameters, scale);
  Refit refit{unpack(parameters), 0};
  for (const Sample& sample : samples_of(kCheckColumns, kCheckRows)) {
    const auto pixel = refit.camera.project(sample.ray);
    const double error = pixel ? (*pixel - sample.pixel).norm() : INFINITY;
    refit.largest_error_px = std::max(refit.largest_error_px, error);
  }
  if (!(refit.largest_error_px <= limit_px))
    throw Error(ErrorCode::unsupported,
                "its lens can't be expressed by Heikkilä's model: pixels would move by up to " +
                    px(refit.largest_error_px) + ", allowed are " + px(limit_px),
                name);
  refit.camera.validate();
  return refit;
}

std::string refit_note(int camera, const Refit& refit) {
  return "camera " + std::to_string(camera) + ": its lens was refitted to Heikkilä's model; largest error " +
         px(refit.largest_error_px);
}

ForwardRefit refit_forward(const Camera& camera, int terms, const std::string& name) {
  ForwardCamera theirs;
  theirs.width = camera.width;
  theirs.height = camera.height;
  theirs.fx = camera.s * camera.f;
  theirs.fy = camera.f;
  theirs.cx = camera.u0;
  theirs.cy = camera.v0;
  if (!camera.has_distortion() && camera.skew == 0) return {theirs, 0};
  if (terms > 0) theirs.lens = ForwardCamera::Lens::opencv;

  const auto rays_of = [&](const std::vector<Vector2d>& pixels) {
    std::vector<Vector2d> rays;
    for (const Vector2d& pixel : pixels) {
      const auto ray = camera.ray(pixel);
      if (!ray) throw Error(ErrorCode::unsupported, "the camera's lens model does not cover its whole picture", name);
      rays.push_back(ray->head<2>());
    }
    return rays;
  };
  const std::vector<Vector2d> pixels = grid(camera.width, camera.height, kFitColumns, kFitRows), rays = rays_of(pixels);
  const auto unpack = [&](const VectorXd& p) {
    ForwardCamera c = theirs;
    c.fx = p(0);
    c.fy = p(1);
    c.cx = p(2);
    c.cy = p(3);
    if (terms > 0) {
      c.p1 = p(4);
      c.p2 = p(5);
      for (int i = 0; i < terms; ++i) c.k[i] = p(6 + i);
    }
    return c;
  };
  const Eigen::Index n = terms > 0 ? 6 + terms : 4;
  VectorXd parameters = VectorXd::Zero(n), scale = VectorXd::Ones(n);
  parameters.head<4>() << theirs.fx, theirs.fy, theirs.cx, theirs.cy;
  scale.head<4>().setConstant(camera.f);
  // A start by the inverse series' first terms keeps the polynomial's sign right; the rest is for the fit.
  if (terms > 0) {
    parameters(4) = -camera.p1;
    parameters(5) = -camera.p2;
    parameters(6) = -camera.k1;
    parameters(7) = 3 * camera.k1 * camera.k1 - camera.k2;
  }
  minimise_largest(
      [&](const VectorXd& p, VectorXd& r) {
        const ForwardCamera c = unpack(p);
        r.resize(2 * Eigen::Index(rays.size()));
        for (std::size_t i = 0; i < rays.size(); ++i)
          r.segment<2>(2 * Eigen::Index(i)) = c.project(rays[i]) - pixels[i];
        return bool(r.allFinite());
      },
      parameters, scale);
  ForwardRefit refit{unpack(parameters), 0};
  const std::vector<Vector2d> check = grid(camera.width, camera.height, kCheckColumns, kCheckRows),
                              seen = rays_of(check);
  for (std::size_t i = 0; i < check.size(); ++i) {
    const double error = (refit.camera.project(seen[i]) - check[i]).norm();
    refit.largest_error_px = std::max(refit.largest_error_px, std::isfinite(error) ? error : INFINITY);
  }
  return refit;
}

ForwardRefit simplest_refit(const Camera& camera, std::initializer_list<int> terms, double limit_px,
                            const std::string& name) {
  constexpr double kGoodEnough_px = 0.01;
  camera.validate();
  ForwardRefit best;
  best.largest_error_px = INFINITY;
  for (const int n : terms) {
    ForwardRefit refit = refit_forward(camera, n, name);
    if (refit.largest_error_px < best.largest_error_px) best = refit;
    if (best.largest_error_px <= kGoodEnough_px) break;
  }
  if (best.largest_error_px <= limit_px) return best;
  const std::string lost = camera.skew != 0 ? "its skew of " + std::to_string(camera.skew) + " px" : "its lens";
  throw Error(ErrorCode::unsupported,
              "the format can't express " + lost + ": pixels would move by up to " + px(best.largest_error_px), name);
}

}  // namespace lumihull::internal
