// Cameras and targets in space, as SVG. Every shape carries its points, so that a short script can turn the view.
#include <lumihull/internal/html.h>
#include <lumihull/internal/small_matrices.h>
#include <lumihull/internal/svg_figure.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include "report_parts.h"

namespace lumihull::calib::report {
namespace {

using Eigen::Vector3d;
using lumihull::internal::html_escaped;
using lumihull::internal::number;

constexpr int kWidth = 760, kHeight = 560, kSmallWidth = 376, kSmallHeight = 320;
constexpr double kReach = 1000;  ///< points are whole numbers of thousandths of the scene's reach
constexpr std::size_t kMostEllipsoids = 150;
constexpr std::size_t kMostDots = 4000;

struct Shape {
  std::string_view style;
  std::vector<Vector3d> points;  ///< scene's frame; one: a dot, or a text
  std::string text;
};

/// z up; the picture's unit is a thousandth of the reach.
struct Frame {
  Vector3d center{0, 0, 0};
  Eigen::Matrix3d scene_from_world = Eigen::Matrix3d::Identity();
  double reach = 1;  ///< m

  Vector3d operator()(const Vector3d& world) const { return kReach / reach * (scene_from_world * (world - center)); }
};

Vector3d middle_of(const CalibratedBody& body) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : body.points) sum += p;
  return sum / double(std::max<std::size_t>(1, body.points.size()));
}

std::vector<const CalibratedPhoto*> placed_photos(const TargetModel& model) {
  std::vector<const CalibratedPhoto*> list;
  for (const CalibratedPhoto& p : model.calibration.photos)
    if (p.cam_from_world) list.push_back(&p);
  return list;
}

std::vector<const CalibratedBody*> placed_bodies(const TargetModel& model) {
  std::vector<const CalibratedBody*> list;
  for (const CalibratedBody& b : model.calibration.bodies)
    if (b.placed && !b.points.empty()) list.push_back(&b);
  return list;
}

Frame frame_of(const std::vector<const CalibratedPhoto*>& photos, const std::vector<const CalibratedBody*>& bodies) {
  Frame frame;
  // Photographers hold their cameras upright more often than not: up is the mean of the pictures' own.
  Vector3d up = Vector3d::Zero();
  Vector3d low = Vector3d::Constant(1e300), high = -low;
  const auto take = [&](const Vector3d& p) { low = low.cwiseMin(p), high = high.cwiseMax(p); };
  for (const CalibratedPhoto* p : photos) {
    up -= p->cam_from_world->rotation.conjugate() * Vector3d::UnitY();
    take(p->cam_from_world->center());
  }
  for (const CalibratedBody* b : bodies)
    for (const Vector3d& p : b->points) take(p);
  // Pictures straight from above have no up: then it is away from what they look at.
  if (up.norm() < 0.3 * double(photos.size())) {
    up.setZero();
    for (const CalibratedPhoto* p : photos) up -= p->cam_from_world->rotation.conjugate() * Vector3d::UnitZ();
  }
  if (!(up.norm() > 1e-9)) up = Vector3d::UnitZ();
  up.normalize();
  const Vector3d across = up.unitOrthogonal();
  frame.scene_from_world << across.transpose(), up.cross(across).transpose(), up.transpose();
  frame.center = 0.5 * (low + high);
  frame.reach = 1e-9;
  const auto reach = [&](const Vector3d& p) { frame.reach = std::max(frame.reach, (p - frame.center).norm()); };
  for (const CalibratedPhoto* p : photos) reach(p->cam_from_world->center());
  for (const CalibratedBody* b : bodies) std::for_each(b->points.begin(), b->points.end(), reach);
  return frame;
}

std::vector<Vector3d> frustum(const Camera& camera, const Pose& cam_from_world, double length) {
  const Pose world_from_cam = cam_from_world.inverse();
  std::array<Vector3d, 4> corner;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d px(i == 1 || i == 2 ? camera.width : 0, i >= 2 ? camera.height : 0);
    const Eigen::Vector2d d = camera.distorted_from_pixel(px);
    corner[std::size_t(i)] = world_from_cam * (length * Vector3d(d.x(), d.y(), 1));
  }
  const Vector3d apex = cam_from_world.center();
  return {corner[0], apex, corner[1], corner[0], corner[3], apex, corner[2], corner[1], corner[2], corner[3]};
}

/// Outlines of the targets of a body: the four outer points of each.
void add_outlines(const TargetSet& set, const CalibratedBody& body, const Frame& frame, std::vector<Shape>& shapes) {
  std::map<std::pair<int, int>, std::map<int, Vector3d>> targets;
  for (std::size_t k = 0; k < body.features.size() && k < body.points.size(); ++k)
    targets[{body.features[k].design, body.features[k].id}][body.features[k].feature] = body.points[k];
  for (const auto& [target, points] : targets) {
    const TargetDesign& design = set.designs.at(std::size_t(target.first));
    const int n = design.family.kind() == TargetKind::circles ? design.family.grid() : 2;
    const std::array<int, 4> corners = n == 2 && design.features() == 4
                                           ? std::array<int, 4>{0, 1, 2, 3}
                                           : std::array<int, 4>{0, n - 1, n * n - 1, n * n - n};
    Shape outline{"target", {}, ""};
    for (const int k : {corners[0], corners[1], corners[2], corners[3], corners[0]})
      if (const auto at = points.find(k); at != points.end()) outline.points.push_back(frame(at->second));
    if (outline.points.size() > 1) shapes.push_back(std::move(outline));
  }
}

/// Three great circles of the ellipsoid of one standard deviation, `times` as large.
void add_ellipsoid(const Vector3d& center, const Eigen::Matrix3d& covariance, double times, const Frame& frame,
                   std::vector<Shape>& shapes) {
  const internal::SymmetricAxes axes = internal::symmetric_axes(covariance);
  const Vector3d sigma = axes.values.cwiseMax(0).cwiseSqrt();
  constexpr int kSteps = 20;
  for (int k = 0; k < 3; ++k) {
    Shape ring{"sigma", {}, ""};
    const int a = k, b = (k + 1) % 3;
    for (int i = 0; i <= kSteps; ++i) {
      const double t = 2 * std::numbers::pi * i / kSteps;
      ring.points.push_back(frame(center + times * (std::cos(t) * sigma(a) * axes.vectors.col(a) +
                                                    std::sin(t) * sigma(b) * axes.vectors.col(b))));
    }
    shapes.push_back(std::move(ring));
  }
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Orthographic: azimuth and elevation of the viewer, rad. The script does the same.
Eigen::Vector2d projected(const Vector3d& p, double azimuth, double elevation) {
  const double ca = std::cos(azimuth), sa = std::sin(azimuth), ce = std::cos(elevation), se = std::sin(elevation);
  return {ca * p.x() + sa * p.y(), sa * se * p.x() - ca * se * p.y() - ce * p.z()};
}

std::string svg(const std::vector<Shape>& shapes, int width, int height, double azimuth, double elevation, bool turns,
                const std::string& title) {
  const double scale = 0.47 * std::min(width, height) / kReach;
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"scene" + std::string(turns ? " turns" : "") +
                    "\" viewBox=\"0 0 " + std::to_string(width) + " " + std::to_string(height) + "\" width=\"" +
                    std::to_string(width) + "\" height=\"" + std::to_string(height) + "\" role=\"img\"";
  if (turns)
    out += " data-view=\"" + number("%.4f", azimuth) + " " + number("%.4f", elevation) + " " + number("%.6f", scale) +
           "\"";
  out += "><title>" + html_escaped(title) + "</title>\n";
  for (const Shape& shape : shapes) {
    std::string points, data;
    for (const Vector3d& p : shape.points) {
      const Eigen::Vector2d q = scale * projected(p, azimuth, elevation);
      char text[80];
      std::snprintf(text, sizeof text, "%s%.1f,%.1f", points.empty() ? "" : " ", 0.5 * width + q.x(),
                    0.5 * height + q.y());
      points += text;
      std::snprintf(text, sizeof text, "%s%.0f %.0f %.0f", data.empty() ? "" : " ", p.x(), p.y(), p.z());
      data += text;
    }
    const std::string tail =
        " class=\"" + std::string(shape.style) + "\"" + (turns ? " data-p=\"" + data + "\"" : std::string());
    const std::size_t comma = points.find(',');
    if (!shape.text.empty())
      out += "<text" + tail + " x=\"" + points.substr(0, comma) + "\" y=\"" + points.substr(comma + 1) + "\">" +
             html_escaped(shape.text) + "</text>\n";
    else if (shape.points.size() == 1)
      out += "<circle r=\"1.2\"" + tail + " cx=\"" + points.substr(0, comma) + "\" cy=\"" + points.substr(comma + 1) +
             "\"/>\n";
    else
      out += "<polyline" + tail + " points=\"" + points + "\"/>\n";
  }
  return out + "</svg>\n";
}

}  // namespace

double longest_axis(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(0.0, internal::symmetric_axes(covariance).values(2)));
}

std::string scene(const TargetModel& model) {
  const Calibration& c = model.calibration;
  const auto photos = placed_photos(model);
  const auto bodies = placed_bodies(model);
  if (photos.empty() && bodies.empty()) return "";
  const Frame frame = frame_of(photos, bodies);

  std::vector<Shape> shapes;
  std::size_t dots = 0;
  for (const CalibratedBody* b : bodies) dots += b->points.size();
  const std::size_t dot_step = dots / kMostDots + 1;
  std::size_t at = 0;
  for (const CalibratedBody* b : bodies) {
    add_outlines(model.set, *b, frame, shapes);
    for (const Vector3d& p : b->points)
      if (at++ % dot_step == 0) shapes.push_back({"dot", {frame(p)}, ""});
  }
  for (std::size_t i = 0; i < c.photos.size(); ++i) {
    const CalibratedPhoto& p = c.photos[i];
    if (!p.cam_from_world) continue;
    std::vector<Vector3d> corners =
        frustum(c.cameras.at(std::size_t(model.photos.at(i).camera)), *p.cam_from_world, 0.06 * frame.reach);
    for (Vector3d& corner : corners) corner = frame(corner);
    shapes.push_back({p.in_model ? "camera" : "later", std::move(corners), ""});
  }

  std::vector<double> sizes;
  for (const CalibratedPhoto* p : photos) sizes.push_back(longest_axis(center_covariance(*p)));
  std::vector<Eigen::Matrix3d> body_covariances;
  for (const CalibratedBody* b : bodies) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const Eigen::Matrix3d& m : b->point_covariances) sum += m;
    body_covariances.push_back(sum / double(std::max<std::size_t>(1, b->point_covariances.size())));
    sizes.push_back(longest_axis(body_covariances.back()));
  }
  const double times = lumihull::internal::magnification(median(sizes), 0.04 * frame.reach);
  const std::size_t step = (photos.size() + bodies.size()) / kMostEllipsoids + 1;
  for (std::size_t i = 0; i < photos.size(); i += step)
    add_ellipsoid(photos[i]->cam_from_world->center(), center_covariance(*photos[i]), times, frame, shapes);
  for (std::size_t i = 0; i < bodies.size(); i += step)
    add_ellipsoid(middle_of(*bodies[i]), body_covariances[i], times, frame, shapes);
  constexpr std::size_t kMostNames = 60;
  if (bodies.size() <= kMostNames)
    for (const CalibratedBody* b : bodies)
      shapes.push_back({"name", {frame(middle_of(*b))}, b->id >= 0 ? std::to_string(b->id) : b->name});

  return "<p class=\"dim\">Blue: photographs that the model was made from; grey: placed afterwards; green: targets. "
         "Orange: one standard deviation, " +
         number("%g", times) + " times as large" +
         (step > 1 ? ", of every " + std::to_string(step) + "th" : std::string()) + ". The scene is " +
         number("%.3g", 2 * frame.reach) + " m across. Drag to turn; below from above and from the side.</p>\n" +
         svg(shapes, kWidth, kHeight, 0.6, 0.5, true, "Cameras and targets") +
         svg(shapes, kSmallWidth, kSmallHeight, 0, std::numbers::pi / 2, false, "From above") +
         svg(shapes, kSmallWidth, kSmallHeight, 0, 0, false, "From the side");
}

std::string scene_script() {
  return R"(<script>
for (const s of document.querySelectorAll('svg.turns')) {
  let [a, e, k] = s.dataset.view.split(' ').map(Number), last = null;
  const w = s.viewBox.baseVal.width / 2, h = s.viewBox.baseVal.height / 2;
  const shapes = [...s.querySelectorAll('[data-p]')].map(n => [n, n.dataset.p.split(' ').map(Number)]);
  const draw = () => {
    const ca = Math.cos(a), sa = Math.sin(a), ce = Math.cos(e), se = Math.sin(e);
    for (const [n, p] of shapes) {
      const q = [];
      for (let i = 0; i < p.length; i += 3)
        q.push([w + k * (ca * p[i] + sa * p[i + 1]), h + k * (sa * se * p[i] - ca * se * p[i + 1] - ce * p[i + 2])]);
      if (n.tagName == 'polyline') n.setAttribute('points', q.join(' '));
      else for (const [i, name] of (n.tagName == 'circle' ? ['cx', 'cy'] : ['x', 'y']).entries()) n.setAttribute(name, q[0][i]);
    }
  };
  s.onpointerdown = m => { last = m; s.setPointerCapture(m.pointerId); };
  s.onpointerup = () => last = null;
  s.onpointermove = m => {
    if (!last) return;
    a -= (m.clientX - last.clientX) / 150;
    e = Math.max(-1.57, Math.min(1.57, e + (m.clientY - last.clientY) / 150));
    last = m;
    draw();
  };
  s.onwheel = m => { k *= Math.exp(-m.deltaY / 500); m.preventDefault(); draw(); };
}
</script>
)";
}

}  // namespace lumihull::calib::report
