#include <lumihull/base/error.h>
#include <lumihull/capture/design.h>

#include <cmath>
#include <string>

#include "cma_es.h"
#include "objective.h"

namespace lumihull::capture {
namespace {

void check_options(const Mechanism& base, const DesignOptions& o) {
  const auto need = [](bool ok, const char* message) {
    if (!ok) throw Error(ErrorCode::invalid_argument, message, "design options");
  };
  need(!o.workspaces.empty(), "expected at least one workspace");
  for (const Workspace& w : o.workspaces) check(w);
  need(!o.paired || base.cables.size() % 2 == 0, "expected an even number of cables, that share points in pairs");
  need(o.largest_attachment_radius_m > 0 && std::isfinite(o.largest_attachment_radius_m),
       "expected largest_attachment_radius_m > 0");
  need(o.lowest_departure_m >= 0 && o.lowest_departure_m < base.room.sizes().z(),
       "expected 0 <= lowest_departure_m < the room's height");
  need(o.evaluations >= 1 && o.evaluations <= 1'000'000'000, "expected 1 to 1e9 evaluations");
  if (o.object)
    need(o.object->base.allFinite() && o.object->radius_m > 0 && o.object->height_m >= 0 &&
             std::isfinite(o.object->radius_m + o.object->height_m),
         "expected an object of finite size");
  if (!o.goals) return;
  const DesignGoals& g = *o.goals;
  need(g.least_tension_N > 0 && g.greatest_tension_N > g.least_tension_N && std::isfinite(g.greatest_tension_N),
       "expected goals 0 < least_tension_N < greatest_tension_N");
  need(g.clearance_m >= 0 && std::isfinite(g.clearance_m), "expected a goal clearance_m >= 0");
  need(g.sight_rad >= 0 && g.sight_rad < 3, "expected a goal 0 <= sight_rad < 3");
  need(g.rotation_rad_per_m > 0 && std::isfinite(g.rotation_rad_per_m), "expected a goal rotation_rad_per_m > 0");
}

}  // namespace

MechanismDesign design_mechanism(const Mechanism& base, const DesignOptions& options, Job& job) {
  check(base, "the base");
  check_options(base, options);
  design::CmaOptions cma;
  cma.dimensions = design::unknowns(base, options);
  cma.evaluations = options.evaluations;
  cma.seed = options.seed;
  cma.target = 0;
  if (!options.goals)
    for (const Workspace& w : options.workspaces) cma.target -= double(w.size());
  const design::CmaResult found = design::cma_es(
      cma, [&](const Eigen::VectorXd& x) { return design::objective(design::decoded(base, options, x), options); }, job,
      "design");
  MechanismDesign out;
  out.mechanism = design::decoded(base, options, found.x);
  out.objective = found.value;
  out.evaluations = found.evaluations;
  out.restarts = found.restarts;
  return out;
}

}  // namespace lumihull::capture
