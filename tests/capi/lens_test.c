/* Lens calibration through the C interface. */
#include "check.h"

enum { kViews = 6, kColumns = 7, kRows = 6, kPoints = kColumns * kRows, kAll = kViews * kPoints };

/* Exact pixels of a plane from places around it. */
static void make_views(lh_context *ctx, const lh_camera *camera, size_t *counts, double *pixels, double *points) {
  const double middle[3] = {0.09, 0.075, 0}, up[3] = {0, -1, 0.1};
  int v, i;
  for (v = 0; v < kViews; ++v) {
    const double eye[3] = {0.09 + 0.25 * cos(1.1 * v), 0.075 + 0.2 * sin(1.1 * v), -0.42 - 0.02 * v};
    double pose[12], in_camera[3 * kPoints];
    MUST(ctx, lh_pose_look_at(ctx, eye, middle, up, pose));
    counts[v] = kPoints;
    for (i = 0; i < kPoints; ++i) {
      double *p = points + 3 * (v * kPoints + i);
      int k;
      p[0] = 0.03 * (i % kColumns), p[1] = 0.03 * (i / kColumns), p[2] = 0;
      for (k = 0; k < 3; ++k)
        in_camera[3 * i + k] = pose[4 * k] * p[0] + pose[4 * k + 1] * p[1] + pose[4 * k + 2] * p[2] + pose[4 * k + 3];
    }
    MUST(ctx, lh_camera_project(ctx, camera, in_camera, kPoints, pixels + 2 * v * kPoints, NULL));
  }
}

int main(int argc, char **argv) {
  static double pixels[2 * kAll], points[3 * kAll], errors[2 * kAll];
  static uint8_t outlier[kAll];
  const char *scratch = argc > 1 ? argv[1] : ".";
  lh_context *ctx = lh_context_create();
  lh_camera truth = small_camera(1200, 900, 1300), found;
  lh_lens_options options;
  lh_lens_statistics statistics;
  lh_lens *lens = NULL, *again = NULL;
  size_t counts[kViews], needed = 0;
  double covariance[100], pose[12], sigma[12];
  char file[1024], text[512];
  if (!ctx) return 1;
  truth.k1 = 0.1, truth.k2 = -0.02, truth.p1 = 1e-3;
  make_views(ctx, &truth, counts, pixels, points);

  MUST(ctx, lh_lens_calibrate(ctx, kViews, counts, pixels, points, NULL, NULL, NULL, 1200, 900, NULL, NULL, &lens));
  memset(&found, 0, sizeof found);
  found.struct_size = sizeof found;
  MUST(ctx, lh_lens_camera(ctx, lens, &found));
  CHECK(fabs(found.f - 1300) < 1e-4 && fabs(found.k1 - 0.1) < 1e-7 && found.s == 1 && found.k3 == 0);
  MUST(ctx, lh_lens_covariance(ctx, lens, covariance));
  CHECK(covariance[0] > 0 && covariance[11] == 0 && covariance[3] == covariance[30]);
  memset(&statistics, 0, sizeof statistics);
  statistics.struct_size = sizeof statistics;
  MUST(ctx, lh_lens_get_statistics(ctx, lens, &statistics));
  CHECK(statistics.points == kAll && statistics.outliers == 0 && statistics.rms_px < 1e-6);
  MUST(ctx, lh_lens_pose(ctx, lens, 5, pose));
  CHECK(pose[11] > 0.4 && pose[11] < 0.7);
  EXPECT(ctx, LH_EINVAL, lh_lens_pose(ctx, lens, kViews, pose));
  MUST(ctx, lh_lens_residuals(ctx, lens, errors, outlier, kAll));
  CHECK(fabs(errors[0]) < 1e-6 && outlier[0] == 0);
  EXPECT(ctx, LH_EINVAL, lh_lens_residuals(ctx, lens, errors, outlier, kAll - 1));
  MUST(ctx, lh_lens_uncertainty(ctx, lens, 4, 3, sigma));
  CHECK(sigma[0] > 0 && sigma[0] < 100);
  EXPECT(ctx, LH_EINVAL, lh_lens_uncertainty(ctx, lens, 0, 3, sigma));
  if (lh_lens_problem_count(lens) > 0) MUST(ctx, lh_lens_problem(ctx, lens, 0, text, sizeof text, &needed));
  EXPECT(ctx, LH_EINVAL, lh_lens_problem(ctx, lens, 99, text, sizeof text, &needed));

  snprintf(file, sizeof file, "%s/camera.json", scratch);
  MUST(ctx, lh_lens_save(ctx, lens, file));
  MUST(ctx, lh_lens_load(ctx, file, &again));
  MUST(ctx, lh_lens_camera(ctx, again, &found));
  CHECK(fabs(found.f - 1300) < 1e-4);
  lh_lens_destroy(again);
  lh_lens_destroy(lens);
  lens = NULL;

  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.free_parameters = LH_INTRINSIC_F;
  MUST(ctx,
       lh_lens_calibrate(ctx, kViews, counts, pixels, points, NULL, NULL, NULL, 1200, 900, &truth, &options, &lens));
  MUST(ctx, lh_lens_covariance(ctx, lens, covariance));
  CHECK(covariance[0] > 0 && covariance[33] == 0);
  lh_lens_destroy(lens);
  lens = NULL;

  options.free_parameters = 1u << 20;
  EXPECT(ctx, LH_EINVAL,
         lh_lens_calibrate(ctx, kViews, counts, pixels, points, NULL, NULL, NULL, 1200, 900, NULL, &options, &lens));
  CHECK_SAYS(ctx, "free_parameters");
  EXPECT(ctx, LH_EINVAL,
         lh_lens_calibrate(ctx, kViews, NULL, pixels, points, NULL, NULL, NULL, 1200, 900, NULL, NULL, &lens));
  EXPECT(ctx, LH_EINVAL,
         lh_lens_calibrate(ctx, kViews, counts, NULL, points, NULL, NULL, NULL, 1200, 900, NULL, NULL, &lens));
  EXPECT(ctx, LH_EDEGENERATE,
         lh_lens_calibrate(ctx, 0, NULL, NULL, NULL, NULL, NULL, NULL, 1200, 900, NULL, NULL, &lens));
  counts[2] = (size_t)-1;
  EXPECT(ctx, LH_EINVAL,
         lh_lens_calibrate(ctx, kViews, counts, pixels, points, NULL, NULL, NULL, 1200, 900, NULL, NULL, &lens));
  counts[2] = kPoints;
  pixels[40] = NAN;
  EXPECT(ctx, LH_EINVAL,
         lh_lens_calibrate(ctx, kViews, counts, pixels, points, NULL, NULL, NULL, 1200, 900, NULL, NULL, &lens));
  EXPECT(ctx, LH_ENOTFOUND, lh_lens_load(ctx, "/nowhere/camera.json", &lens));
  CHECK(lens == NULL);
  lh_lens_destroy(NULL);
  lh_context_destroy(ctx);
  return check_result();
}
