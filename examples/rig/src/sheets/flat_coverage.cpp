#include "flat_coverage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

// A pixel's mean colour, exactly: along a scan line through the pixel a sheet's coordinates are ratios of linear
// functions, so that it crosses a circle where a quadratic is zero and an edge where a line is. Between two crossings
// the colour is constant. Lines run across the edge that passes, and there are enough of them for the rule of
// midpoints.

namespace lumihull::rig {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kTile = FlatCoverage::kTile;
constexpr double kGauss = 0.28867513459481287;  ///< of the two points whose mean is exact for quadratics

struct Box {
  Vector2d low{1e300, 1e300}, high{-1e300, -1e300};
  void add(const Vector2d& p) { low = low.cwiseMin(p), high = high.cwiseMax(p); }
  bool meets(const Box& o) const {
    return low.x() <= o.high.x() && o.low.x() <= high.x() && low.y() <= o.high.y() && o.low.y() <= high.y();
  }
  bool holds(const Vector2d& p) const {
    return p.x() >= low.x() && p.x() <= high.x() && p.y() >= low.y() && p.y() <= high.y();
  }
};

double distance_to_segment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d ab = b - a;
  const double n = ab.squaredNorm();
  const double t = n > 0 ? std::clamp((p - a).dot(ab) / n, 0., 1.) : 0;
  return (p - a - t * ab).norm();
}

bool inside(const FlatShape& s, const Vector2d& p) {
  if (s.radius > 0) return (p - s.center).squaredNorm() <= s.radius * s.radius;
  bool odd = false;
  for (std::size_t i = 0, j = s.polygon.size() - 1; i < s.polygon.size(); j = i++) {
    const Vector2d &a = s.polygon[i], &b = s.polygon[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x())
      odd = !odd;
  }
  return odd;
}

/// A sheet as seen from a camera.
class Sheet {
 public:
  Sheet(const FlatPrint& print, const Pose& cam_from_world) : print_(&print) {
    const Pose cam_from_print = cam_from_world * print.world_from_print;
    const Eigen::Matrix3d r = cam_from_print.rotation.toRotationMatrix();
    const Vector3d t = cam_from_print.translation;
    distance_ = r.col(2).dot(t);
    for (int i = 0; i < 2; ++i)
      from_ray_.row(i) = (distance_ * r.col(i).transpose() - r.col(i).dot(t) * r.col(2).transpose()) / print.stretch[i];
    from_ray_.row(2) = r.col(2).transpose();
    front_ = distance_ > 0;
    if (!front_) from_ray_ = -from_ray_, distance_ = -distance_;
    sheet_.low = print.low, sheet_.high = print.high;
    if (front_) index();
  }

  /// Neither edge-on nor empty.
  bool visible() const { return distance_ > 1e-12 && (sheet_.high - sheet_.low).minCoeff() > 0; }
  const FlatPrint& print() const { return *print_; }
  const Box& box() const { return sheet_; }
  /// Homogeneous coordinates on the sheet of what a ray (x, y, 1) sees; the third is positive before the camera, and
  /// the depth is distance() / it.
  Vector3d operator()(const Vector2d& ray) const {
    const Eigen::Matrix3d& m = from_ray_;
    return {m(0, 0) * ray.x() + m(0, 1) * ray.y() + m(0, 2), m(1, 0) * ray.x() + m(1, 1) * ray.y() + m(1, 2),
            m(2, 0) * ray.x() + m(2, 1) * ray.y() + m(2, 2)};
  }
  Vector3d slope(const Vector2d& ray_step) const {
    const Eigen::Matrix3d& m = from_ray_;
    return {m(0, 0) * ray_step.x() + m(0, 1) * ray_step.y(), m(1, 0) * ray_step.x() + m(1, 1) * ray_step.y(),
            m(2, 0) * ray_step.x() + m(2, 1) * ray_step.y()};
  }
  double distance() const { return distance_; }

  /// Calls visit(shape) for those whose box meets `box`, in the order of printing.
  template <class Visit>
  void shapes_at(const Box& box, const Visit& visit) const {
    if (!front_ || boxes_.empty()) return;
    const int x0 = cell(box.low.x(), 0), x1 = cell(box.high.x(), 0), y0 = cell(box.low.y(), 1),
              y1 = cell(box.high.y(), 1);
    if (x0 == x1 && y0 == y1) {
      for (const int i : cells_[std::size_t(y0 * n_ + x0)])
        if (boxes_[std::size_t(i)].meets(box)) visit(print_->shapes[std::size_t(i)]);
    } else {
      for (std::size_t i = 0; i < boxes_.size(); ++i)
        if (boxes_[i].meets(box)) visit(print_->shapes[i]);
    }
  }

 private:
  int cell(double v, int axis) const {
    const double t = (v - sheet_.low[axis]) / (sheet_.high[axis] - sheet_.low[axis]) * n_;
    return int(std::clamp(t, 0., n_ - 1.));
  }

  void index() {
    for (const FlatShape& s : print_->shapes) {
      Box b;
      if (s.radius > 0) b.add(s.center - Vector2d::Constant(s.radius)), b.add(s.center + Vector2d::Constant(s.radius));
      for (const Vector2d& p : s.polygon)
        if (!(s.radius > 0)) b.add(p);
      boxes_.push_back(b);
    }
    n_ = std::clamp(int(2 * std::sqrt(double(boxes_.size()))), 1, 64);
    cells_.resize(std::size_t(n_) * std::size_t(n_));
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      if (!boxes_[i].meets(sheet_)) continue;
      for (int y = cell(boxes_[i].low.y(), 1); y <= cell(boxes_[i].high.y(), 1); ++y)
        for (int x = cell(boxes_[i].low.x(), 0); x <= cell(boxes_[i].high.x(), 0); ++x)
          cells_[std::size_t(y * n_ + x)].push_back(int(i));
    }
  }

  const FlatPrint* print_;
  Eigen::Matrix3d from_ray_;
  double distance_ = 0;
  bool front_ = true;
  Box sheet_;
  int n_ = 1;
  std::vector<Box> boxes_;
  std::vector<std::vector<int>> cells_;
};

/// Where a pixel's corner is on a sheet.
struct Node {
  Vector2d at{0, 0};  ///< NaN: nowhere
  double depth = 0;
};

/// What one sheet shows within one pixel.
struct Layer {
  const Sheet* sheet = nullptr;
  double depth = 0;
  bool bounded = false;  ///< the sheet's own edge passes
  Vector3f base{0, 0, 0};
  std::vector<const FlatShape*> edges;  ///< shapes whose edges pass, above the base
  Vector3d h0{0, 0, 0}, dh{0, 0, 0};    ///< the scan line at hand on the sheet: h0 + t dh, homogeneous
};

}  // namespace

class FlatCoverage::Renderer {
 public:
  Renderer(const View& view, std::span<const FlatPrint> prints, const Vector3f& background, int lines, int parts)
      : camera_(view.camera),
        background_(background),
        parts_(parts),
        lines_((lines + parts - 1) / parts * parts),
        domain_(view.camera.domain_radius()),
        distorted_(view.camera.has_distortion()) {
    sheets_.reserve(prints.size());
    for (const FlatPrint& p : prints) {
      sheets_.emplace_back(p, view.cam_from_world);
      if (!sheets_.back().visible()) sheets_.pop_back();
    }
  }

  void tile(int x0, int y0, float* out);
  int width() const { return camera_.width; }

 private:
  /// (x, y) of the ray (x, y, 1) through a place in the picture; NaN beyond the lens's domain.
  Vector2d ray(double u, double v) const {
    const Vector2d d = camera_.distorted_from_pixel({u, v});
    if (!distorted_) return d;
    if (d.norm() >= domain_) return Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    return camera_.correct(d);
  }

  void look_at(const Sheet& sheet, const Node& a, const Node& b, const Node& c, const Node& d);
  void order();
  void integrate(int x, int y, float* out);
  void cross(const Layer& layer);
  const Vector3f& color(double t) const;
  std::size_t stride() const { return std::size_t(3) * std::size_t(camera_.width) * std::size_t(parts_); }

  Camera camera_;
  Vector3f background_;
  int parts_, lines_;
  double domain_;
  bool distorted_;
  std::vector<Sheet> sheets_;

  std::vector<Layer> layers_;  // of the pixel at hand, nearest first; storage is kept
  std::size_t used_ = 0;
  bool closed_ = false;  // the last layer hides all behind it
  std::vector<double> crossings_;
};

/// Adds the sheet's layer where it shows in the pixel between four nodes.
void FlatCoverage::Renderer::look_at(const Sheet& sheet, const Node& a, const Node& b, const Node& c, const Node& d) {
  Box box;
  box.low = a.at.cwiseMin(b.at).cwiseMin(c.at.cwiseMin(d.at));
  box.high = a.at.cwiseMax(b.at).cwiseMax(c.at.cwiseMax(d.at));
  const Vector2d middle = 0.25 * (a.at + b.at + c.at + d.at);
  if (std::isnan(middle.x())) return;
  const Vector2d slack = 0.02 * (box.high - box.low);  // a lens bends a pixel's sides
  box.low -= slack, box.high += slack;
  if (!box.meets(sheet.box())) return;
  if (used_ == layers_.size()) layers_.emplace_back();
  Layer& layer = layers_[used_++];
  layer.sheet = &sheet;
  layer.depth = a.depth + b.depth + c.depth + d.depth;
  layer.bounded = !(sheet.box().holds(box.low) && sheet.box().holds(box.high));
  layer.base = sheet.print().paper;
  layer.edges.clear();
  const double reach = 1.04 * std::sqrt(std::max({(a.at - middle).squaredNorm(), (b.at - middle).squaredNorm(),
                                                  (c.at - middle).squaredNorm(), (d.at - middle).squaredNorm()}));
  sheet.shapes_at(box, [&](const FlatShape& s) {
    bool edge = false;
    if (s.radius > 0) {
      const double r = (middle - s.center).norm();
      if (r > s.radius + reach) return;
      edge = r > s.radius - reach;
    } else {
      for (std::size_t i = 0, j = s.polygon.size() - 1; i < s.polygon.size() && !edge; j = i++)
        edge = distance_to_segment(middle, s.polygon[i], s.polygon[j]) < reach;
    }
    if (edge) {
      layer.edges.push_back(&s);
    } else if (inside(s, middle)) {
      layer.edges.clear();
      layer.base = s.color;
    }
  });
}

/// Brings the layers into order, nearest first, down to one that hides the rest.
void FlatCoverage::Renderer::order() {
  if (used_ > 1)
    std::stable_sort(layers_.begin(), layers_.begin() + std::ptrdiff_t(used_),
                     [](const Layer& a, const Layer& b) { return a.depth < b.depth; });
  closed_ = false;
  for (std::size_t i = 0; i < used_ && !closed_; ++i)
    if (!layers_[i].bounded) closed_ = true, used_ = i + 1;
}

/// Adds the parameters t in (0, 1) at which the scan line passes an edge of the layer.
void FlatCoverage::Renderer::cross(const Layer& layer) {
  const Vector3d &h0 = layer.h0, &dh = layer.dh;
  const auto add = [this](double t) {
    if (t > 0 && t < 1) crossings_.push_back(t);
  };
  const auto line = [&](double nx, double ny, double c) {  // nx X + ny Y = c
    const double slope = nx * dh.x() + ny * dh.y() - c * dh.z();
    if (slope != 0) add(-(nx * h0.x() + ny * h0.y() - c * h0.z()) / slope);
  };
  if (layer.bounded) {
    const Box& b = layer.sheet->box();
    line(1, 0, b.low.x()), line(1, 0, b.high.x()), line(0, 1, b.low.y()), line(0, 1, b.high.y());
  }
  for (const FlatShape* s : layer.edges) {
    if (s->radius > 0) {
      const Vector2d p = h0.head<2>() - h0.z() * s->center, d = dh.head<2>() - dh.z() * s->center;
      const double r2 = s->radius * s->radius;
      const double a = d.squaredNorm() - r2 * dh.z() * dh.z(), b = p.dot(d) - r2 * h0.z() * dh.z(),
                   c = p.squaredNorm() - r2 * h0.z() * h0.z();
      const double root = b * b - a * c;
      if (root < 0) continue;
      const double q = -(b + std::copysign(std::sqrt(root), b));
      if (a != 0) add(q / a);
      if (q != 0) add(c / q);
    } else {
      for (std::size_t i = 0, j = s->polygon.size() - 1; i < s->polygon.size(); j = i++) {
        const Vector2d &u = s->polygon[i], &v = s->polygon[j];
        line(v.y() - u.y(), u.x() - v.x(), (v.y() - u.y()) * u.x() + (u.x() - v.x()) * u.y());
      }
    }
  }
}

const Vector3f& FlatCoverage::Renderer::color(double t) const {
  for (std::size_t i = 0; i < used_; ++i) {
    const Layer& layer = layers_[i];
    const double z = 1 / (layer.h0.z() + t * layer.dh.z());
    const Vector2d p((layer.h0.x() + t * layer.dh.x()) * z, (layer.h0.y() + t * layer.dh.y()) * z);
    if (layer.bounded && !layer.sheet->box().holds(p)) continue;
    for (std::size_t k = layer.edges.size(); k-- > 0;)
      if (inside(*layer.edges[k], p)) return layer.edges[k]->color;
    return layer.base;
  }
  return background_;
}

/// Adds the pixel's colours to its parts.
void FlatCoverage::Renderer::integrate(int x, int y, float* out) {
  // Rays are bilinear over the pixel, through the four Gauss points: the mean of a quadratic error is zero.
  const double u = x + .5, v = y + .5;
  const Vector2d a = ray(u - kGauss, v - kGauss), b = ray(u + kGauss, v - kGauss), c = ray(u - kGauss, v + kGauss),
                 d = ray(u + kGauss, v + kGauss);
  const Vector2d mean = 0.25 * (a + b + c + d), du = (b + d - a - c) / (4 * kGauss),
                 dv = (c + d - a - b) / (4 * kGauss), duv = (a + d - b - c) / (4 * kGauss * kGauss);

  // Which way do the edges run? Lines cross the first one; more of them where others run otherwise.
  Vector2d first{0, 0};
  bool several = false;
  const auto edge = [&](const Layer& layer, const Vector2d& normal) {
    const Vector3d h = (*layer.sheet)(mean), hu = (*layer.sheet)(mean + du), hv = (*layer.sheet)(mean + dv);
    const Vector2d p = h.head<2>() / h.z();
    const Vector2d n(normal.dot(hu.head<2>() / hu.z() - p), normal.dot(hv.head<2>() / hv.z() - p));
    const double length = n.norm();
    if (!(length > 0)) return;
    if (first.isZero())
      first = n / length;
    else if (std::abs(first.dot(n)) < 0.97 * length)
      several = true;
  };
  for (std::size_t i = 0; i < used_; ++i) {
    const Layer& layer = layers_[i];
    const Vector3d h = (*layer.sheet)(mean);
    const Vector2d p = h.head<2>() / h.z();
    const Vector3d hu = (*layer.sheet)(mean + du);
    const double size = (hu.head<2>() / hu.z() - p).norm();
    if (layer.bounded) {
      const Box& s = layer.sheet->box();
      const double dx = std::min(std::abs(p.x() - s.low.x()), std::abs(p.x() - s.high.x())),
                   dy = std::min(std::abs(p.y() - s.low.y()), std::abs(p.y() - s.high.y()));
      if (dx < 3 * size) edge(layer, {1, 0});
      if (dy < 3 * size || dx >= 3 * size) edge(layer, {0, 1});
    }
    for (const FlatShape* s : layer.edges) {
      if (s->radius > 0) {
        edge(layer, p - s->center);
        several |= s->radius < 3 * size;
      } else {
        double nearest = std::numeric_limits<double>::infinity();
        Vector2d normal{0, 0};
        int near = 0;
        for (std::size_t k = 0, j = s->polygon.size() - 1; k < s->polygon.size(); j = k++) {
          const double distance = distance_to_segment(p, s->polygon[k], s->polygon[j]);
          near += distance < 2 * size;
          if (distance >= nearest) continue;
          nearest = distance;
          const Vector2d along = s->polygon[k] - s->polygon[j];
          normal = {-along.y(), along.x()};
        }
        edge(layer, normal);
        several |= near > 1;
      }
    }
  }
  const bool along_x = std::abs(first.x()) >= std::abs(first.y());
  const int n = several ? 4 * lines_ : lines_;

  const float weight = float(parts_ * parts_) / float(n);  // of a line in a part, for its whole length
  for (int i = 0; i < n; ++i) {
    const double s = (i + .5) / n - .5;
    const Vector2d middle = along_x ? Vector2d(mean + s * dv) : Vector2d(mean + s * du);
    const Vector2d direction = along_x ? Vector2d(du + s * duv) : Vector2d(dv + s * duv);
    const Vector2d start = middle - .5 * direction;
    crossings_.clear();
    for (std::size_t k = 0; k < used_; ++k) {
      layers_[k].h0 = (*layers_[k].sheet)(start), layers_[k].dh = layers_[k].sheet->slope(direction);
      cross(layers_[k]);
    }
    for (int k = 1; k <= parts_; ++k) crossings_.push_back(double(k) / parts_);
    std::sort(crossings_.begin(), crossings_.end());
    const int across = i * parts_ / n;
    double t = 0;
    for (const double next : crossings_) {
      if (!(next > t)) continue;
      const double half = .5 * (t + next);
      const int along = int(half * parts_);
      float* part = out + (along_x ? std::size_t(across) * stride() + std::size_t(3 * along)
                                   : std::size_t(along) * stride() + std::size_t(3 * across));
      const Vector3f& value = color(half);
      const float share = weight * float(next - t);
      for (int m = 0; m < 3; ++m) part[m] += share * value[m];
      t = next;
    }
  }
}

void FlatCoverage::Renderer::tile(int x0, int y0, float* out) {
  const int width = std::min(kTile, camera_.width - x0), height = std::min(kTile, camera_.height - y0);
  std::array<Vector2d, std::size_t(kTile + 1) * (kTile + 1)> rays;
  const auto at = [&](int x, int y) -> std::size_t { return std::size_t(y * (kTile + 1) + x); };
  bool valid = true;
  // Whether a sheet may show is asked at the tile's border first: its box on the sheet, enlarged by what a lens bends.
  for (int y = 0; y <= height; ++y)
    for (int x = 0; x <= width; ++x)
      if (x == 0 || y == 0 || x == width || y == height) {
        rays[at(x, y)] = ray(x0 + x, y0 + y);
        valid &= !std::isnan(rays[at(x, y)].x());
      }
  std::vector<const Sheet*> sheets;
  for (const Sheet& sheet : sheets_) {
    Box box;
    bool horizon = !valid, before = !valid;
    for (const auto& [x, y] : {std::array{0, 0},
                               {width, 0},
                               {0, height},
                               {width, height},
                               {width / 2, 0},
                               {0, height / 2},
                               {width, height / 2},
                               {width / 2, height}}) {
      const Vector3d h = sheet(rays[at(x, y)]);
      if (!(h.z() > 1e-12))
        horizon = true;
      else
        before = true, box.add(h.head<2>() / h.z());
    }
    if (!before) continue;  // all of the tile looks past the sheet's plane
    const Vector2d slack = 0.25 * (box.high - box.low);
    box.low -= slack, box.high += slack;
    if (horizon || box.meets(sheet.box())) sheets.push_back(&sheet);
  }
  if (!sheets.empty())
    for (int y = 1; y < height; ++y)
      for (int x = 1; x < width; ++x) rays[at(x, y)] = ray(x0 + x, y0 + y);

  std::vector<Node> lattice(sheets.size() * rays.size());
  for (std::size_t k = 0; k < sheets.size(); ++k)
    for (int y = 0; y <= height; ++y)
      for (int x = 0; x <= width; ++x) {
        const Vector3d h = (*sheets[k])(rays[at(x, y)]);
        Node& node = lattice[k * rays.size() + at(x, y)];
        node.depth = sheets[k]->distance() / h.z();
        node.at = h.z() > 1e-12 ? Vector2d(h.head<2>() / h.z())
                                : Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
      }
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      used_ = 0;
      for (std::size_t k = 0; k < sheets.size(); ++k) {
        const Node* l = &lattice[k * rays.size() + at(x, y)];
        look_at(*sheets[k], l[0], l[1], l[kTile + 1], l[kTile + 2]);
      }
      order();
      float* part = out + std::size_t(y * parts_) * stride() + std::size_t(3 * (x0 + x) * parts_);
      const bool plain = used_ == 0 || (used_ == 1 && closed_ && layers_[0].edges.empty());
      const Vector3f value = !plain ? Vector3f(0, 0, 0) : used_ == 0 ? background_ : layers_[0].base;
      for (int i = 0; i < parts_; ++i)
        for (int k = 0; k < 3 * parts_; ++k) part[std::size_t(i) * stride() + std::size_t(k)] = value[k % 3];
      if (!plain) integrate(x0 + x, y0 + y, part);
    }
}

FlatCoverage::FlatCoverage(const View& view, std::span<const FlatPrint> prints, const Vector3f& background, int lines,
                           int parts)
    : renderer_(std::make_unique<Renderer>(view, prints, background, lines, parts)) {}
FlatCoverage::FlatCoverage(FlatCoverage&&) noexcept = default;
FlatCoverage::~FlatCoverage() = default;

void FlatCoverage::tile_row(int first_row, float* out) {
  for (int x = 0; x < renderer_->width(); x += kTile) renderer_->tile(x, first_row, out);
}

}  // namespace lumihull::rig
