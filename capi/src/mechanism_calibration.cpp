#include <lumihull/capture/mechanism_calibration.h>

#include <algorithm>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;
using capture::MechanismCalibration;

namespace {

capture::MechanismCalibrationOptions options_from(const lh_mechanism_calibration_options* user) {
  const lh_mechanism_calibration_options o = read_struct(user, "options");
  capture::MechanismCalibrationOptions options;
  options.gains = o.gains;
  options.shared_attachments = !o.apart;
  options.position_sigma_m = or_default(o.position_sigma_m, options.position_sigma_m);
  options.rotation_sigma_rad = or_default(o.rotation_sigma_rad, options.rotation_sigma_rad);
  options.length_sigma_m = or_default(o.length_sigma_m, options.length_sigma_m);
  options.largest_rms_m = or_default(o.largest_rms_m, options.largest_rms_m);
  return options;
}

const MechanismCalibration& value_of(const lh_mechanism_calibration* calibration) {
  return given(calibration, "calibration").value;
}

}  // namespace

lh_status lh_mechanism_calibrate(lh_context* ctx, const lh_mechanism* guess, size_t count, const double* cam_from_world,
                                 const double* commanded_m, const int32_t* groups, const double* bearings_rad,
                                 const double* covariances, const lh_mechanism_calibration_options* user,
                                 lh_mechanism_calibration** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const capture::Mechanism& mechanism = given(guess, "guess").value;
    const auto options = options_from(user);
    const size_t cables = mechanism.cables.size();
    array(cam_from_world, count, 12, "cam_from_world");
    array(commanded_m, count, cables, "commanded_m");
    std::vector<capture::MechanismObservation> observations(count);
    for (size_t k = 0; k < count; ++k) {
      capture::MechanismObservation& o = observations[k];
      o.name = std::to_string(k);
      o.cam_from_world = pose_from(cam_from_world + 12 * k, "cam_from_world");
      o.commanded_m.assign(commanded_m + cables * k, commanded_m + cables * (k + 1));
      if (groups) o.bearing_group = groups[k];
      if (bearings_rad) o.bearing_rad = bearings_rad[k];
      if (covariances) o.covariance = Eigen::Map<const Eigen::Matrix<double, 6, 6>>(covariances + 36 * k);
    }
    give(out, capture::calibrate_mechanism(mechanism, observations, options));
  });
}

void lh_mechanism_calibration_destroy(lh_mechanism_calibration* calibration) { delete calibration; }

lh_status lh_mechanism_calibration_mechanism(lh_context* ctx, const lh_mechanism_calibration* calibration,
                                             lh_mechanism** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, value_of(calibration).mechanism);
  });
}

lh_status lh_mechanism_calibration_fit(lh_context* ctx, const lh_mechanism_calibration* calibration,
                                       lh_mechanism_fit* out) {
  return guarded(ctx, [&] {
    const MechanismCalibration& c = value_of(calibration);
    lh_mechanism_fit fit{};
    fit.length_rms_m = c.length_rms_m;
    fit.sigma0 = c.sigma0;
    fit.rejected = c.rejected.size();
    fit.groups = c.bearing_groups.size();
    fit.parameters = c.parameters.size();
    write_struct(out, fit, "out");
  });
}

lh_status lh_mechanism_calibration_winches(lh_context* ctx, const lh_mechanism_calibration* calibration,
                                           double* offsets_m, double* gains, size_t n) {
  return guarded(ctx, [&] {
    const MechanismCalibration& c = value_of(calibration);
    const size_t cables = c.offsets_m.size();
    if (offsets_m) room(offsets_m, n, cables, 1, "offsets_m");
    if (gains) room(gains, n, cables, 1, "gains");
    if (offsets_m) std::copy(c.offsets_m.begin(), c.offsets_m.end(), offsets_m);
    if (gains) std::copy(c.gains.begin(), c.gains.end(), gains);
  });
}

lh_status lh_mechanism_calibration_bearings(lh_context* ctx, const lh_mechanism_calibration* calibration,
                                            int32_t* groups, double* bearings_rad, size_t n) {
  return guarded(ctx, [&] {
    const MechanismCalibration& c = value_of(calibration);
    const size_t count = c.bearing_groups.size();
    if (groups) room(groups, n, count, 1, "groups");
    if (bearings_rad) room(bearings_rad, n, count, 1, "bearings_rad");
    if (groups) std::copy(c.bearing_groups.begin(), c.bearing_groups.end(), groups);
    if (bearings_rad) std::copy(c.bearings_rad.begin(), c.bearings_rad.end(), bearings_rad);
  });
}

lh_status lh_mechanism_calibration_rejected(lh_context* ctx, const lh_mechanism_calibration* calibration,
                                            size_t* indices, size_t n) {
  return guarded(ctx, [&] {
    const auto& rejected = value_of(calibration).rejected;
    const auto to = room(indices, n, rejected.size(), 1, "indices");
    std::copy(rejected.begin(), rejected.end(), to.begin());
  });
}

lh_status lh_mechanism_calibration_parameter(lh_context* ctx, const lh_mechanism_calibration* calibration, size_t i,
                                             char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] {
    const auto& names = value_of(calibration).parameters;
    give_text(names[index(i, names.size(), "i")], buffer, size, needed);
  });
}

lh_status lh_mechanism_calibration_covariance(lh_context* ctx, const lh_mechanism_calibration* calibration,
                                              double* covariance, size_t n) {
  return guarded(ctx, [&] {
    const Eigen::MatrixXd& c = value_of(calibration).covariance;
    if (n != size_t(c.rows()))
      invalid("expected room for " + std::to_string(c.rows()) + " rows, found " + std::to_string(n), "n");
    const auto to = array(covariance, n, n, "covariance");
    std::copy(c.reshaped().begin(), c.reshaped().end(), to.begin());
  });
}

size_t lh_mechanism_calibration_problem_count(const lh_mechanism_calibration* calibration) {
  return calibration ? calibration->value.unobservable.size() : 0;
}

lh_status lh_mechanism_calibration_problem(lh_context* ctx, const lh_mechanism_calibration* calibration, size_t i,
                                           char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] {
    const auto& problems = value_of(calibration).unobservable;
    give_text(problems[index(i, problems.size(), "i")], buffer, size, needed);
  });
}

lh_status lh_mechanism_calibration_commanded(lh_context* ctx, const lh_mechanism_calibration* calibration,
                                             const double world_from_platform[12], double* lengths_m, size_t n) {
  return guarded(ctx, [&] {
    const MechanismCalibration& c = value_of(calibration);
    const auto lengths = capture::commanded_lengths(c, pose_from(world_from_platform, "world_from_platform"));
    const auto to = room(lengths_m, n, size_t(lengths.size()), 1, "lengths_m");
    std::copy(lengths.begin(), lengths.end(), to.begin());
  });
}
