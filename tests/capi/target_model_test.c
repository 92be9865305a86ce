/* What the stage "calibrate" left in a capture, through the C interface. Arguments: a scratch folder, and the folder with
 * a target model that was made elsewhere. */
#include "check.h"

enum { kPhotos = 4, kPoints = 25 };

static void copy(const char *from, const char *to) {
  static char bytes[1 << 20];
  FILE *in = fopen(from, "rb"), *out = fopen(to, "wb");
  CHECK(in && out);
  if (in && out) fwrite(bytes, 1, fread(bytes, 1, sizeof bytes, in), out);
  if (in) fclose(in);
  if (out) fclose(out);
}

int main(int argc, char **argv) {
  static uint8_t black[15 * 10 * 3];
  const char *scratch = argc > 1 ? argv[1] : ".", *kept = argc > 2 ? argv[2] : ".";
  lh_context *ctx = lh_context_create();
  lh_camera camera = small_camera(15, 10, 20);
  lh_capture *capture = NULL;
  lh_target_model *model = NULL;
  lh_calibration figures;
  lh_solved_target target;
  lh_solved_photo photo;
  const double eye[3] = {1, 1, 2}, middle[3] = {0, 0, 0}, up[3] = {0, 0, 1};
  double pose[12], xyz[3 * kPoints], covariance[100], quality[36];
  int32_t names[3 * kPoints];
  size_t needed = 0;
  char folder[1000], file[1100], from[1100], text[4000];
  int i;
  if (!ctx) return 1;

  snprintf(folder, sizeof folder, "%s/target_model", scratch);
  MUST(ctx, lh_capture_create(ctx, folder, &capture));
  MUST(ctx, lh_capture_add_camera(ctx, capture, &camera));
  MUST(ctx, lh_capture_save(ctx, capture));
  MUST(ctx, lh_pose_look_at(ctx, eye, middle, up, pose));
  for (i = 0; i < kPhotos; ++i) {
    lh_image *picture = NULL;
    char name[16];
    snprintf(name, sizeof name, "p%d", i);
    snprintf(file, sizeof file, "%s/%s.png", folder, name);
    MUST(ctx, lh_image_from_array(ctx, black, 15, 10, 3, LH_PIXEL_U8, 0, &picture));
    MUST(ctx, lh_image_write_png(ctx, picture, file));
    lh_image_destroy(picture);
    snprintf(file, sizeof file, "%s.png", name);
    MUST(ctx, lh_capture_add_shot(ctx, capture, name, file, 0));
    if (i % 3 == 0) MUST(ctx, lh_capture_set_pose(ctx, capture, (size_t)i, pose));
  }

  EXPECT(ctx, LH_ENOTFOUND, lh_target_model_open(ctx, capture, &model));
  CHECK_SAYS(ctx, "calibrate");
  CHECK(!model && lh_target_model_count(model) == 0);
  snprintf(from, sizeof from, "%s/model.json", kept);
  snprintf(file, sizeof file, "%s/targets.json", folder);
  copy(from, file);
  MUST(ctx, lh_target_model_open(ctx, capture, &model));
  CHECK(lh_target_model_count(model) == 3);

  memset(&figures, 0, sizeof figures);
  figures.struct_size = sizeof figures;
  MUST(ctx, lh_target_model_calibration(ctx, model, &figures));
  CHECK(figures.photos == kPhotos && figures.photos_placed == 2);
  CHECK(figures.targets == 3 && figures.targets_placed == 2 && figures.removed == 3);
  CHECK(figures.rms_px == 0.061 && figures.sigma0 == 1.07 && figures.cross_validation_sigma == 1.1);
  CHECK(figures.print_scale[0] == 1.001 && figures.parts == 1);
  MUST(ctx, lh_target_model_describe(ctx, model, NULL, 0, &needed));
  CHECK(needed > 100 && needed < sizeof text);
  MUST(ctx, lh_target_model_describe(ctx, model, text, sizeof text, &needed));
  CHECK(strstr(text, "\"verdict\""));

  memset(&target, 0, sizeof target);
  target.struct_size = sizeof target;
  MUST(ctx, lh_target_model_get(ctx, model, 1, &target));
  CHECK(target.board == -1 && target.design == 0 && target.id == 1 && target.placed && target.points == kPoints);
  CHECK(target.photos == kPhotos && target.rms_px == 0.05 && fabs(target.world_from_body[3] + 0.15) < 1e-12);
  MUST(ctx, lh_target_model_name(ctx, model, 1, text, sizeof text, &needed));
  CHECK(strcmp(text, "matrix5x5 1") == 0);
  MUST(ctx, lh_target_model_points(ctx, model, 1, names, xyz, NULL, kPoints));
  CHECK(names[0] == 0 && names[1] == 1 && names[3 * kPoints - 1] == kPoints - 1 && isfinite(xyz[3 * kPoints - 1]));
  MUST(ctx, lh_target_model_points(ctx, model, 2, NULL, xyz, NULL, kPoints));
  CHECK(isnan(xyz[0]));
  EXPECT(ctx, LH_EINVAL, lh_target_model_points(ctx, model, 1, names, xyz, NULL, kPoints - 1));
  EXPECT(ctx, LH_EINVAL, lh_target_model_get(ctx, model, 3, &target));
  CHECK(target.part == 0 && memcmp(target.part_from_body, target.world_from_body, sizeof target.part_from_body) == 0);

  CHECK(lh_target_model_photo_count(model) == kPhotos && lh_target_model_photo_count(NULL) == 0);
  memset(&photo, 0, sizeof photo);
  photo.struct_size = sizeof photo;
  MUST(ctx, lh_target_model_photo(ctx, model, 3, &photo));
  CHECK(photo.camera == 1 && photo.part == 0 && photo.in_model == 1);
  CHECK(fabs(photo.cam_from_part[3] - pose[3]) < 1e-12 && fabs(photo.cam_from_part[11] - pose[11]) < 1e-12);
  MUST(ctx, lh_target_model_photo(ctx, model, 2, &photo));
  CHECK(photo.part == -1 && photo.in_model == 0);
  MUST(ctx, lh_target_model_photo_name(ctx, model, 2, text, sizeof text, &needed));
  CHECK(strcmp(text, "p2") == 0);
  MUST(ctx, lh_target_model_photo_reason(ctx, model, 2, text, sizeof text, &needed));
  CHECK(strcmp(text, "shows no target") == 0);
  EXPECT(ctx, LH_EINVAL, lh_target_model_photo(ctx, model, kPhotos, &photo));
  EXPECT(ctx, LH_EINVAL, lh_target_model_photo_reason(ctx, NULL, 0, text, sizeof text, &needed));
  EXPECT(ctx, LH_EINVAL, lh_target_model_calibration(ctx, NULL, &figures));

  EXPECT(ctx, LH_ENOTFOUND, lh_capture_pose_quality(ctx, capture, 0, quality, NULL, NULL));
  CHECK_SAYS(ctx, "p0");
  EXPECT(ctx, LH_ENOTFOUND, lh_capture_camera_covariance(ctx, capture, 0, covariance));
  EXPECT(ctx, LH_EINVAL, lh_capture_camera_covariance(ctx, capture, 1, covariance));

  /* Measured distances go to the stage as its other options do. */
  MUST(ctx, lh_capture_set_option(ctx, capture, "calibrate", "targets", "matrix5x5:18mm"));
  MUST(ctx, lh_capture_set_option(ctx, capture, "calibrate", "free_print_scale", "true"));
  EXPECT(ctx, LH_EINVAL, lh_capture_run_stage(ctx, capture, "calibrate", 0, NULL, NULL));
  CHECK_SAYS(ctx, "can only be told from scale bars");
  MUST(ctx, lh_capture_set_option(ctx, capture, "calibrate", "bar", "1.0,2.24,0.5,0.1mm;3.0,4.24,5ft"));
  MUST(ctx, lh_capture_get_option(ctx, capture, "calibrate", "bar", text, sizeof text, &needed));
  CHECK(strcmp(text, "1.0,2.24,0.5,0.1mm;3.0,4.24,5ft") == 0);
  EXPECT(ctx, LH_EINVAL, lh_capture_run_stage(ctx, capture, "calibrate", 0, NULL, NULL));
  CHECK_SAYS(ctx, "3.0,4.24,5ft");
  MUST(ctx, lh_capture_set_option(ctx, capture, "calibrate", "bar", "1.0,2.24,0.5"));
  EXPECT(ctx, LH_EDEGENERATE, lh_capture_run_stage(ctx, capture, "calibrate", 0, NULL, NULL)); /* black pictures */
  lh_target_model_destroy(model);
  lh_capture_destroy(capture);
  lh_context_destroy(ctx);
  return check_result();
}
