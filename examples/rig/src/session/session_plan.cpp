// Where the virtual rig photographs from: the planner's tour of a hemisphere, or its plain views.

#include "session_plan.h"

#include <lumihull/base/error.h>
#include <lumihull/capture/planner.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "objects/repaint.h"

namespace lumihull::rig {

using namespace capture;
using Eigen::Vector3d;

namespace {

/// Longest sides and radii of the paper's objects (table 1).
struct Usual {
  double size_m, radius_m;
};
const std::map<std::string, Usual, std::less<>> kUsual = {{"snowmobile", {2.8, 2.7}},
                                                          {"deer", {1.0, 1.5}},
                                                          {"deer_head", {1.0, 1.5}},
                                                          {"bust", {.7, 1.5}},
                                                          {"statue", {.2, .8}}};

Usual usual(const std::string& object) {
  const auto known = kUsual.find(object);
  return known == kUsual.end() ? Usual{.6, 1.5} : known->second;
}

/// The widest spacing that gives at least n views.
HemisphereOptions views_for(int n, HemisphereOptions views) {
  views.thin = true;
  double spacing = std::min(1.5, 4 / std::sqrt(double(n)));
  for (; spacing > 1e-3; spacing *= .985) {
    views.spacing_rad = spacing;
    if (int(hemisphere_views(views, Orientation::landscape).size()) >= n) break;
  }
  return views;
}

/// Of `of` items the ones to leave out so that `keep` stay, evenly.
bool left_out(std::size_t i, std::size_t of, std::size_t keep) { return (i + 1) * keep / of == i * keep / of; }

std::size_t photographs(const Plan& plan) {
  return std::size_t(
      std::count_if(plan.stops.begin(), plan.stops.end(), [](const PlannedStop& s) { return s.photograph; }));
}

/// Leaves n photographs; with cables the other stops are still passed, for their ways were planned.
void thin_out(Plan& plan, std::size_t n) {
  const std::size_t of = photographs(plan);
  if (of <= n) return;
  std::size_t i = 0;
  std::vector<PlannedStop> stops;
  for (PlannedStop& stop : plan.stops) {
    const bool leave = stop.photograph && left_out(i, of, n);
    i += stop.photograph;
    if (leave && !plan.mechanism) continue;
    if (leave) stop.photograph = false, stop.exposure_s = 0, stop.settle_s = 0;
    stops.push_back(std::move(stop));
  }
  plan.stops = std::move(stops);
}

/// The paper's mechanism in a world whose floor is z = 0; the centre of its views is then 1 m above the floor.
Mechanism mechanism_on_floor() {
  Mechanism mechanism = paper_mechanism();
  const Vector3d up(0, 0, -mechanism.room.min().z());
  mechanism.room.translate(up);
  for (Cable& cable : mechanism.cables) cable.departure += up;
  return mechanism;
}

}  // namespace

Object session_object(const SimulateOptions& o) {
  return repainted(object_by_name(o.object, o.size_m > 0 ? o.size_m : usual(o.object).size_m),
                   {o.matt, o.uniform, o.unlit, o.photo.exposure});
}

ObjectSize size_of(const hull::Mesh& mesh) {
  const auto [low, high] = bounding_box(mesh);
  const Eigen::Vector3f middle = (low + high) / 2;
  float across = 0;
  for (const auto& v : mesh.vertices) across = std::max(across, (v - middle).head<2>().norm());
  return {2. * double(across), double(high.z() - low.z())};
}

ViewSphere sphere_of(const Plan& plan) {
  std::vector<std::pair<Vector3d, Vector3d>> views;  // eye, direction
  for (const PlannedStop& stop : plan.stops)
    if (stop.photograph) {
      const Vector3d eye = stop.cam_from_world.center();
      const double s = std::sin(stop.phi_rad);
      views.emplace_back(eye,
                         Vector3d(s * std::cos(stop.theta_rad), s * std::sin(stop.theta_rad), std::cos(stop.phi_rad)));
    }
  if (views.empty()) throw Error(ErrorCode::bad_input, "photographs nothing", "plan");
  Eigen::MatrixXd a(3 * Eigen::Index(views.size()), 4);
  Eigen::VectorXd b(a.rows());
  for (std::size_t i = 0; i < views.size(); ++i) {
    a.block<3, 3>(3 * Eigen::Index(i), 0).setIdentity();
    a.block<3, 1>(3 * Eigen::Index(i), 3) = views[i].second;
    b.segment<3>(3 * Eigen::Index(i)) = views[i].first;
  }
  const Eigen::VectorXd x = a.completeOrthogonalDecomposition().solve(b);
  return {x.head<3>(), std::fabs(x[3])};
}

MadePlan make_plan(const SimulateOptions& o, const ObjectSize& object, double center_height_m, Job& job) {
  HemisphereOptions views;
  views.center = {0, 0, center_height_m};
  views.phi_from_rad = o.phi_from_rad, views.phi_to_rad = o.phi_to_rad;
  views.bearing_tolerance_rad = 8 * std::numbers::pi / 180;
  Optics optics;
  optics.focal_length_mm = o.focal_mm;
  optics.width_px = o.width, optics.height_px = o.width * 2 / 3;
  const double least = fill_radius(optics, object, Orientation::landscape);
  views.radius_m = o.radius_m > 0 ? o.radius_m : std::max(usual(o.object).radius_m, least);

  MadePlan made;
  const std::size_t n = std::size_t(o.photos);
  if (o.carrier == Carrier::automatic || o.carrier == Carrier::cables) {
    const Mechanism mechanism = mechanism_on_floor();
    PlannerOptions options;
    options.seed = o.seed;
    options.object = standing_object(object, views.center, 0);
    options.kicks = 100;
    std::string why;
    try {
      if (std::fabs(center_height_m - 1) > 1e-9) why = "the object is too tall for it";
      // Views that are out of reach are made up for by closer ones.
      for (int want = o.photos, round = 0; why.empty() && round < 4; ++round) {
        const PlannedTour tour = plan_tour(mechanism, views_for(want, views), options, job);
        const std::size_t reached = photographs(tour.plan), out = tour.left_out.size();
        made = {tour.plan, {}};
        if (out > 0) {
          made.notes.push_back(std::to_string(out) + " views of " + std::to_string(reached + out) +
                               " are out of the cables' reach");
          for (const std::string& reason : tour.left_out_why) made.notes.push_back("  " + reason);
        }
        if (o.carrier == Carrier::automatic && out * 4 > reached + out)
          why = made.notes.front();
        else if (reached >= n)
          break;
        else
          want += int(n - reached) + 1;
      }
    } catch (const Error& e) {
      if (e.code() != ErrorCode::degenerate) throw;
      why = e.what();
    }
    if (why.empty()) {
      thin_out(made.plan, n);
      return made;
    }
    if (o.carrier == Carrier::cables)
      throw Error(ErrorCode::invalid_argument, "the paper's mechanism can't do it: " + why, "robot");
    made = {{}, {"an ideal robot in place of the paper's mechanism: " + why}};
  }
  const char* robot = o.carrier == Carrier::turntable ? "turntable" : "hand";
  made.plan = view_tour(robot, views_for(o.photos, views), Orientation::landscape, {"camera"}, 3).plan;
  thin_out(made.plan, n);
  return made;
}

}  // namespace lumihull::rig
