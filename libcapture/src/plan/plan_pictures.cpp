// A plan as pictures.
#include <lumihull/base/error.h>
#include <lumihull/capture/plan_report.h>
#include <lumihull/capture/statics.h>
#include <lumihull/internal/svg_figure.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lumihull::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using lumihull::internal::map_color;
using lumihull::internal::SvgFigure;

constexpr double kFrameWidth = 78, kFrameHeight = 92;  // what SvgFigure keeps free around the data, px
const char* const kCableColors[] = {"#3b78d8", "#d9622b", "#2c9c5a", "#8b55c7", "#c2a000", "#00939c",
                                    "#c23b6b", "#6b6b6b", "#7aa33c", "#a0522d", "#4b4bd0", "#d04bb0"};

/// One view of the plan: which axis goes to the right, which upwards.
struct Side {
  const char *title, *x_label, *y_label;
  int x, y;
};

std::string note_of(const Plan& plan) {
  std::size_t photographs = 0;
  double travel_m = 0;
  for (std::size_t i = 0; i < plan.stops.size(); ++i) {
    photographs += plan.stops[i].photograph;
    if (i > 0)
      travel_m +=
          (plan.stops[i].world_from_platform.translation - plan.stops[i - 1].world_from_platform.translation).norm();
  }
  char text[200];
  std::snprintf(text, sizeof text, "%zu views, %zu places to pass or to turn the camera, %.1f m; from dark to light",
                photographs, plan.stops.size() - photographs, travel_m);
  return text;
}

std::string drawn(const Plan& plan, const Side& side) {
  check(plan);
  const auto flat = [&](const Vector3d& p) { return Vector2d(p[side.x], p[side.y]); };
  Eigen::AlignedBox2d box;
  for (const PlannedStop& stop : plan.stops) box.extend(flat(stop.world_from_platform.translation));
  if (plan.object) {
    const Vector3d around(plan.object->radius_m, plan.object->radius_m, 0);
    box.extend(flat(plan.object->base - around));
    box.extend(flat(plan.object->base + around + Vector3d(0, 0, plan.object->height_m + plan.object->radius_m)));
  }
  if (plan.mechanism) box.extend(flat(plan.mechanism->room.min())), box.extend(flat(plan.mechanism->room.max()));
  const Vector2d margin = Vector2d::Constant(0.04 * box.sizes().maxCoeff() + 1e-3);
  const Vector2d low = box.min() - margin, high = box.max() + margin, size = high - low;
  const double scale = 720 / size.maxCoeff();  // the same along both axes
  SvgFigure figure(side.title, kFrameWidth + scale * size.x(), kFrameHeight + scale * size.y());
  figure.axes(low.x(), high.x(), low.y(), high.y(), side.x_label, side.y_label);
  figure.note(note_of(plan));
  const auto line = [&](const Vector3d& a, const Vector3d& b, std::string_view style) {
    const Vector2d p = flat(a), q = flat(b);
    figure.line(p.x(), p.y(), q.x(), q.y(), style);
  };
  if (plan.mechanism) {
    const Vector2d a = flat(plan.mechanism->room.min()), b = flat(plan.mechanism->room.max());
    for (const auto& [x0, y0, x1, y1] :
         {std::array{a.x(), a.y(), b.x(), a.y()}, std::array{b.x(), a.y(), b.x(), b.y()},
          std::array{b.x(), b.y(), a.x(), b.y()}, std::array{a.x(), b.y(), a.x(), a.y()}})
      figure.line(x0, y0, x1, y1, "level");
  }
  if (plan.object) {
    const KeepOut& o = *plan.object;
    constexpr int kSteps = 48;
    Vector3d last;
    for (int i = 0; i <= kSteps; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSteps;
      Vector3d p = o.base;
      if (side.y == 2) {  // the outline from the side: cylinder and cap
        p[side.x] += o.radius_m * std::cos(angle);
        p.z() += std::sin(angle) > 0 ? o.height_m + o.radius_m * std::sin(angle) : 0;
      } else {
        p += o.radius_m * Vector3d(std::cos(angle), std::sin(angle), 0);
      }
      if (i > 0) line(last, p, "wrong");
      last = p;
    }
  }
  const std::size_t n = plan.stops.size();
  for (std::size_t i = 1; i < n; ++i)
    line(plan.stops[i - 1].world_from_platform.translation, plan.stops[i].world_from_platform.translation,
         map_color(double(i) / double(n)));
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d p = flat(plan.stops[i].world_from_platform.translation);
    const bool photograph = plan.stops[i].photograph;
    figure.dot(p.x(), p.y(), photograph ? 2.2 : 4, photograph ? map_color(double(i) / double(n)) : "#d9622b");
  }
  if (plan.mechanism)
    for (std::size_t c = 0; c < plan.mechanism->cables.size(); ++c) {
      const Vector2d p = flat(plan.mechanism->cables[c].departure);
      figure.dot(p.x(), p.y(), 4, kCableColors[c]);
      const Vector2d inwards = (flat(plan.mechanism->room.center()) - p).normalized() * 14 / scale;  // off the wall
      figure.text(p.x() + inwards.x(), p.y() + inwards.y() - 4 / scale, plan.mechanism->cables[c].name);
    }
  return figure.standalone();
}

}  // namespace

std::string plan_from_above_svg(const Plan& plan) { return drawn(plan, {"The plan from above", "x, m", "y, m", 0, 1}); }

std::string plan_from_side_svg(const Plan& plan) {
  return drawn(plan, {"The plan from the side", "x, m", "z, m", 0, 2});
}

std::string plan_tensions_svg(const Plan& plan) {
  check(plan);
  if (!plan.mechanism) throw Error(ErrorCode::invalid_argument, "a plan without cables has no tensions", "plan");
  std::vector<CableVector> all;
  double most = 0;
  for (const PlannedStop& stop : plan.stops) {
    all.push_back(tensions(*plan.mechanism, stop.world_from_platform).tension_N);
    most = std::max(most, all.back().maxCoeff());
  }
  SvgFigure figure("Tensions along the plan", 900, 420);
  figure.axes(0, double(std::max<std::size_t>(1, all.size() - 1)), 0, 1.15 * most, "stop", "N", 1);
  const std::size_t cables = plan.mechanism->cables.size();
  for (std::size_t c = 0; c < cables; ++c) {
    const Eigen::Index k = Eigen::Index(c);
    for (std::size_t i = 1; i < all.size(); ++i)
      figure.line(double(i - 1), all[i - 1][k], double(i), all[i][k], kCableColors[c]);
    const double x = (double(c) + 0.5) / double(cables) * double(all.size());
    figure.text(x, 1.1 * most, "cable " + plan.mechanism->cables[c].name);
    figure.line(x - 0.02 * double(all.size()), 1.05 * most, x + 0.02 * double(all.size()), 1.05 * most,
                kCableColors[c]);
  }
  return figure.standalone();
}

std::string plan_time_svg(const Plan& plan) {
  check(plan);
  const double total = std::max(1e-9, duration_s(plan) / 60);
  const double n = double(plan.stops.size());
  SvgFigure figure("Time along the plan", 900, 420);
  figure.axes(0, n, 0, total, "stop", "minutes", 1);
  struct Part {
    const char *name, *color;
    double minutes = 0;
  } parts[] = {{"all", "#3b78d8"}, {"settling and turning", "#2c9c5a"}, {"travel", "#d9622b"}, {"exposure", "#8b55c7"}};
  for (std::size_t i = 0; i < plan.stops.size(); ++i) {
    const PlannedStop& s = plan.stops[i];
    const double steps[] = {s.travel_s + s.settle_s + s.exposure_s, s.settle_s, s.travel_s, s.exposure_s};
    for (int k = 0; k < 4; ++k) {
      figure.line(double(i), parts[k].minutes, double(i + 1), parts[k].minutes + steps[k] / 60, parts[k].color);
      parts[k].minutes += steps[k] / 60;
    }
    if (!s.pause.empty()) figure.line(double(i), 0, double(i), total, "level");
  }
  for (int k = 0; k < 4; ++k) {
    char text[80];
    std::snprintf(text, sizeof text, "%s: %.1f min", parts[k].name, parts[k].minutes);
    figure.text(0.07 * n, total * (0.95 - 0.06 * k), text, "small", "start");
    figure.line(0.02 * n, total * (0.95 - 0.06 * k), 0.06 * n, total * (0.95 - 0.06 * k), parts[k].color);
  }
  return figure.standalone();
}

}  // namespace lumihull::capture
