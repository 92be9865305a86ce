/* The whole main job through the C interface: photographs by the virtual rig in; silhouettes, hull, texture, new views
 * and their quality out. Arguments: the rig's folder (P.txt, photos, enclosure, truth), an empty folder to work in. */
#include "check.h"

enum { kPath = 4096 };

static char rig[kPath], scratch[kPath];

static const char *in(const char *folder, const char *name) {
  static char path[4][2 * kPath];
  static int next = 0;
  next = (next + 1) % 4;
  snprintf(path[next], sizeof path[next], "%s/%s", folder, name);
  return path[next];
}

typedef struct {
  int stages, lines;
  char names[256];
} Said;

static void on_stage(void *user, const lh_stage_result *result) {
  Said *said = user;
  uint32_t i;
  CHECK(result->struct_size == sizeof *result);
  ++said->stages;
  strncat(said->names, result->stage, sizeof said->names - strlen(said->names) - 2);
  strcat(said->names, result->skipped ? "- " : " ");
  for (i = 0; i < result->line_count; ++i) said->lines += result->lines[i][0] != '\0';
}

static int progress_calls;

static void on_progress(void *user, const lh_progress *progress) {
  CHECK(user == &progress_calls && progress->done <= progress->total);
  ++progress_calls;
}

static char *text_of(lh_context *ctx, lh_capture *capture,
                     lh_status (*call)(lh_context *, const lh_capture *, char *, size_t, size_t *)) {
  size_t needed = 0;
  char *text;
  MUST(ctx, call(ctx, capture, NULL, 0, &needed));
  text = malloc(needed);
  if (!text) exit(1);
  MUST(ctx, call(ctx, capture, text, needed, NULL));
  return text;
}

/* The first number after "name": in a JSON text. */
static double number_in(const char *json, const char *name) {
  char quoted[64];
  const char *at;
  snprintf(quoted, sizeof quoted, "\"%s\":", name);
  at = strstr(json, quoted);
  CHECK(at != NULL);
  return at ? strtod(at + strlen(quoted), NULL) : NAN;
}

/* The masks that keying made, against the truth. */
static void compare_masks(lh_context *ctx, const lh_capture *capture) {
  const size_t n = lh_capture_shot_count(capture);
  double mean = 0;
  size_t i;
  for (i = 0; i < n; ++i) {
    char name[256], file[512];
    double iou = 0;
    lh_image *mask = NULL, *truth = NULL;
    MUST(ctx, lh_capture_shot_name(ctx, capture, i, name, sizeof name, NULL));
    snprintf(file, sizeof file, "truth/masks/%s.png", name);
    MUST(ctx, lh_capture_read_mask(ctx, capture, i, &mask));
    MUST(ctx, lh_image_read(ctx, in(rig, file), NULL, &truth));
    MUST(ctx, lh_mask_iou(ctx, lh_image_data(mask), lh_image_data(truth), lh_image_width(mask), lh_image_height(mask),
                          &iou));
    mean += iou / (double)n;
    lh_image_destroy(mask);
    lh_image_destroy(truth);
  }
  printf("silhouettes: IoU %.4f\n", mean);
  CHECK(mean > 0.96);
}

/* The same hull from arrays, without the capture folder's stage. */
static void carve_again(lh_context *ctx, const lh_capture *capture, double volume) {
  const size_t n = lh_capture_shot_count(capture);
  lh_camera *cameras = calloc(n, sizeof *cameras);
  double *poses = calloc(n, 12 * sizeof *poses), again = 0;
  const uint8_t **masks = calloc(n, sizeof *masks);
  lh_image **images = calloc(n, sizeof *images);
  lh_carve_options options;
  lh_mesh *mesh = NULL;
  size_t i, used = 0;
  if (!cameras || !poses || !masks || !images) exit(1);
  for (i = 0; i < n; ++i) {
    int32_t held_out = 0;
    size_t camera = 0;
    MUST(ctx, lh_capture_shot_held_out(ctx, capture, i, &held_out));
    if (held_out) continue;
    MUST(ctx, lh_capture_shot_camera(ctx, capture, i, &camera));
    cameras[used].struct_size = sizeof *cameras;
    MUST(ctx, lh_capture_get_camera(ctx, capture, camera, &cameras[used]));
    MUST(ctx, lh_capture_get_pose(ctx, capture, i, poses + 12 * used));
    MUST(ctx, lh_capture_read_mask(ctx, capture, i, &images[used]));
    masks[used] = lh_image_data(images[used]);
    ++used;
  }
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.resolution = 80;
  MUST(ctx, lh_hull_carve(ctx, used, cameras, poses, masks, &options, &mesh));
  MUST(ctx, lh_mesh_volume(ctx, mesh, &again));
  CHECK(fabs(again - volume) < 0.05 * volume);
  lh_mesh_destroy(mesh);
  for (i = 0; i < used; ++i) lh_image_destroy(images[i]);
  free(images);
  free(masks);
  free(poses);
  free(cameras);
}

/* Renders the first (held-out) photograph's view and compares. */
static void render(lh_context *ctx, const lh_capture *capture, const char *method) {
  lh_renderer *renderer = NULL;
  lh_camera camera, around;
  lh_image *photo = NULL, *mask = NULL;
  double pose[12], turntable[3 * 12], psnr = 0;
  size_t size, i, hit = 0;
  uint8_t *rgba, *rgb;
  float *depth;
  camera.struct_size = around.struct_size = sizeof camera;
  MUST(ctx, lh_capture_get_camera(ctx, capture, 0, &camera));
  MUST(ctx, lh_capture_get_pose(ctx, capture, 0, pose));
  MUST(ctx, lh_renderer_create(ctx, capture, method, &renderer));
  size = (size_t)camera.width * (size_t)camera.height;
  rgba = malloc(4 * size);
  rgb = malloc(3 * size);
  depth = malloc(size * sizeof *depth);
  if (!rgba || !rgb || !depth) exit(1);
  EXPECT(ctx, LH_EINVAL, lh_renderer_render(ctx, renderer, &camera, pose, 0, rgba, 4 * size - 1, NULL));
  CHECK_SAYS(ctx, "rgba_size");
  MUST(ctx, lh_renderer_render(ctx, renderer, &camera, pose, 2, rgba, 4 * size, depth));
  for (i = 0; i < size; ++i) {
    memcpy(rgb + 3 * i, rgba + 4 * i, 3);
    if (rgba[4 * i + 3] == 255) {
      CHECK(depth[i] > 0 && depth[i] < 1e3f);
      ++hit;
    }
    if (rgba[4 * i + 3] == 0) CHECK(isinf(depth[i]));
  }
  CHECK(hit > size / 50);
  if (strcmp(method, "shaded") != 0) {
    MUST(ctx, lh_capture_read_photo(ctx, capture, 0, &photo));
    MUST(ctx, lh_capture_read_mask(ctx, capture, 0, &mask));
    MUST(ctx, lh_picture_psnr(ctx, rgb, lh_image_data(photo), lh_image_data(mask), camera.width, camera.height, &psnr));
    printf("%s: PSNR inside %.2f dB\n", method, psnr);
    CHECK(psnr > 18);
  }
  MUST(ctx, lh_renderer_turntable(ctx, renderer, 3, 64, 48, 0.3, &around, turntable));
  CHECK(around.width == 64 && around.height == 48);
  MUST(ctx, lh_renderer_render(ctx, renderer, &around, turntable + 12, 1, rgba, 4 * size, NULL));
  for (hit = 0, i = 0; i < 64 * 48; ++i) hit += rgba[4 * i + 3] > 0;
  CHECK(hit > 64 * 48 / 50);
  lh_image_destroy(photo);
  lh_image_destroy(mask);
  lh_renderer_destroy(renderer);
  free(rgba);
  free(rgb);
  free(depth);
}

/* A turntable's second frame, 96 x 72. */
static void second_frame(lh_context *ctx, lh_renderer *renderer, const lh_camera *camera, const double *pose,
                         uint8_t rgba[96 * 72 * 4]) {
  size_t i, hit = 0;
  MUST(ctx, lh_renderer_render(ctx, renderer, camera, pose, 2, rgba, 96 * 72 * 4, NULL));
  for (i = 0; i < 96 * 72; ++i) hit += rgba[4 * i + 3] > 0;
  CHECK(hit > 96 * 72 / 50);
}

/* A model's file shows what the capture shows by `method`; with_up: it knows which way is up, too. */
static void render_alone(lh_context *ctx, const lh_capture *capture, const char *method, const char *file,
                         int with_up) {
  static uint8_t of_capture[96 * 72 * 4], alone[96 * 72 * 4];
  lh_renderer *a = NULL, *b = NULL;
  lh_camera camera;
  double poses[2 * 12], again[2 * 12];
  int i;
  memset(&camera, 0, sizeof camera);
  camera.struct_size = sizeof camera;
  MUST(ctx, lh_renderer_create(ctx, capture, method, &a));
  MUST(ctx, lh_renderer_open(ctx, file, &b));
  MUST(ctx, lh_renderer_turntable(ctx, a, 2, 96, 72, 0.3, &camera, poses));
  second_frame(ctx, a, &camera, poses + 12, of_capture);
  second_frame(ctx, b, &camera, poses + 12, alone);
  CHECK(memcmp(of_capture, alone, sizeof alone) == 0);
  MUST(ctx, lh_renderer_turntable(ctx, b, 2, 96, 72, 0.3, &camera, again));
  second_frame(ctx, b, &camera, again + 12, alone);
  if (with_up)
    for (i = 0; i < 24; ++i) CHECK(fabs(poses[i] - again[i]) < 1e-4);
  lh_renderer_destroy(a);
  lh_renderer_destroy(b);
}

/* Rays only where they are needed: the same outline, colours and depth nearly the same, until it is switched off. */
static void render_adaptively(lh_context *ctx, const lh_capture *capture, const char *method) {
  enum { kWidth = 160, kHeight = 120, kPixels = kWidth * kHeight };
  static uint8_t everywhere[4 * kPixels], adaptive[4 * kPixels];
  static uint8_t rgb[2][3 * kPixels], inside[kPixels];
  static float depth[2][kPixels];
  lh_renderer *renderer = NULL;
  lh_camera camera;
  double poses[2 * 12], psnr = 0, farthest = 0;
  size_t i;
  memset(&camera, 0, sizeof camera);
  camera.struct_size = sizeof camera;
  MUST(ctx, lh_renderer_create(ctx, capture, method, &renderer));
  MUST(ctx, lh_renderer_turntable(ctx, renderer, 2, kWidth, kHeight, 0.3, &camera, poses));
  MUST(ctx, lh_renderer_render(ctx, renderer, &camera, poses + 12, 4, everywhere, sizeof everywhere, depth[0]));
  MUST(ctx, lh_renderer_set_adaptive(ctx, renderer, 1));
  MUST(ctx, lh_renderer_render(ctx, renderer, &camera, poses + 12, 4, adaptive, sizeof adaptive, depth[1]));
  CHECK(memcmp(adaptive, everywhere, sizeof adaptive) != 0);
  for (i = 0; i < kPixels; ++i) {
    CHECK(adaptive[4 * i + 3] == everywhere[4 * i + 3]);
    memcpy(rgb[0] + 3 * i, everywhere + 4 * i, 3);
    memcpy(rgb[1] + 3 * i, adaptive + 4 * i, 3);
    inside[i] = everywhere[4 * i + 3];
    CHECK(isinf(depth[0][i]) == isinf(depth[1][i]));
    if (!isinf(depth[0][i]) && fabs(depth[0][i] - depth[1][i]) / depth[0][i] > farthest)
      farthest = fabs(depth[0][i] - depth[1][i]) / depth[0][i];
  }
  MUST(ctx, lh_picture_psnr(ctx, rgb[0], rgb[1], inside, kWidth, kHeight, &psnr));
  printf("adaptive, %s: PSNR inside %.2f dB; depth off by at most %.2g of it\n", method, psnr, farthest);
  CHECK(psnr > 32);
  CHECK(farthest < 0.01);
  MUST(ctx, lh_renderer_set_adaptive(ctx, renderer, 0));
  MUST(ctx, lh_renderer_render(ctx, renderer, &camera, poses + 12, 4, adaptive, sizeof adaptive, NULL));
  CHECK(memcmp(adaptive, everywhere, sizeof adaptive) == 0);
  lh_renderer_destroy(renderer);
}

/* Files that are no models. */
static void open_wrong_files(lh_context *ctx) {
  lh_renderer *renderer = NULL;
  const char *words = in(scratch, "words.glb");
  FILE *file = fopen(words, "wb");
  if (!file || fputs("these are no triangles, but they are long enough", file) < 0 || fclose(file)) exit(1);
  EXPECT(ctx, LH_EINPUT, lh_renderer_open(ctx, words, &renderer));
  CHECK_SAYS(ctx, "words.glb");
  EXPECT(ctx, LH_ENOTFOUND, lh_renderer_open(ctx, in(scratch, "nowhere.glb"), &renderer));
  CHECK_SAYS(ctx, "nowhere.glb");
  EXPECT(ctx, LH_EINVAL, lh_renderer_open(ctx, NULL, &renderer));
  EXPECT(ctx, LH_EINVAL, lh_renderer_open(ctx, "", &renderer));
  EXPECT(ctx, LH_EINVAL, lh_renderer_open(ctx, words, NULL));
  CHECK(renderer == NULL);
}

/* The capture beside the rig's truth: matrices are exact, silhouettes nearly so. */
static void compare_with_truth(lh_context *ctx, const lh_capture *capture) {
  lh_truth_comparison *comparison = NULL;
  char *json;
  FILE *page;
  size_t needed = 0;
  EXPECT(ctx, LH_ENOTFOUND, lh_truth_compare(ctx, capture, in(rig, "photos"), &comparison));
  EXPECT(ctx, LH_EINVAL, lh_truth_compare(ctx, capture, in(rig, "truth"), NULL));
  CHECK(comparison == NULL);
  MUST(ctx, lh_truth_compare(ctx, capture, in(rig, "truth"), &comparison));
  MUST(ctx, lh_truth_comparison_describe(ctx, comparison, NULL, 0, &needed));
  json = malloc(needed);
  if (!json) exit(1);
  MUST(ctx, lh_truth_comparison_describe(ctx, comparison, json, needed, &needed));
  CHECK(strstr(json, "\"poses\"") && strstr(json, "\"masks\"") && strstr(json, "\"surface\""));
  CHECK(number_in(json, "iou_mean") > 0.96);
  CHECK(fabs(number_in(json, "focal_error_percent")) < 1e-6);
  free(json);
  MUST(ctx, lh_truth_comparison_page(ctx, comparison, capture, in(scratch, "truth.html")));
  page = fopen(in(scratch, "truth.html"), "rb");
  CHECK(page != NULL);
  if (page) fclose(page);
  lh_truth_comparison_destroy(comparison);
  lh_truth_comparison_destroy(NULL);
}

int main(int argc, char **argv) {
  lh_context *ctx = lh_context_create();
  lh_capture *capture = NULL, *copy = NULL;
  lh_mesh *hull = NULL;
  Said said;
  double volume = 0, largest = -1;
  char *json;
  char empty[2][kPath + 32];
  const char *enclosure[2];
  const char *nerf;
  if (argc != 3 || !ctx) return 2;
  snprintf(rig, sizeof rig, "%s", argv[1]);
  snprintf(scratch, sizeof scratch, "%s", argv[2]);
  memset(&said, 0, sizeof said);

  MUST(ctx, lh_context_set_progress(ctx, on_progress, &progress_calls));
  MUST(ctx, lh_capture_import_projections(ctx, in(rig, "P.txt"), in(scratch, "job"), NULL, &capture));
  CHECK(lh_capture_shot_count(capture) == 24 && lh_capture_camera_count(capture) >= 1);
  EXPECT(ctx, LH_EINVAL, lh_capture_import_projections(ctx, in(rig, "P.txt"), in(scratch, "job"), NULL, &copy));
  snprintf(empty[0], sizeof empty[0], "%s", in(rig, "enclosure/empty_0001.png"));
  snprintf(empty[1], sizeof empty[1], "%s", in(rig, "enclosure/empty_0002.png"));
  enclosure[0] = empty[0];
  enclosure[1] = empty[1];
  MUST(ctx, lh_capture_import_enclosure(ctx, capture, enclosure, 2, 1));
  MUST(ctx, lh_capture_set_hold_out(ctx, capture, 6));
  MUST(ctx, lh_capture_set_option(ctx, capture, "hull", "resolution", "80"));

  EXPECT(ctx, LH_ENOTFOUND, lh_capture_read_hull(ctx, capture, &hull));
  EXPECT(ctx, LH_ENOTFOUND, lh_renderer_create(ctx, capture, "lumigraph", (lh_renderer **)&hull));
  CHECK_SAYS(ctx, "hull");
  MUST(ctx, lh_capture_run(ctx, capture, 0, on_stage, &said));
  printf("stages: %s\n", said.names);
  CHECK(said.stages == (int)lh_stage_count() && said.lines >= 4 && progress_calls > 0);

  compare_masks(ctx, capture);
  MUST(ctx, lh_capture_read_hull(ctx, capture, &hull));
  MUST(ctx, lh_mesh_volume(ctx, hull, &volume));
  {
    lh_mesh *truth = NULL;
    double true_volume = 0;
    MUST(ctx, lh_mesh_read(ctx, in(rig, "truth/mesh.ply"), &truth));
    MUST(ctx, lh_mesh_volume(ctx, truth, &true_volume));
    printf("hull: %zu triangles, %.3f of the true volume\n", lh_mesh_triangle_count(hull), volume / true_volume);
    CHECK(volume > true_volume && volume < 1.15 * true_volume);
    lh_mesh_destroy(truth);
  }
  carve_again(ctx, capture, volume);
  render(ctx, capture, "lumigraph");
  render(ctx, capture, "mean_texture");
  render(ctx, capture, "shaded");

  /* The light field, in its own stage, and from its file alone. */
  EXPECT(ctx, LH_EINVAL, lh_capture_set_option(ctx, capture, "lightfield", "factorization", "svd"));
  MUST(ctx, lh_capture_set_option(ctx, capture, "lightfield", "terms", "3"));
  memset(&said, 0, sizeof said);
  MUST(ctx, lh_capture_run_stage(ctx, capture, "lightfield", 0, on_stage, &said));
  CHECK(strcmp(said.names, "lightfield ") == 0);
  render(ctx, capture, "light_field");
  render_adaptively(ctx, capture, "light_field");
  render_adaptively(ctx, capture, "lumigraph");
  render_adaptively(ctx, capture, "mean_texture");
  render_alone(ctx, capture, "light_field", in(scratch, "job/light_field.glb"), 1);
  render_alone(ctx, capture, "mean_texture", in(scratch, "job/textured.glb"), 0);
  open_wrong_files(ctx);

  json = text_of(ctx, capture, lh_capture_evaluation);
  CHECK(number_in(json, "photos_held_out") == 4);
  CHECK(number_in(json, "silhouette_iou") > 0.9);
  CHECK(number_in(json, "psnr") > 18);
  free(json);
  json = text_of(ctx, capture, lh_capture_describe);
  CHECK(strstr(json, "hull") != NULL);
  free(json);
  compare_with_truth(ctx, capture);

  /* Nothing has changed: every stage is skipped. */
  memset(&said, 0, sizeof said);
  MUST(ctx, lh_capture_run(ctx, capture, 0, on_stage, &said));
  printf("again: %s\n", said.names);
  CHECK(strstr(said.names, "key- ") && strstr(said.names, "hull- ") && strstr(said.names, "texture- "));

  /* A cancelled stage leaves the old result in place. */
  lh_context_cancel(ctx);
  EXPECT(ctx, LH_ECANCELLED, lh_capture_run_stage(ctx, capture, "hull", 1, NULL, NULL));
  lh_context_clear_cancel(ctx);
  lh_mesh_destroy(hull);
  MUST(ctx, lh_capture_read_hull(ctx, capture, &hull));
  lh_mesh_destroy(hull);

  /* Out and in again. */
  nerf = in(scratch, "transforms.json");
  MUST(ctx, lh_capture_export_nerf(ctx, capture, nerf, 0, &largest));
  CHECK(largest >= 0 && largest < 0.01);
  {
    lh_import_options options;
    double before[12], after[12];
    int i;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    options.reference = 1;
    MUST(ctx, lh_capture_import_nerf(ctx, &nerf, 1, in(scratch, "from_nerf"), &options, &copy));
    CHECK(lh_capture_shot_count(copy) == 24);
    MUST(ctx, lh_capture_get_pose(ctx, capture, 5, before));
    MUST(ctx, lh_capture_get_pose(ctx, copy, 5, after));
    for (i = 0; i < 12; ++i) CHECK(fabs(before[i] - after[i]) < 1e-6);
    lh_capture_destroy(copy);
  }
  MUST(ctx, lh_capture_export_colmap(ctx, capture, in(scratch, "colmap"), 0, NULL));
  MUST(ctx, lh_capture_save(ctx, capture));
  lh_capture_destroy(capture);
  lh_context_destroy(ctx);
  return check_result();
}
