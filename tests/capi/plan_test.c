/* Plans through the C interface. */
#include "check.h"

enum { kCables = 6 };

#define NEAR(a, b, tolerance) CHECK(fabs((a) - (b)) <= (tolerance))

static lh_stop stop_of(lh_context *ctx, const lh_plan *plan, size_t i) {
  lh_stop stop;
  memset(&stop, 0, sizeof stop);
  stop.struct_size = sizeof stop;
  MUST(ctx, lh_plan_stop(ctx, plan, i, &stop));
  return stop;
}

static char *described(lh_context *ctx, const lh_plan *plan) {
  size_t needed = 0;
  char *text;
  MUST(ctx, lh_plan_describe(ctx, plan, NULL, 0, &needed));
  text = malloc(needed);
  if (!text) exit(1);
  MUST(ctx, lh_plan_describe(ctx, plan, text, needed, NULL));
  EXPECT(ctx, LH_EINVAL, lh_plan_describe(ctx, plan, text, needed - 1, NULL));
  return text;
}

/* Each stop on the hemisphere, its lengths those of its pose, its time in the sum. */
static void check_stops(lh_context *ctx, const lh_plan *plan, const lh_mechanism *mechanism) {
  double seconds = 0;
  size_t i, photographs = 0;
  for (i = 0; i < lh_plan_stop_count(plan); ++i) {
    const lh_stop stop = stop_of(ctx, plan, i);
    double lengths[kCables], expected[kCables];
    int k;
    seconds += stop.travel_s + stop.settle_s + stop.exposure_s;
    CHECK(stop.cables == kCables);
    MUST(ctx, lh_plan_stop_lengths(ctx, plan, i, lengths, kCables));
    MUST(ctx, lh_mechanism_lengths(ctx, mechanism, stop.world_from_platform, expected, kCables));
    for (k = 0; k < kCables; ++k) NEAR(lengths[k], expected[k], 1e-6);
    if (!stop.photograph) continue;
    ++photographs;
    NEAR(stop.world_from_platform[3], 1.5 * sin(stop.phi_rad) * cos(stop.theta_rad), 1e-9);
    NEAR(stop.world_from_platform[7], 1.5 * sin(stop.phi_rad) * sin(stop.theta_rad), 1e-9);
    NEAR(stop.world_from_platform[11], 1.5 * cos(stop.phi_rad), 1e-9);
    CHECK(stop.exposure_s == 0.25 && stop.settle_s == 7);
  }
  NEAR(lh_plan_duration(plan), seconds, 1e-6);
  CHECK(photographs >= 10 && photographs <= 18);
}

static void cables(lh_context *ctx, const char *scratch) {
  lh_mechanism *mechanism = NULL, *same = NULL;
  lh_plan *plan = NULL, *again = NULL;
  lh_plan_options options;
  lh_object_size ball;
  lh_keep_out object;
  const double center[3] = {0, 0, 0};
  double lengths[kCables];
  char file[1024], name[64], pause[256], *text;
  size_t needed = 0;
  MUST(ctx, lh_mechanism_paper(ctx, &mechanism));
  memset(&ball, 0, sizeof ball);
  ball.struct_size = sizeof ball;
  ball.diameter_m = 0.4;
  memset(&object, 0, sizeof object);
  object.struct_size = sizeof object;
  MUST(ctx, lh_object_keep_out(ctx, &ball, center, -1, &object));
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.mechanism = mechanism;
  options.object = &object;
  options.azimuths = 6, options.rows = 3, options.kicks = 10;
  options.exposure_s = 0.25;
  MUST(ctx, lh_plan_hemisphere(ctx, &options, &plan));
  check_stops(ctx, plan, mechanism);
  text = described(ctx, plan);
  CHECK(strstr(text, "\"robot\":\"cables\"") && strstr(text, "\"problems\":[]"));
  free(text);
  MUST(ctx, lh_plan_mechanism(ctx, plan, &same));
  CHECK(lh_mechanism_cable_count(same) == kCables);
  lh_mechanism_destroy(same);

  MUST(ctx, lh_plan_stop_name(ctx, plan, 0, NULL, 0, &needed));
  MUST(ctx, lh_plan_stop_name(ctx, plan, 0, name, needed, NULL));
  CHECK(strlen(name) + 1 == needed);
  MUST(ctx, lh_plan_stop_pause(ctx, plan, 0, pause, sizeof pause, NULL));
  EXPECT(ctx, LH_EINVAL, lh_plan_stop_name(ctx, plan, 0, name, needed - 1, NULL));
  EXPECT(ctx, LH_EINVAL, lh_plan_stop_lengths(ctx, plan, 0, lengths, kCables - 1));
  EXPECT(ctx, LH_EINVAL, lh_plan_stop_name(ctx, plan, lh_plan_stop_count(plan), name, sizeof name, NULL));

  snprintf(file, sizeof file, "%s/plan.json", scratch);
  MUST(ctx, lh_plan_save(ctx, plan, file));
  MUST(ctx, lh_plan_load(ctx, file, &again));
  CHECK(lh_plan_stop_count(again) == lh_plan_stop_count(plan) && lh_plan_duration(again) == lh_plan_duration(plan));
  CHECK(stop_of(ctx, again, 3).theta_rad == stop_of(ctx, plan, 3).theta_rad);
  lh_plan_destroy(again);
  lh_plan_destroy(plan);

  plan = NULL;
  options.raster = 1;
  MUST(ctx, lh_plan_hemisphere(ctx, &options, &plan));
  check_stops(ctx, plan, mechanism);
  lh_plan_destroy(plan);

  plan = NULL;
  options.radius_m = 50; /* beyond the walls */
  EXPECT(ctx, LH_EDEGENERATE, lh_plan_hemisphere(ctx, &options, &plan));
  options.radius_m = NAN;
  EXPECT(ctx, LH_EINVAL, lh_plan_hemisphere(ctx, &options, &plan));
  options.radius_m = 0;
  options.robot = "hand";
  EXPECT(ctx, LH_EINVAL, lh_plan_hemisphere(ctx, &options, &plan));
  CHECK_SAYS(ctx, "robot");
  options.robot = NULL;
  object.struct_size = 2;
  EXPECT(ctx, LH_EINVAL, lh_plan_hemisphere(ctx, &options, &plan));
  object.struct_size = sizeof object;
  lh_context_cancel(ctx);
  EXPECT(ctx, LH_ECANCELLED, lh_plan_hemisphere(ctx, &options, &plan));
  lh_context_clear_cancel(ctx);
  CHECK(!plan);
  lh_mechanism_destroy(mechanism);
}

static void turntable(lh_context *ctx) {
  const double center[3] = {0, 0, 0};
  lh_optics optics;
  lh_object_size ball;
  lh_plan_options options;
  lh_plan_report report;
  lh_plan *plan = NULL;
  lh_camera camera;
  lh_mechanism *mechanism = NULL;
  double radius = 0;
  char pause[256];
  memset(&optics, 0, sizeof optics);
  optics.struct_size = sizeof optics;
  optics.focal_length_mm = 50;
  memset(&ball, 0, sizeof ball);
  ball.struct_size = sizeof ball;
  ball.diameter_m = 0.3;
  MUST(ctx, lh_optics_fill_radius(ctx, &optics, &ball, 0, 0.1, 0, &radius));
  memset(&camera, 0, sizeof camera);
  camera.struct_size = sizeof camera;
  MUST(ctx, lh_optics_camera(ctx, &optics, radius, &camera));
  /* A ball of radius r at the distance d is seen up to f tan(asin(r / d)) from the middle; 0.1 on each side are free.
   */
  NEAR(2 * camera.f * tan(asin(0.15 / radius)) / camera.height, 0.8, 0.01);

  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.robot = "turntable";
  options.cameras = "left,right";
  options.radius_m = radius;
  options.azimuths = 8, options.rows = 3;
  options.phi_from_rad = 0.3, options.phi_to_rad = 1.2;
  options.settle_s = -1;
  options.travel_s = 2;
  MUST(ctx, lh_plan_hemisphere(ctx, &options, &plan));
  CHECK(lh_plan_stop_count(plan) == 24);
  NEAR(lh_plan_duration(plan), 23 * 2 + 24 * 0.5, 1e-9);
  CHECK(stop_of(ctx, plan, 0).cables == 0);
  MUST(ctx, lh_plan_stop_lengths(ctx, plan, 0, NULL, 0));
  MUST(ctx, lh_plan_stop_pause(ctx, plan, 8, pause, sizeof pause, NULL));
  CHECK(strstr(pause, "Move the camera"));
  EXPECT(ctx, LH_ENOTFOUND, lh_plan_mechanism(ctx, plan, &mechanism));

  memset(&report, 0, sizeof report);
  report.struct_size = sizeof report;
  MUST(ctx, lh_plan_judge(ctx, plan, &camera, &ball, center, &report));
  CHECK(report.cables_in_picture >= 0 && (size_t)report.cables_in_picture <= report.photographs);
  CHECK(report.photographs == 24 && report.cut_off == 0 && report.least_margin_px > 0);
  NEAR(report.median_fill, 0.8, 0.01);
  ball.diameter_m = 0.5;
  MUST(ctx, lh_plan_judge(ctx, plan, &camera, &ball, center, &report));
  CHECK(report.cut_off == 24 && report.least_margin_px < 0);
  ball.diameter_m = -1;
  EXPECT(ctx, LH_EINVAL, lh_plan_judge(ctx, plan, &camera, &ball, center, &report));
  EXPECT(ctx, LH_EINVAL, lh_plan_judge(ctx, plan, &camera, NULL, center, &report));
  EXPECT(ctx, LH_EINVAL, lh_optics_fill_radius(ctx, &optics, &ball, 0, 0.1, 0, &radius));
  optics.focal_length_mm = -1;
  EXPECT(ctx, LH_EINVAL, lh_optics_camera(ctx, &optics, radius, &camera));
  lh_plan_destroy(plan);

  plan = NULL;
  options.cameras = "left,left";
  EXPECT(ctx, LH_EINPUT, lh_plan_hemisphere(ctx, &options, &plan));
  options.cameras = NULL;
  options.robot = "drone";
  EXPECT(ctx, LH_EINVAL, lh_plan_hemisphere(ctx, &options, &plan));
  options.robot = NULL;
  options.bearing = 9;
  EXPECT(ctx, LH_EINVAL, lh_plan_hemisphere(ctx, &options, &plan));
  options.bearing = 0;
  options.struct_size = 0;
  EXPECT(ctx, LH_EINVAL, lh_plan_hemisphere(ctx, &options, &plan));
  EXPECT(ctx, LH_EINVAL, lh_plan_hemisphere(ctx, NULL, NULL));
  EXPECT(ctx, LH_ENOTFOUND, lh_plan_load(ctx, "/nowhere/plan.json", &plan));
  CHECK(!plan && lh_plan_stop_count(NULL) == 0 && lh_plan_duration(NULL) == 0);
  lh_plan_destroy(NULL);
}

int main(int argc, char **argv) {
  lh_context *ctx = lh_context_create();
  if (!ctx) return 1;
  cables(ctx, argc > 1 ? argv[1] : ".");
  turntable(ctx);
  lh_context_destroy(ctx);
  return check_result();
}
