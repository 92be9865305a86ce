/* The robot through the C interface: what it says is computed again here from the definitions. */
#include "check.h"

enum { kCables = 6 };

#define NEAR(a, b, tolerance) CHECK(fabs((a) - (b)) <= (tolerance))

/* Turned by an angle about y, at (x, y, z). */
static void make_pose(double angle, double x, double y, double z, double pose[12]) {
  const double c = cos(angle), s = sin(angle);
  const double p[12] = {c, 0, s, x, 0, 1, 0, y, -s, 0, c, z};
  memcpy(pose, p, sizeof p);
}

/* c = R b: from the platform's origin to a point on it, in world axes. */
static void turned(const double pose[12], const double b[3], double c[3]) {
  int r;
  for (r = 0; r < 3; ++r) c[r] = pose[4 * r] * b[0] + pose[4 * r + 1] * b[1] + pose[4 * r + 2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static lh_cable cable_of(lh_context *ctx, const lh_mechanism *mechanism, size_t i) {
  lh_cable cable;
  memset(&cable, 0, sizeof cable);
  cable.struct_size = sizeof cable;
  MUST(ctx, lh_mechanism_cable(ctx, mechanism, i, &cable));
  return cable;
}

static void lengths_and_tensions(lh_context *ctx, const lh_mechanism *mechanism) {
  double pose[12], lengths[kCables], tensions[kCables], sum[6], arm[3], torque[3], weight[3] = {0, 0, 0};
  lh_mechanism_body body;
  lh_balance balance;
  lh_sensitivity sensitivity;
  int i, r;
  make_pose(0.2, 0.4, -0.3, 1.2, pose);
  MUST(ctx, lh_mechanism_lengths(ctx, mechanism, pose, lengths, kCables));
  memset(&balance, 0, sizeof balance);
  balance.struct_size = sizeof balance;
  MUST(ctx, lh_mechanism_tensions(ctx, mechanism, pose, tensions, kCables, &balance));
  memset(&body, 0, sizeof body);
  body.struct_size = sizeof body;
  MUST(ctx, lh_mechanism_get_body(ctx, mechanism, &body));
  CHECK(body.mass_kg == 5.75 && body.room_max[1] == 6 && body.room_min[2] == -1);

  weight[2] = -body.mass_kg * body.gravity_m_s2;
  turned(pose, body.center_of_mass, arm);
  cross(arm, weight, torque);
  for (r = 0; r < 3; ++r) sum[r] = weight[r], sum[3 + r] = torque[r];
  for (i = 0; i < kCables; ++i) {
    const lh_cable cable = cable_of(ctx, mechanism, (size_t)i);
    double along[3], length = 0;
    turned(pose, cable.attachment, arm);
    for (r = 0; r < 3; ++r) along[r] = cable.departure[r] - pose[4 * r + 3] - arm[r];
    for (r = 0; r < 3; ++r) length += along[r] * along[r];
    length = sqrt(length);
    NEAR(lengths[i], length, 1e-12);
    for (r = 0; r < 3; ++r) along[r] *= tensions[i] / length;
    cross(arm, along, torque);
    for (r = 0; r < 3; ++r) sum[r] += along[r], sum[3 + r] += torque[r];
    CHECK(tensions[i] > 1 && tensions[i] < 100);
  }
  for (r = 0; r < 6; ++r) NEAR(sum[r], 0, 1e-9);
  CHECK(balance.state == LH_BALANCE_CONTROLLED && balance.residual_N < 1e-9 && balance.smallest_singular > 0.1);
  memset(&sensitivity, 0, sizeof sensitivity);
  sensitivity.struct_size = sizeof sensitivity;
  MUST(ctx, lh_mechanism_sensitivity(ctx, mechanism, pose, &sensitivity));
  CHECK(sensitivity.translation_each >= sensitivity.translation_joint && sensitivity.translation_joint > 0);
  CHECK(sensitivity.rotation_each >= sensitivity.rotation_joint && isfinite(sensitivity.rotation_each));

  make_pose(0, 4.5, 0, 1, pose);
  MUST(ctx, lh_mechanism_tensions(ctx, mechanism, pose, NULL, 0, &balance));
  CHECK(balance.state == LH_BALANCE_UNBALANCED && balance.residual_N > 0.1);
}

static void hanging(lh_context *ctx, const lh_mechanism *mechanism) {
  double pose[12], start[12], found[12], lengths[kCables], tensions[kCables], expected[kCables];
  lh_mechanism *rubber = NULL;
  int i;
  make_pose(0.2, 0.4, -0.3, 1.2, pose);
  make_pose(0, 0, 0, 1.5, start);
  MUST(ctx, lh_mechanism_lengths(ctx, mechanism, pose, lengths, kCables));
  MUST(ctx, lh_mechanism_hang(ctx, mechanism, lengths, kCables, start, 0, found, tensions));
  MUST(ctx, lh_mechanism_tensions(ctx, mechanism, pose, expected, kCables, NULL));
  for (i = 0; i < 12; ++i) NEAR(found[i], pose[i], 1e-10);
  for (i = 0; i < kCables; ++i) NEAR(tensions[i], expected[i], 1e-8);
  EXPECT(ctx, LH_EINVAL, lh_mechanism_hang(ctx, mechanism, lengths, kCables, start, 1, found, NULL));

  for (i = 0; i < kCables; ++i) {
    lh_mechanism *next = NULL;
    lh_cable cable = cable_of(ctx, rubber ? rubber : mechanism, (size_t)i);
    cable.stiffness_N = 2000;
    MUST(ctx, lh_mechanism_with_cable(ctx, rubber ? rubber : mechanism, (size_t)i, &cable, &next));
    lh_mechanism_destroy(rubber);
    rubber = next;
  }
  MUST(ctx, lh_mechanism_unstrained(ctx, rubber, pose, lengths, kCables));
  MUST(ctx, lh_mechanism_lengths(ctx, rubber, pose, tensions, kCables));
  for (i = 0; i < kCables; ++i) NEAR(lengths[i] * (1 + expected[i] / 2000), tensions[i], 1e-12);
  MUST(ctx, lh_mechanism_hang(ctx, rubber, lengths, kCables, start, 1, found, NULL));
  for (i = 0; i < 12; ++i) NEAR(found[i], pose[i], 1e-8);
  lh_mechanism_destroy(rubber);
}

static void clearances(lh_context *ctx, const lh_mechanism *mechanism) {
  const double center[3] = {0, 0, 0};
  double pose[12], turned_round[12], camera[12];
  lh_object_size ball;
  lh_keep_out object;
  lh_clearance clearance;
  lh_crossing crossing;
  memset(&ball, 0, sizeof ball);
  ball.struct_size = sizeof ball;
  ball.diameter_m = 0.4;
  memset(&object, 0, sizeof object);
  object.struct_size = sizeof object;
  MUST(ctx, lh_object_keep_out(ctx, &ball, center, -1, &object));
  CHECK(object.base[2] == -1 && object.radius_m == 0.2 && object.height_m == 1);
  memset(&clearance, 0, sizeof clearance);
  clearance.struct_size = sizeof clearance;
  make_pose(0, 0, 0, 1.5, pose);
  MUST(ctx, lh_mechanism_clearance(ctx, mechanism, pose, &object, &clearance));
  NEAR(clearance.platform_object, 1.5 - 0.3 - 0.2, 1e-12);
  NEAR(clearance.platform_room, 2.5 - 0.3, 1e-12);
  MUST(ctx, lh_mechanism_clearance(ctx, mechanism, pose, NULL, &clearance));
  CHECK(isinf(clearance.cable_object));

  memset(&crossing, 0, sizeof crossing);
  crossing.struct_size = sizeof crossing;
  make_pose(0.2, 0.4, -0.3, 1.2, turned_round);
  MUST(ctx, lh_mechanism_crossing(ctx, mechanism, pose, turned_round, &crossing));
  CHECK(crossing.crosses == 0);
  memset(turned_round, 0, sizeof turned_round); /* by 3 rad about z */
  turned_round[0] = turned_round[5] = cos(3.0);
  turned_round[4] = sin(3.0), turned_round[1] = -sin(3.0), turned_round[10] = 1, turned_round[11] = 1.5;
  MUST(ctx, lh_mechanism_crossing(ctx, mechanism, pose, turned_round, &crossing));
  CHECK(crossing.crosses == 1 && crossing.first != crossing.second && crossing.at > 0 && crossing.at < 1);

  MUST(ctx, lh_mechanism_camera(ctx, mechanism, 0, camera));
  NEAR(camera[11], 0, 1e-15);          /* no offset */
  NEAR(camera[10], -sqrt(0.5), 1e-15); /* it looks 45 degrees off the platform's axis */
}

static void files(lh_context *ctx, const lh_mechanism *mechanism, const char *scratch) {
  char file[1024], name[8];
  lh_mechanism *again = NULL;
  size_t needed = 0;
  snprintf(file, sizeof file, "%s/mechanism.json", scratch);
  MUST(ctx, lh_mechanism_save(ctx, mechanism, file));
  MUST(ctx, lh_mechanism_load(ctx, file, &again));
  CHECK(lh_mechanism_cable_count(again) == kCables && lh_mechanism_cable_count(NULL) == 0);
  CHECK(cable_of(ctx, again, 3).departure[1] == cable_of(ctx, mechanism, 3).departure[1]);
  MUST(ctx, lh_mechanism_cable_name(ctx, again, 3, NULL, 0, &needed));
  MUST(ctx, lh_mechanism_cable_name(ctx, again, 3, name, needed, NULL));
  CHECK(needed == 2 && strcmp(name, "4") == 0);
  EXPECT(ctx, LH_EINVAL, lh_mechanism_cable_name(ctx, again, 3, name, 1, NULL));
  lh_mechanism_destroy(again);
}

static void wrong_use(lh_context *ctx, const lh_mechanism *mechanism) {
  double pose[12], lengths[kCables], values[kCables] = {7, 7, 7, 7, 7, 7};
  lh_mechanism *other = NULL;
  lh_balance balance;
  lh_cable cable = cable_of(ctx, mechanism, 0);
  make_pose(0, 0, 0, 1.5, pose);
  MUST(ctx, lh_mechanism_lengths(ctx, mechanism, pose, lengths, kCables));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_lengths(ctx, mechanism, pose, values, kCables - 1));
  CHECK_SAYS(ctx, "lengths_m");
  EXPECT(ctx, LH_EINVAL, lh_mechanism_lengths(ctx, NULL, pose, values, kCables));
  CHECK_SAYS(ctx, "mechanism");
  EXPECT(ctx, LH_EINVAL, lh_mechanism_lengths(ctx, mechanism, NULL, values, kCables));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_hang(ctx, mechanism, lengths, kCables - 1, pose, 0, pose, NULL));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_hang(ctx, mechanism, NULL, kCables, pose, 0, pose, NULL));
  pose[3] = NAN;
  EXPECT(ctx, LH_EINVAL, lh_mechanism_lengths(ctx, mechanism, pose, values, kCables));
  CHECK_SAYS(ctx, "world_from_platform");
  memset(&balance, 0, sizeof balance);
  balance.struct_size = sizeof balance;
  EXPECT(ctx, LH_EINVAL, lh_mechanism_tensions(ctx, mechanism, pose, values, kCables, &balance));
  pose[3] = 0;
  EXPECT(ctx, LH_EINVAL, lh_mechanism_tensions(ctx, mechanism, pose, values, 1, &balance));
  balance.struct_size = 3;
  EXPECT(ctx, LH_EINVAL, lh_mechanism_tensions(ctx, mechanism, pose, values, kCables, &balance));
  CHECK_SAYS(ctx, "struct_size");
  lengths[2] = NAN;
  EXPECT(ctx, LH_EINVAL, lh_mechanism_hang(ctx, mechanism, lengths, kCables, pose, 0, pose, values));
  lengths[0] = lengths[1] = lengths[2] = lengths[3] = lengths[4] = lengths[5] = 0.1;
  EXPECT(ctx, LH_EDEGENERATE, lh_mechanism_hang(ctx, mechanism, lengths, kCables, pose, 0, pose, values));
  pose[3] = 4.5;
  EXPECT(ctx, LH_EDEGENERATE, lh_mechanism_unstrained(ctx, mechanism, pose, values, kCables));
  CHECK(values[0] == 7 && values[5] == 7); /* untouched by all of them */

  EXPECT(ctx, LH_ENOTFOUND, lh_mechanism_load(ctx, "/nowhere/mechanism.json", &other));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_load(ctx, "", &other));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_load(ctx, "x.json", NULL));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_cable(ctx, mechanism, kCables, &cable));
  cable.max_tension_N = -1;
  EXPECT(ctx, LH_EINPUT, lh_mechanism_with_cable(ctx, mechanism, 0, &cable, &other));
  cable.struct_size = 0;
  EXPECT(ctx, LH_EINVAL, lh_mechanism_with_cable(ctx, mechanism, 0, &cable, &other));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_camera(ctx, mechanism, INFINITY, pose));
  CHECK(!other);
  lh_mechanism_destroy(NULL);
}

/* out = a b. */
static void product(const double a[12], const double b[12], double out[12]) {
  int r, c;
  for (r = 0; r < 3; ++r)
    for (c = 0; c < 4; ++c)
      out[4 * r + c] =
          a[4 * r] * b[c] + a[4 * r + 1] * b[4 + c] + a[4 * r + 2] * b[8 + c] + (c == 3 ? a[4 * r + 3] : 0);
}

static void inverse(const double a[12], double out[12]) {
  int r, c;
  for (r = 0; r < 3; ++r) {
    for (c = 0; c < 3; ++c) out[4 * r + c] = a[4 * c + r];
    out[4 * r + 3] = -(a[r] * a[3] + a[4 + r] * a[7] + a[8 + r] * a[11]);
  }
}

enum { kGroups = 8, kEach = 8, kObservations = kGroups * kEach };

/* Exact photographs of a mechanism, with offsets of 1, 2, … cm. */
static void observe(lh_context *ctx, const lh_mechanism *truth, double *cam_from_world, double *commanded,
                    int32_t *groups, double *bearings) {
  int k, i;
  for (k = 0; k < kObservations; ++k) {
    const double theta = 6.283185307179586 * (k / kEach) / kGroups, phi = 0.2 * (k % kEach) + 0.01 * (k % 3);
    const double tilt = phi * 2 / 3 - 0.5235987755982988 + 0.02 * sin(7.0 * k);
    const double about[12] = {cos(theta), -sin(theta), 0, 0, sin(theta), cos(theta), 0, 0, 0, 0, 1, 0};
    double back[12], tilted[12], platform[12], camera[12], sideways[12];
    inverse(about, back);
    make_pose(tilt, 1.5 * sin(phi), 0, 1.5 * cos(phi), tilted);
    product(about, tilted, platform);
    product(platform, back, sideways);
    sideways[3] += 0.05 * sin(3.0 * k), sideways[7] += 0.05 * cos(5.0 * k);
    MUST(ctx, lh_mechanism_camera(ctx, truth, theta, camera));
    inverse(sideways, back);
    product(camera, back, cam_from_world + 12 * k);
    MUST(ctx, lh_mechanism_lengths(ctx, truth, sideways, commanded + kCables * k, kCables));
    for (i = 0; i < kCables; ++i) commanded[kCables * k + i] -= 0.01 * (i + 1);
    groups[k] = k / kEach;
    bearings[k] = theta;
  }
}

static void calibration(lh_context *ctx, const lh_mechanism *guess) {
  static double cam_from_world[12 * kObservations], commanded[kCables * kObservations], bearings[kObservations];
  static int32_t groups[kObservations];
  static double covariance[200 * 200];
  lh_mechanism *truth = NULL, *found = NULL;
  lh_mechanism_calibration *result = NULL;
  lh_mechanism_fit fit;
  lh_mechanism_calibration_options options;
  double offsets[kCables], gains[kCables], angles[kGroups], pose[12], camera[12], back[12], lengths[kCables];
  int32_t numbers[kGroups];
  char text[256];
  size_t needed = 0, i;
  int k;
  lh_cable cable = cable_of(ctx, guess, 1);
  cable.departure[1] += 0.03, cable.departure[2] -= 0.02;
  MUST(ctx, lh_mechanism_with_cable(ctx, guess, 1, &cable, &truth));
  observe(ctx, truth, cam_from_world, commanded, groups, bearings);
  MUST(ctx, lh_mechanism_calibrate(ctx, guess, kObservations, cam_from_world, commanded, groups, bearings, NULL, NULL,
                                   &result));
  memset(&fit, 0, sizeof fit);
  fit.struct_size = sizeof fit;
  MUST(ctx, lh_mechanism_calibration_fit(ctx, result, &fit));
  CHECK(fit.length_rms_m < 1e-7 && fit.rejected == 0 && fit.groups == kGroups && fit.parameters > 30);
  MUST(ctx, lh_mechanism_calibration_winches(ctx, result, offsets, gains, kCables));
  for (i = 0; i < kCables; ++i) CHECK(gains[i] == 1 && isfinite(offsets[i]));
  MUST(ctx, lh_mechanism_calibration_bearings(ctx, result, numbers, angles, kGroups));
  MUST(ctx, lh_mechanism_calibration_mechanism(ctx, result, &found));
  /* What the calibrated mechanism would command at each photograph's place is what was commanded. */
  for (k = 0; k < kObservations; k += 5) {
    CHECK(numbers[groups[k]] == groups[k]);
    MUST(ctx, lh_mechanism_camera(ctx, found, angles[groups[k]], camera));
    inverse(cam_from_world + 12 * k, back);
    product(back, camera, pose);
    MUST(ctx, lh_mechanism_calibration_commanded(ctx, result, pose, lengths, kCables));
    for (i = 0; i < kCables; ++i) NEAR(lengths[i], commanded[kCables * k + (int)i], 1e-6);
  }
  MUST(ctx, lh_mechanism_calibration_parameter(ctx, result, 0, text, sizeof text, &needed));
  CHECK(needed == strlen(text) + 1 && needed > 1);
  CHECK(fit.parameters <= 200);
  MUST(ctx, lh_mechanism_calibration_covariance(ctx, result, covariance, fit.parameters));
  CHECK(covariance[0] > 0);
  EXPECT(ctx, LH_EINVAL, lh_mechanism_calibration_covariance(ctx, result, covariance, fit.parameters - 1));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_calibration_bearings(ctx, result, numbers, angles, kGroups - 1));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_calibration_winches(ctx, result, offsets, gains, 1));
  EXPECT(ctx, LH_EINVAL, lh_mechanism_calibration_parameter(ctx, result, fit.parameters, text, sizeof text, &needed));
  for (i = 0; i < lh_mechanism_calibration_problem_count(result); ++i)
    MUST(ctx, lh_mechanism_calibration_problem(ctx, result, i, text, sizeof text, &needed));
  MUST(ctx, lh_mechanism_calibration_rejected(ctx, result, NULL, 0));
  lh_mechanism_destroy(found);
  lh_mechanism_calibration_destroy(result);

  result = NULL;
  EXPECT(ctx, LH_EDEGENERATE,
         lh_mechanism_calibrate(ctx, guess, 2, cam_from_world, commanded, groups, bearings, NULL, NULL, &result));
  EXPECT(ctx, LH_EINVAL,
         lh_mechanism_calibrate(ctx, guess, kObservations, NULL, commanded, groups, bearings, NULL, NULL, &result));
  commanded[7] = NAN;
  EXPECT(ctx, LH_EINPUT,
         lh_mechanism_calibrate(ctx, guess, kObservations, cam_from_world, commanded, groups, bearings, NULL, NULL,
                                &result));
  CHECK_SAYS(ctx, "observation 1");
  cam_from_world[12 * 3] = NAN;
  EXPECT(ctx, LH_EINVAL,
         lh_mechanism_calibrate(ctx, guess, kObservations, cam_from_world, commanded, groups, bearings, NULL, NULL,
                                &result));
  memset(&options, 0, sizeof options);
  options.struct_size = 1;
  EXPECT(ctx, LH_EINVAL,
         lh_mechanism_calibrate(ctx, guess, kObservations, cam_from_world, commanded, groups, bearings, NULL, &options,
                                &result));
  CHECK(!result);
  lh_mechanism_calibration_destroy(NULL);
  lh_mechanism_destroy(truth);
}

int main(int argc, char **argv) {
  const char *scratch = argc > 1 ? argv[1] : ".";
  lh_context *ctx = lh_context_create();
  lh_mechanism *mechanism = NULL;
  if (!ctx) return 1;
  MUST(ctx, lh_mechanism_paper(ctx, &mechanism));
  lengths_and_tensions(ctx, mechanism);
  hanging(ctx, mechanism);
  clearances(ctx, mechanism);
  files(ctx, mechanism, scratch);
  wrong_use(ctx, mechanism);
  calibration(ctx, mechanism);
  lh_mechanism_destroy(mechanism);
  MUST(ctx, lh_mechanism_large(ctx, &mechanism));
  CHECK(lh_mechanism_cable_count(mechanism) == 6);
  lh_mechanism_destroy(mechanism);
  lh_context_destroy(ctx);
  return check_result();
}
