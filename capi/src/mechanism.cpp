#include <lumihull/capture/clearance.h>
#include <lumihull/capture/design.h>
#include <lumihull/capture/forward.h>
#include <lumihull/capture/sensitivity.h>
#include <lumihull/capture/statics.h>

#include <algorithm>
#include <cmath>

#include "arguments.h"
#include "context.h"
#include "handles.h"
#include "mechanism_structs.h"

using namespace lumihull;
using namespace lumihull::capi;
using capture::Balance;
using capture::Cable;
using capture::CableVector;
using capture::Mechanism;

static_assert(LH_BALANCE_CONTROLLED == int(Balance::controlled) && LH_BALANCE_LOOSE == int(Balance::loose) &&
              LH_BALANCE_SINGULAR == int(Balance::singular) && LH_BALANCE_UNBALANCED == int(Balance::unbalanced));

namespace {

void point_to(const Eigen::Vector3d& point, double* out) { Eigen::Map<Eigen::Vector3d>(out, 3) = point; }

lh_cable cable_to(const Cable& cable) {
  lh_cable out{};
  point_to(cable.departure, out.departure);
  point_to(cable.attachment, out.attachment);
  out.min_length_m = cable.min_length_m, out.max_length_m = cable.max_length_m;
  out.min_tension_N = cable.min_tension_N, out.max_tension_N = cable.max_tension_N;
  out.stiffness_N = cable.stiffness_N, out.density_kg_m = cable.density_kg_m;
  return out;
}

Cable cable_from(const lh_cable& user, const std::string& name) {
  Cable cable;
  cable.name = name;
  cable.departure = Eigen::Map<const Eigen::Vector3d>(user.departure);
  cable.attachment = Eigen::Map<const Eigen::Vector3d>(user.attachment);
  cable.min_length_m = user.min_length_m, cable.max_length_m = user.max_length_m;
  cable.min_tension_N = user.min_tension_N, cable.max_tension_N = user.max_tension_N;
  cable.stiffness_N = user.stiffness_N, cable.density_kg_m = user.density_kg_m;
  return cable;
}

/// Values of all cables into a caller's array.
void cables_to(const CableVector& values, double* out, size_t n, const char* name) {
  const auto to = room(out, n, size_t(values.size()), 1, name);
  std::copy(values.begin(), values.end(), to.begin());
}

}  // namespace

lh_status lh_mechanism_load(lh_context* ctx, const char* file, lh_mechanism** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, capture::read_mechanism(path(file, "file")));
  });
}

lh_status lh_mechanism_paper(lh_context* ctx, lh_mechanism** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, capture::paper_mechanism());
  });
}

lh_status lh_mechanism_large(lh_context* ctx, lh_mechanism** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, capture::large_mechanism());
  });
}

lh_status lh_mechanism_save(lh_context* ctx, const lh_mechanism* mechanism, const char* file) {
  return guarded(ctx, [&] { capture::write_mechanism(given(mechanism, "mechanism").value, path(file, "file")); });
}

void lh_mechanism_destroy(lh_mechanism* mechanism) { delete mechanism; }

lh_status lh_mechanism_get_body(lh_context* ctx, const lh_mechanism* mechanism, lh_mechanism_body* out) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    lh_mechanism_body body{};
    body.mass_kg = m.mass_kg;
    point_to(m.center_of_mass, body.center_of_mass);
    point_to(m.room.min(), body.room_min);
    point_to(m.room.max(), body.room_max);
    body.platform_radius_m = m.platform_radius_m;
    body.cable_radius_m = m.cable_radius_m;
    body.gravity_m_s2 = m.gravity_m_s2;
    write_struct(out, body, "out");
  });
}

size_t lh_mechanism_cable_count(const lh_mechanism* mechanism) {
  return mechanism ? mechanism->value.cables.size() : 0;
}

lh_status lh_mechanism_cable(lh_context* ctx, const lh_mechanism* mechanism, size_t cable, lh_cable* out) {
  return guarded(ctx, [&] {
    const auto& cables = given(mechanism, "mechanism").value.cables;
    write_struct(out, cable_to(cables[index(cable, cables.size(), "cable")]), "out");
  });
}

lh_status lh_mechanism_cable_name(lh_context* ctx, const lh_mechanism* mechanism, size_t cable, char* buffer,
                                  size_t size, size_t* needed) {
  return guarded(ctx, [&] {
    const auto& cables = given(mechanism, "mechanism").value.cables;
    give_text(cables[index(cable, cables.size(), "cable")].name, buffer, size, needed);
  });
}

lh_status lh_mechanism_with_cable(lh_context* ctx, const lh_mechanism* mechanism, size_t cable, const lh_cable* value,
                                  lh_mechanism** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    Mechanism changed = given(mechanism, "mechanism").value;
    Cable& c = changed.cables[index(cable, changed.cables.size(), "cable")];
    c = cable_from(read_struct(&given(value, "value"), "value"), c.name);
    capture::check(changed);
    give(out, std::move(changed));
  });
}

lh_status lh_mechanism_camera(lh_context* ctx, const lh_mechanism* mechanism, double bearing_rad,
                              double cam_from_platform[12]) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    given(cam_from_platform, "cam_from_platform");
    if (!std::isfinite(bearing_rad)) invalid("expected a finite number", "bearing_rad");
    pose_to(capture::cam_from_platform(m, bearing_rad), cam_from_platform);
  });
}

lh_status lh_mechanism_lengths(lh_context* ctx, const lh_mechanism* mechanism, const double world_from_platform[12],
                               double* lengths_m, size_t n) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    cables_to(capture::cable_lengths(m, pose_from(world_from_platform, "world_from_platform")), lengths_m, n,
              "lengths_m");
  });
}

lh_status lh_mechanism_tensions(lh_context* ctx, const lh_mechanism* mechanism, const double world_from_platform[12],
                                double* tensions_N, size_t n, lh_balance* balance) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    const capture::Tensions t = capture::tensions(m, pose_from(world_from_platform, "world_from_platform"));
    if (tensions_N) room(tensions_N, n, m.cables.size(), 1, "tensions_N");
    lh_balance value{};
    value.state = int32_t(t.balance);
    value.residual_N = t.residual_N;
    value.smallest_singular = t.smallest_singular;
    if (balance) write_struct(balance, value, "balance");
    if (tensions_N) cables_to(t.tension_N, tensions_N, n, "tensions_N");
  });
}

lh_status lh_mechanism_sensitivity(lh_context* ctx, const lh_mechanism* mechanism, const double world_from_platform[12],
                                   lh_sensitivity* out) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    const capture::Sensitivity s = capture::sensitivity(m, pose_from(world_from_platform, "world_from_platform"));
    write_struct(out,
                 lh_sensitivity{sizeof(lh_sensitivity), s.translation_each, s.rotation_each, s.translation_joint,
                                s.rotation_joint},
                 "out");
  });
}

lh_status lh_mechanism_unstrained(lh_context* ctx, const lh_mechanism* mechanism, const double world_from_platform[12],
                                  double* lengths_m, size_t n) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    cables_to(capture::unstrained_lengths(m, pose_from(world_from_platform, "world_from_platform")), lengths_m, n,
              "lengths_m");
  });
}

lh_status lh_mechanism_hang(lh_context* ctx, const lh_mechanism* mechanism, const double* lengths_m, size_t n,
                            const double start[12], int32_t elastic, double world_from_platform[12],
                            double* tensions_N) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    const auto lengths = array(lengths_m, n, 1, "lengths_m");
    given(world_from_platform, "world_from_platform");
    const Pose from = pose_from(start, "start");
    const capture::Hanging hanging =
        elastic ? capture::hang_elastic(m, lengths, from) : capture::hang_rigid(m, lengths, from);
    if (tensions_N) cables_to(hanging.tension_N, tensions_N, n, "tensions_N");
    pose_to(hanging.world_from_platform, world_from_platform);
  });
}

lh_status lh_mechanism_clearance(lh_context* ctx, const lh_mechanism* mechanism, const double world_from_platform[12],
                                 const lh_keep_out* object, lh_clearance* out) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    const Pose pose = pose_from(world_from_platform, "world_from_platform");
    const auto keep_out = keep_out_from(object, "object");
    const capture::Clearance c = capture::clearance(m, pose, keep_out ? &*keep_out : nullptr);
    write_struct(out,
                 lh_clearance{sizeof(lh_clearance), c.cable_cable, c.cable_platform, c.cable_camera, c.cable_object,
                              c.platform_object, c.platform_room},
                 "out");
  });
}

lh_status lh_mechanism_crossing(lh_context* ctx, const lh_mechanism* mechanism, const double from[12],
                                const double to[12], lh_crossing* out) {
  return guarded(ctx, [&] {
    const Mechanism& m = given(mechanism, "mechanism").value;
    const auto crossing = capture::first_crossing(m, pose_from(from, "from"), pose_from(to, "to"));
    lh_crossing value{};
    if (crossing) value = {sizeof value, 1, crossing->first, crossing->second, crossing->at};
    write_struct(out, value, "out");
  });
}
