// Centres of ellipses: the maximum-likelihood fit and the dual-conic operator beside what OpenCV offers, on the same
// pictures of known truth, against the Cramér-Rao bound of the renderer. Peers get linear light, the surroundings of
// the truth, and of each setting the one that does best on these very pictures.
//
//     bench_ellipse [samples a case = 120]

#include <lumihull/calib/ellipse.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "../calib/targets/ellipse_picture.h"

using namespace lumihull;
using calib::Ellipse;
using Eigen::Vector2d;

namespace {

double cpu_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * double(t.tv_sec) + 1e-3 * double(t.tv_nsec);
}

struct Picture {
  calib::LightPlane plane;
  cv::Mat values, bytes;  // copies: f32; 8 bits, linear
  Ellipse truth, guess;
  double inside = 0.1, outside = 0.9;
};

/// How far a place is from the true contour, as a share of the ellipse; peers look at 0.5 … 1.5 only.
double ratio_at(const Ellipse& e, const Vector2d& p) {
  const Vector2d d = p - e.center;
  return std::sqrt(d.dot(e.shape().inverse() * d));
}

std::optional<Vector2d> center_of(const std::vector<cv::Point2f>& points, bool direct = false) {
  if (points.size() < 6) return std::nullopt;
  const cv::RotatedRect box = direct ? cv::fitEllipseDirect(points) : cv::fitEllipse(points);
  if (!std::isfinite(box.center.x) || !std::isfinite(box.center.y)) return std::nullopt;
  return Vector2d(box.center.x, box.center.y);
}

cv::Mat smoothed(const cv::Mat& m, double sigma) {
  if (sigma <= 0) return m;
  cv::Mat out;
  cv::GaussianBlur(m, out, {}, sigma);
  return out;
}

/// Points on Canny's edges; sub_pixel: moved along the gradient to the top of its magnitude's parabola.
std::optional<Vector2d> canny(const Picture& picture, double sigma, bool sub_pixel) {
  const cv::Mat soft = smoothed(picture.bytes, sigma);
  cv::Mat dx, dy, edges;
  cv::Sobel(soft, dx, CV_16S, 1, 0);
  cv::Sobel(soft, dy, CV_16S, 0, 1);
  cv::Canny(dx, dy, edges, 80, 160, true);
  const auto magnitude = [&](double x, double y) {  // of the gradient, bilinear
    const int ix = int(std::floor(x)), iy = int(std::floor(y));
    if (ix < 0 || iy < 0 || ix + 1 >= dx.cols || iy + 1 >= dx.rows) return 0.0;
    const double u = x - ix, v = y - iy;
    const auto at = [&](int a, int b) { return std::hypot(double(dx.at<short>(b, a)), double(dy.at<short>(b, a))); };
    return (1 - v) * ((1 - u) * at(ix, iy) + u * at(ix + 1, iy)) +
           v * ((1 - u) * at(ix, iy + 1) + u * at(ix + 1, iy + 1));
  };
  std::vector<cv::Point2f> points;
  for (int y = 0; y < edges.rows; ++y)
    for (int x = 0; x < edges.cols; ++x) {
      if (!edges.at<std::uint8_t>(y, x)) continue;
      Vector2d p(x, y);
      const double r = ratio_at(picture.truth, p + Vector2d(0.5, 0.5));
      if (r < 0.5 || r > 1.5) continue;
      if (sub_pixel) {
        const Vector2d g = Vector2d(dx.at<short>(y, x), dy.at<short>(y, x)).normalized();
        const double before = magnitude(x - g.x(), y - g.y()), here = magnitude(x, y),
                     after = magnitude(x + g.x(), y + g.y());
        const double bend = before - 2 * here + after;
        if (bend < 0) p += g * std::clamp(0.5 * (before - after) / bend, -1.0, 1.0);
      }
      points.emplace_back(float(p.x() + 0.5), float(p.y() + 0.5));
    }
  return center_of(points);
}

/// Where the value crosses the middle of both levels, between neighbours along rows and columns.
std::optional<Vector2d> half_level(const Picture& picture, double sigma, bool direct) {
  const cv::Mat soft = smoothed(picture.values, sigma);
  const float level = float(0.5 * (picture.inside + picture.outside));
  std::vector<cv::Point2f> points;
  const auto crossing = [&](int x, int y, int x1, int y1) {
    const float a = soft.at<float>(y, x) - level, b = soft.at<float>(y1, x1) - level;
    if ((a < 0) == (b < 0)) return;
    const float t = a / (a - b);
    const Vector2d p(x + 0.5 + t * float(x1 - x), y + 0.5 + t * float(y1 - y));
    const double r = ratio_at(picture.truth, p);
    if (r > 0.5 && r < 1.5) points.emplace_back(float(p.x()), float(p.y()));
  };
  for (int y = 0; y < soft.rows; ++y)
    for (int x = 0; x < soft.cols; ++x) {
      if (x + 1 < soft.cols) crossing(x, y, x + 1, y);
      if (y + 1 < soft.rows) crossing(x, y, x, y + 1);
    }
  return center_of(points, direct);
}

/// Centroid of the darkness out to `reach` times the ellipse.
std::optional<Vector2d> moments(const Picture& picture, double reach) {
  Vector2d sum(0, 0);
  double mass = 0;
  const Ellipse& about = picture.guess;
  for (int y = 0; y < picture.values.rows; ++y)
    for (int x = 0; x < picture.values.cols; ++x) {
      const Vector2d p(x + 0.5, y + 0.5);
      const double r = (ratio_at(about, p) - 1) * about.b;  // px from the contour
      if (r > reach) continue;
      const double dark = picture.outside - double(picture.values.at<float>(y, x));
      sum += dark * p;
      mass += dark;
    }
  if (mass == 0) return std::nullopt;
  return Vector2d(sum / mass);
}

std::optional<Vector2d> blob(const Picture& picture, double step) {
  cv::SimpleBlobDetector::Params params;
  params.minThreshold = 40;
  params.maxThreshold = 220;
  params.thresholdStep = float(step);
  params.filterByCircularity = params.filterByConvexity = params.filterByInertia = false;
  params.minArea = 10;
  params.maxArea = 1e7f;
  params.minDistBetweenBlobs = 3;
  params.minRepeatability = 2;
  std::vector<cv::KeyPoint> found;
  cv::SimpleBlobDetector::create(params)->detect(picture.bytes, found);
  std::optional<Vector2d> best;
  for (const cv::KeyPoint& k : found) {
    const Vector2d p(k.pt.x + 0.5, k.pt.y + 0.5);
    if (!best || (p - picture.truth.center).norm() < (*best - picture.truth.center).norm()) best = p;
  }
  return best;
}

struct Result {
  double rms = 0, us = 0, mahalanobis = 0;
  int good = 0;
};

Result judge(const std::vector<Picture>& pictures,
             const std::function<std::optional<Vector2d>(const Picture&)>& method) {
  Result result;
  for (const Picture& p : pictures) {
    const double start = cpu_us();
    const std::optional<Vector2d> center = method(p);
    result.us += (cpu_us() - start) / double(pictures.size());
    // Further off than this is no measurement.
    if (!center || (*center - p.truth.center).norm() > 0.3 * p.truth.b) continue;
    ++result.good;
    result.rms += (*center - p.truth.center).squaredNorm();
  }
  result.rms = std::sqrt(result.rms / result.good);
  return result;
}

void print(const char* name, const Result& r, double bound, std::size_t count, const std::string& setting = {}) {
  std::printf("  %-26s %8.4f px  %6.2f x bound  %9.0f us  %4d of %zu", name, r.rms, r.rms / bound, r.us, r.good, count);
  if (r.mahalanobis > 0) std::printf("  mahalanobis² %.2f", r.mahalanobis);
  std::printf("%s\n", setting.c_str());
}

/// The setting that does best.
void print_best(const char* name, const std::vector<Picture>& pictures, const std::vector<double>& settings,
                double bound, const std::function<std::optional<Vector2d>(const Picture&, double)>& method) {
  Result best;
  double chosen = 0;
  for (const double setting : settings) {
    const Result r = judge(pictures, [&](const Picture& p) { return method(p, setting); });
    if (best.good == 0 || r.good > best.good + int(pictures.size() / 20) || (r.good >= best.good && r.rms < best.rms))
      best = r, chosen = setting;
  }
  char text[40];
  std::snprintf(text, sizeof text, "  (setting %g)", chosen);
  print(name, best, bound, pictures.size(), text);
}

struct Case {
  const char* name;
  double minor_px, aspect, blur_px;
  calib::PlaneNoise noise;
  double inner_ratio = 0;
  Vector2d light{0, 0};
};

void run(const Case& c, int samples) {
  std::mt19937_64 random(1);
  std::vector<Picture> pictures;
  double bound = 0;
  const int phases = c.minor_px > 100 ? 2 : 6;
  for (int phase = 0; phase < phases; ++phase) {
    test::EllipseScene scene = test::scene_of(c.minor_px, c.aspect, 0.9 * phase, c.blur_px, random);
    if (c.light.norm() > 0) scene.paper = 0.6;
    if (c.inner_ratio > 0) make_ring(scene, c.inner_ratio);
    scene.light = c.light;
    bound += center_bound(scene, c.noise).trace() / phases;
    const std::vector<double> values = render(scene);
    for (int i = 0; i < std::max(1, samples / phases); ++i) {
      Picture p;
      p.plane = noisy_plane(scene, values, c.noise, random);
      p.values = cv::Mat(scene.height, scene.width, CV_32F, p.plane.values.data()).clone();
      p.values.convertTo(p.bytes, CV_8U, 255);
      p.truth = scene.ellipses[0].ellipse;
      p.guess = test::rough_guess(p.truth, random);
      p.outside = scene.paper;
      pictures.push_back(std::move(p));
    }
  }
  bound = std::sqrt(bound);
  std::printf("%s: bound %.4f px\n", c.name, bound);
  calib::EllipseOptions options;
  options.inner_ratio = c.inner_ratio;
  for (const bool likelihood : {true, false}) {
    double sum = 0;
    const auto method = [&](const Picture& p) -> std::optional<Vector2d> {
      const calib::EllipseFit fit =
          likelihood ? calib::fit_ellipse(p.plane, p.guess, options) : calib::dual_conic_fit(p.plane, p.guess, options);
      if (fit.state != calib::EllipseState::good) return std::nullopt;
      const Vector2d error = fit.ellipse.center - p.truth.center;
      sum += error.dot(fit.center_covariance().inverse() * error);
      return fit.ellipse.center;
    };
    Result r = judge(pictures, method);
    r.mahalanobis = sum / r.good;
    print(likelihood ? "fit_ellipse" : "dual_conic_fit", r, bound, pictures.size());
  }
  const std::vector<double> sigmas{0, 0.6, 1, 1.5};
  print_best("half level, fitEllipse", pictures, sigmas, bound,
             [](const Picture& p, double s) { return half_level(p, s, false); });
  print_best("half level, …Direct", pictures, sigmas, bound,
             [](const Picture& p, double s) { return half_level(p, s, true); });
  print_best("Canny + parabola, fitEllipse", pictures, sigmas, bound,
             [](const Picture& p, double s) { return canny(p, s, true); });
  print_best("Canny, fitEllipse", pictures, sigmas, bound,
             [](const Picture& p, double s) { return canny(p, s, false); });
  if (c.inner_ratio == 0) {
    print_best("centroid of darkness", pictures, {0.5, 1, 1.5, 2, 3, 4}, bound,
               [](const Picture& p, double s) { return moments(p, s); });
    print_best("SimpleBlobDetector", pictures, {2, 5, 10}, bound,
               [](const Picture& p, double s) { return blob(p, s); });
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int samples = argc > 1 ? std::atoi(argv[1]) : 120;
  const calib::PlaneNoise half{16e-6, 0}, one{64e-6, 0}, five{1600e-6, 0}, photons{1e-5, 4e-4};  // of the contrast, 0.8
  const Case cases[] = {
      {"12 px, blur 0.5, 1 %", 12, 1, 0.5, one},
      {"12 px, blur 1, 1 %", 12, 1, 1, one},
      {"12 px, blur 2, 1 %", 12, 1, 2, one},
      {"12 px, 60 deg, blur 1, 1 %", 12, 0.5, 1, one},
      {"12 px, 70 deg, blur 1, 1 %", 12, 0.34, 1, one},
      {"12 px, blur 1, 0.5 %", 12, 1, 1, half},
      {"12 px, blur 1, 5 %", 12, 1, 1, five},
      {"12 px, blur 1, photon noise", 12, 1, 1, photons},
      {"5 px, blur 0.6, 1 %", 5, 0.7, 0.6, one},
      {"5 px, blur 1, 1 %", 5, 0.7, 1, one},
      {"8 px, blur 0.8, 1 %", 8, 0.7, 0.8, one},
      {"40 px, blur 1, 1 %", 40, 0.7, 1, one},
      {"200 px, blur 1, 1 %", 200, 0.8, 1, one},
      {"12 px ring, blur 1, 1 %", 12, 0.8, 1, one, 0.55},
      {"5 px ring, blur 0.6, 1 %", 5, 0.7, 0.6, one, 0.55},
      {"12 px, light changes by 30 %, 1 %", 12, 0.8, 1, one, 0, {0.022, -0.01}},
  };
  for (const Case& c : cases) run(c, c.minor_px > 100 ? std::min(samples, 24) : samples);
}
