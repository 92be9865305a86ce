#include "thin_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "gaussian_blur.h"

namespace lumihull::rig {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr double kPiece_px = 6, kNear_m = .02;
constexpr int kSightRays = 4;      ///< a side of the pixel
constexpr double kFirst_px = .35;  ///< the first level of blur beyond the lens's own; each next has twice as much
constexpr int kLevels = 12;

using Polygon = std::vector<Vector2d>;

/// What is left of a convex polygon on the side where sign * (p[axis] - at) >= 0 (Sutherland & Hodgman 1974).
void cut(const Polygon& in, int axis, double at, double sign, Polygon& out) {
  out.clear();
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Vector2d &a = in[i], &b = in[(i + 1) % in.size()];
    const double da = sign * (a[axis] - at), db = sign * (b[axis] - at);
    if (da >= 0) out.push_back(a);
    if ((da >= 0) != (db >= 0)) out.push_back(a + da / (da - db) * (b - a));
  }
}

double area(const Polygon& p) {
  double twice = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vector2d &a = p[i], &b = p[(i + 1) % p.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::fabs(twice) / 2;
}

/// A line's piece in the picture: both sides of the cylinder, and its depth.
struct Slice {
  Vector2d left, right;
  double depth;
};

class Drawing {
 public:
  Drawing(const LitScene& scene, const View& view, const Shutter& shutter, double blur_px)
      : scene_(scene), view_(view), shutter_(shutter), blur_px_(blur_px), origin_(view.center()) {}

  /// Whether any of it is in the picture.
  bool add(const ThinLine& line) {
    const auto ends = clipped(line);
    if (!ends) return false;
    bool seen = false;
    std::optional<Slice> before;
    const Vector3d from = ends->first, to = ends->second, way = to - from;
    const double length = way.norm();
    if (!(length > 1e-9)) return false;
    // The sides: across the plane of eye and line. Looked at along its length a line is a point, and none.
    const Vector3d across = way.cross(from);
    if (across.norm() < 1e-9 * length) return false;
    const Vector3d side = line.radius * across.normalized();
    for (double t = 0;;) {
      const Vector3d p = from + t * way;
      const auto left = view_.camera.project(p - side), right = view_.camera.project(p + side);
      if (left && right) {
        const Slice now{*left, *right, p.z()};
        if (before) seen |= piece(*before, now);
        before = now;
      } else {
        before.reset();
      }
      if (t >= 1) break;
      // As far along as a few pixels are: a pinhole's speed, d/dt of f p / z.
      const double speed = view_.camera.f * (way * p.z() - p * way.z()).norm() / (p.z() * p.z());
      t = std::min(1., t + std::clamp(kPiece_px / speed, 1e-5, .05));
    }
    return seen;
  }

  void paint(const Vector3f& color, Image& light) {
    Image sum;
    for (auto& [level, cover] : covers_) {
      if (const double sigma = sigma_px(level); sigma > 0) gaussian_blur(cover, sigma);
      if (sum.empty()) {
        sum = std::move(cover);
        continue;
      }
      for (int y = 0; y < sum.height(); ++y)
        for (int x = 0; x < sum.width(); ++x) sum.row<float>(y)[x] += cover.row<float>(y)[x];
    }
    for (int y = 0; y < light.height(); ++y) {
      const float* cover = sum.row<float>(y);
      float* pixel = light.row<float>(y);
      for (int x = 0; x < light.width(); ++x) {
        const float c = std::min(1.f, cover[x]);
        if (c <= 0) continue;
        for (int k = 0; k < 3; ++k) pixel[3 * x + k] += c * (color[k] - pixel[3 * x + k]);
      }
    }
  }

 private:
  /// Blurs come in levels; what lies between two is shared out so that its second moment is right.
  double sigma_px(int level) const { return std::hypot(blur_px_, level > 0 ? kFirst_px * std::exp2(level - 1) : 0.); }
  Image& cover(int level) {
    Image& found = covers_[level];
    if (found.empty()) found = Image(view_.camera.width, view_.camera.height, 1, PixelType::f32);
    return found;
  }
  struct Shares {
    Image *lower, *upper;
    double of_upper;
  };
  Shares shares(double depth) {
    const double wanted = std::hypot(blur_px_, shutter_.confusion_px(depth) / 4);
    int level = 0;
    while (level < kLevels && sigma_px(level + 1) <= wanted) ++level;
    const double low = sigma_px(level) * sigma_px(level), high = sigma_px(level + 1) * sigma_px(level + 1);
    const double share = std::clamp((wanted * wanted - low) / (high - low), 0., 1.);
    return {&cover(level), share > 0 ? &cover(level + 1) : nullptr, share};
  }

  /// The part before the camera and within the room, in the camera's frame.
  std::optional<std::pair<Vector3d, Vector3d>> clipped(const ThinLine& line) const {
    double low = 0, high = 1;
    const auto keep = [&](double at_from, double at_to) {  // where the linear function is positive
      if (at_from <= 0 && at_to <= 0) high = -1;
      const double zero = at_from / (at_from - at_to);
      if (at_from <= 0 && at_to > 0) low = std::max(low, zero);
      if (at_from > 0 && at_to <= 0) high = std::min(high, zero);
    };
    const Enclosure& room = scene_.room().enclosure();
    for (int i = 0; i < room.panels; ++i) {
      const Vector3d n = scene_.room().panel_normal(i).cast<double>();
      keep(room.radius + n.dot(line.from), room.radius + n.dot(line.to));
    }
    keep(room.height - line.from.z(), room.height - line.to.z());
    const Vector3d from = view_.cam_from_world * line.from, to = view_.cam_from_world * line.to;
    keep(from.z() - kNear_m, to.z() - kNear_m);
    if (!(low < high)) return std::nullopt;
    return std::pair<Vector3d, Vector3d>(from + low * (to - from), from + high * (to - from));
  }

  bool piece(const Slice& a, const Slice& b) {
    const std::array<Vector2d, 4> corners{a.left, b.left, b.right, a.right};
    Vector2d low = corners[0], high = corners[0];
    for (const Vector2d& c : corners) low = low.cwiseMin(c), high = high.cwiseMax(c);
    const int x0 = std::max(0, int(std::floor(low.x()))),
              x1 = std::min(view_.camera.width - 1, int(std::floor(high.x())));
    const int y0 = std::max(0, int(std::floor(low.y()))),
              y1 = std::min(view_.camera.height - 1, int(std::floor(high.y())));
    if (!(high.x() > 0 && high.y() > 0 && low.x() < view_.camera.width && low.y() < view_.camera.height)) return false;
    const double depth = .5 * (a.depth + b.depth);
    const Shares share = shares(depth);
    for (int y = y0; y <= y1; ++y) {
      polygon_.assign(corners.begin(), corners.end());
      cut(polygon_, 1, y, 1, other_);
      cut(other_, 1, y + 1, -1, row_);
      if (row_.size() < 3) continue;
      for (int x = x0; x <= x1; ++x) {
        cut(row_, 0, x, 1, other_);
        cut(other_, 0, x + 1, -1, polygon_);
        if (polygon_.size() < 3) continue;
        double part = area(polygon_);
        if (part <= 0) continue;
        part *= visible(x, y, depth);
        share.lower->row<float>(y)[x] += float((1 - share.of_upper) * part);
        if (share.upper) share.upper->row<float>(y)[x] += float(share.of_upper * part);
      }
    }
    return true;
  }

  /// The share of a pixel in which nothing stands before a line at that depth.
  double visible(int x, int y, double depth) {
    constexpr int n = kSightRays;
    rays_.clear();
    const Eigen::Quaterniond world_from_cam = view_.cam_from_world.rotation.conjugate();
    for (int b = 0; b < n; ++b)
      for (int a = 0; a < n; ++a) {
        const auto ray = view_.camera.ray({x + (a + .5) / n, y + (b + .5) / n});
        if (ray) rays_.push_back({origin_.cast<float>(), (world_from_cam * *ray).cast<float>(), 0, float(depth)});
      }
    if (rays_.empty()) return 0;
    hits_.resize(rays_.size());
    scene_.hit(rays_, hits_);
    int free = 0;
    for (std::size_t i = 0; i < rays_.size(); ++i)
      free += !hits_[i] && !scene_.room().pedestal_between(rays_[i].origin, float(depth) * rays_[i].direction);
    return double(free) / double(rays_.size());
  }

  const LitScene& scene_;
  const View& view_;
  const Shutter& shutter_;
  double blur_px_;
  Vector3d origin_;
  std::map<int, Image> covers_;  ///< by level
  Polygon polygon_, other_, row_;
  std::vector<hull::Ray> rays_;
  std::vector<hull::Hit> hits_;
};

}  // namespace

void add_lines(const LitScene& scene, const View& view, std::span<const ThinLine> lines, const Shutter& shutter,
               double blur_px, Image& light) {
  for (const ThinLine& line : lines) {
    Drawing drawing(scene, view, shutter, blur_px);
    if (drawing.add(line)) drawing.paint(line.color, light);
  }
}

}  // namespace lumihull::rig
