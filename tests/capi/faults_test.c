/* Wrong use: a status and one line that names the argument, outputs untouched, no crash. */
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include <sys/stat.h>
#include <time.h>

#include "check.h"

static void no_context(void) {
  double out[12];
  const double v[3] = {0, 0, 1};
  lh_context_destroy(NULL);
  lh_context_cancel(NULL);
  lh_context_clear_cancel(NULL);
  CHECK(lh_context_cancelled(NULL) == 0);
  CHECK(lh_context_status(NULL) == LH_EINVAL);
  CHECK(lh_context_message(NULL) && lh_context_subject(NULL));
  CHECK(lh_context_set_threads(NULL, 1) == LH_EINVAL);
  CHECK(lh_pose_look_at(NULL, v, v, v, out) == LH_EINVAL);
}

static void nulls(lh_context *ctx) {
  lh_camera camera = small_camera(10, 10, 10);
  double numbers[12] = {0};
  lh_image *image = NULL;
  lh_mesh *mesh = NULL;
  lh_capture *capture = NULL;
  size_t needed = 77;
  uint8_t bytes[12] = {0};

  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, NULL, numbers, 1, numbers, NULL));
  CHECK_SAYS(ctx, "camera");
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera, NULL, 1, numbers, NULL));
  CHECK_SAYS(ctx, "points");
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera, numbers, 1, NULL, NULL));
  CHECK_SAYS(ctx, "pixels");
  EXPECT(ctx, LH_EINVAL, lh_image_read(ctx, NULL, NULL, &image));
  CHECK_SAYS(ctx, "file");
  EXPECT(ctx, LH_EINVAL, lh_image_read(ctx, "", NULL, &image));
  EXPECT(ctx, LH_EINVAL, lh_image_read(ctx, "x.png", NULL, NULL));
  CHECK_SAYS(ctx, "out");
  EXPECT(ctx, LH_EINVAL, lh_image_decode(ctx, NULL, 10, "x", NULL, &image));
  EXPECT(ctx, LH_EINVAL, lh_image_from_array(ctx, NULL, 1, 1, 3, LH_PIXEL_U8, 0, &image));
  EXPECT(ctx, LH_EINVAL, lh_image_write_png(ctx, NULL, "x.png"));
  EXPECT(ctx, LH_EINVAL, lh_mesh_from_arrays(ctx, NULL, 3, NULL, 0, &mesh));
  CHECK_SAYS(ctx, "vertices");
  EXPECT(ctx, LH_EINVAL, lh_mesh_write(ctx, NULL, "x.ply"));
  EXPECT(ctx, LH_EINVAL, lh_ray_scene_create(ctx, NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_ray_scene_hit(ctx, NULL, NULL, NULL, 0, NULL, NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_color_key_train(ctx, NULL, 100, NULL, 0, NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_color_key_decide(ctx, NULL, bytes, 1, bytes));
  EXPECT(ctx, LH_EINVAL, lh_color_key_silhouette(ctx, NULL, NULL, NULL, &image));
  EXPECT(ctx, LH_EINVAL, lh_hull_carve(ctx, 1, &camera, numbers, NULL, NULL, &mesh));
  EXPECT(ctx, LH_EINVAL, lh_hull_carve(ctx, 0, NULL, NULL, NULL, NULL, &mesh));
  CHECK_SAYS(ctx, "views");
  EXPECT(ctx, LH_EINVAL, lh_capture_open(ctx, NULL, &capture));
  EXPECT(ctx, LH_EINVAL, lh_capture_save(ctx, NULL));
  EXPECT(ctx, LH_EINVAL, lh_capture_describe(ctx, NULL, NULL, 0, &needed));
  EXPECT(ctx, LH_EINVAL, lh_capture_get_pose(ctx, NULL, 0, numbers));
  EXPECT(ctx, LH_EINVAL, lh_capture_set_option(ctx, NULL, "key", "k", "5"));
  EXPECT(ctx, LH_EINVAL, lh_capture_run(ctx, NULL, 0, NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_capture_run_stage(ctx, NULL, "key", 0, NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_capture_import_projections(ctx, NULL, "x", NULL, &capture));
  EXPECT(ctx, LH_EINVAL, lh_capture_import_nerf(ctx, NULL, 1, "x", NULL, &capture));
  EXPECT(ctx, LH_EINVAL, lh_capture_import_photos(ctx, NULL, 0, "x", NULL, &capture));
  EXPECT(ctx, LH_EINVAL, lh_capture_export_colmap(ctx, NULL, "x", 0, NULL));
  EXPECT(ctx, LH_EINVAL, lh_renderer_create(ctx, NULL, "lumigraph", NULL));
  EXPECT(ctx, LH_EINVAL, lh_renderer_open(ctx, NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_renderer_set_adaptive(ctx, NULL, 1));
  CHECK_SAYS(ctx, "renderer");
  EXPECT(ctx, LH_EINVAL, lh_renderer_render(ctx, NULL, &camera, numbers, 0, bytes, 12, NULL));
  EXPECT(ctx, LH_EINVAL, lh_picture_psnr(ctx, NULL, bytes, NULL, 2, 2, numbers));
  EXPECT(ctx, LH_EINVAL, lh_picture_psnr(ctx, bytes, bytes, NULL, 2, 2, NULL));
  EXPECT(ctx, LH_EINVAL, lh_stage_options(ctx, NULL, NULL, 0, &needed));
  EXPECT(ctx, LH_EINVAL, lh_stage_options(ctx, "key", NULL, 0, NULL));
  CHECK(needed == 77 && !image && !mesh && !capture);

  lh_image_destroy(NULL);
  lh_mesh_destroy(NULL);
  lh_color_key_destroy(NULL);
  lh_ray_scene_destroy(NULL);
  lh_capture_destroy(NULL);
  lh_renderer_destroy(NULL);
  CHECK(lh_image_data(NULL) == NULL && lh_image_width(NULL) == 0);
  CHECK(lh_mesh_vertex_count(NULL) == 0 && lh_capture_shot_count(NULL) == 0);
  CHECK(lh_stage_name(lh_stage_count()) == NULL && lh_stage_name(0) != NULL);
}

static void sizes(lh_context *ctx) {
  lh_camera camera = small_camera(10, 10, 10);
  double numbers[3] = {0, 0, 1};
  float coordinates[12];
  uint8_t bytes[48] = {0};
  const float nan_vertex[9] = {0, 0, 0, 1, 0, 0, 0, NAN, 0};
  const uint32_t triangle[3] = {0, 1, 2}, beyond[3] = {0, 1, 3};
  lh_image *image = NULL;
  lh_mesh *mesh = tetrahedron(ctx), *bad = NULL;

  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera, numbers, SIZE_MAX, numbers, NULL));
  EXPECT(ctx, LH_EINVAL, lh_image_from_array(ctx, bytes, 0, 4, 3, LH_PIXEL_U8, 0, &image));
  EXPECT(ctx, LH_EINVAL, lh_image_from_array(ctx, bytes, -4, 4, 3, LH_PIXEL_U8, 0, &image));
  EXPECT(ctx, LH_EINVAL, lh_image_from_array(ctx, bytes, 1 << 30, 1 << 30, 3, LH_PIXEL_U8, 0, &image));
  EXPECT(ctx, LH_EINVAL, lh_image_from_array(ctx, bytes, 4, 4, 2, LH_PIXEL_U8, 0, &image));
  CHECK_SAYS(ctx, "channels");
  EXPECT(ctx, LH_EINVAL, lh_image_from_array(ctx, bytes, 4, 4, 3, 3, 0, &image));
  CHECK_SAYS(ctx, "pixel_type");
  EXPECT(ctx, LH_EINVAL, lh_image_from_array(ctx, bytes, 4, 4, 3, LH_PIXEL_U8, 11, &image));
  CHECK_SAYS(ctx, "row_bytes");
  EXPECT(ctx, LH_EINVAL, lh_mesh_vertices(ctx, mesh, coordinates, 3));
  CHECK_SAYS(ctx, "4 rows");
  EXPECT(ctx, LH_EINPUT, lh_mesh_from_arrays(ctx, nan_vertex, 3, triangle, 1, &bad));
  EXPECT(ctx, LH_EINPUT, lh_mesh_from_arrays(ctx, nan_vertex, 2, beyond, 1, &bad));
  EXPECT(ctx, LH_EINVAL, lh_picture_ssim(ctx, bytes, bytes, NULL, 4, 4, numbers));
  EXPECT(ctx, LH_EINVAL, lh_context_set_threads(ctx, 100000));
  EXPECT(ctx, LH_EINVAL, lh_color_key_train(ctx, bytes, 0, NULL, 0, NULL, (lh_color_key **)&bad));
  CHECK(!image && !bad && numbers[2] == 1);
  lh_mesh_destroy(mesh);
}

static void numbers(lh_context *ctx) {
  lh_camera camera = small_camera(10, 10, 10);
  double pixel[2] = {5, 5}, point[3] = {0, 0, 1};
  double pose[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  uint8_t mask[100] = {0};
  const uint8_t *masks[1];
  lh_mesh *mesh = NULL;
  masks[0] = mask;

  camera.f = NAN;
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera, point, 1, pixel, NULL));
  camera.f = -1;
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera, point, 1, pixel, NULL));
  camera = small_camera(0, 10, 10);
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera, point, 1, pixel, NULL));
  CHECK(pixel[0] == 5 && pixel[1] == 5);
  camera = small_camera(10, 10, 10);
  point[0] = NAN;
  EXPECT(ctx, LH_OK, lh_camera_project(ctx, &camera, point, 1, pixel, NULL)); /* data: NaN in, NaN out */
  CHECK(isnan(pixel[0]));

  pose[0] = -1;
  EXPECT(ctx, LH_EINVAL, lh_hull_carve(ctx, 1, &camera, pose, masks, NULL, &mesh));
  CHECK_SAYS(ctx, "reflection");
  pose[0] = 1.01;
  EXPECT(ctx, LH_EINVAL, lh_hull_carve(ctx, 1, &camera, pose, masks, NULL, &mesh));
  CHECK_SAYS(ctx, "cam_from_world");
  pose[0] = INFINITY;
  EXPECT(ctx, LH_EINVAL, lh_hull_carve(ctx, 1, &camera, pose, masks, NULL, &mesh));
  CHECK(!mesh);
}

/* Structures of other versions. */
static void struct_sizes(lh_context *ctx) {
  struct {
    lh_camera known;
    double later;
  } camera;
  const double point[3] = {0, 0, 1};
  double pixel[2] = {-1, -1};
  uint8_t color[3 * 8] = {0}, mask;
  lh_color_key *key = NULL;
  lh_color_key_options options;

  memset(&camera, 0, sizeof camera);
  camera.known = small_camera(10, 10, 10);
  camera.known.struct_size = 0;
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera.known, point, 1, pixel, NULL));
  CHECK_SAYS(ctx, "struct_size");
  camera.known.struct_size = 4;
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera.known, point, 1, pixel, NULL));
  camera.known.struct_size = (size_t)-1; /* must not read that far */
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera.known, point, 1, pixel, NULL));
  CHECK(pixel[0] == -1);
  camera.known.struct_size = sizeof camera; /* a later caller that does not use what is new */
  EXPECT(ctx, LH_OK, lh_camera_project(ctx, &camera.known, point, 1, pixel, NULL));
  CHECK(pixel[0] == 5);
  camera.later = 1;
  EXPECT(ctx, LH_EINVAL, lh_camera_project(ctx, &camera.known, point, 1, pixel, NULL));
  CHECK_SAYS(ctx, "later version");
  camera.known.struct_size = offsetof(lh_camera, k1); /* an older caller, whose cameras had no lens */
  camera.known.k1 = NAN;
  EXPECT(ctx, LH_OK, lh_camera_project(ctx, &camera.known, point, 1, pixel, NULL));

  memset(&options, 0xff, sizeof options);
  options.struct_size = offsetof(lh_color_key_options, k); /* knows no option: all are the defaults */
  EXPECT(ctx, LH_OK, lh_color_key_train(ctx, color, 8, NULL, 0, &options, &key));
  EXPECT(ctx, LH_OK, lh_color_key_decide(ctx, key, color, 1, &mask));
  lh_color_key_destroy(key);
}

static void files(lh_context *ctx, const char *scratch) {
  char file[1024];
  lh_image *image = NULL;
  lh_mesh *mesh = tetrahedron(ctx), *read = NULL;
  lh_capture *capture = NULL;
  FILE *f;
  snprintf(file, sizeof file, "%s/absent.jpg", scratch);
  EXPECT(ctx, LH_ENOTFOUND, lh_image_read(ctx, file, NULL, &image));
  CHECK_SAYS(ctx, "absent.jpg");
  CHECK(lh_context_status(ctx) == LH_ENOTFOUND);
  EXPECT(ctx, LH_ENOTFOUND, lh_mesh_read(ctx, "absent.ply", &read));
  EXPECT(ctx, LH_ENOTFOUND, lh_capture_open(ctx, "absent", &capture));
  snprintf(file, sizeof file, "%s/folder.ply", scratch);
  CHECK(mkdir(file, 0777) == 0);
  EXPECT(ctx, LH_EIO, lh_mesh_write(ctx, mesh, file)); /* a folder is in the way */
  CHECK_SAYS(ctx, "folder.ply");
  snprintf(file, sizeof file, "%s/mesh.xyz", scratch);
  EXPECT(ctx, LH_EINVAL, lh_mesh_write(ctx, mesh, file));
  snprintf(file, sizeof file, "%s/half.png", scratch);
  f = fopen(file, "wb");
  CHECK(f != NULL);
  if (f) {
    fwrite("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 1, 16, f);
    fclose(f);
  }
  EXPECT(ctx, LH_EINPUT, lh_image_read(ctx, file, NULL, &image));
  CHECK_SAYS(ctx, "half.png");
  EXPECT(ctx, LH_EINPUT, lh_image_decode(ctx, "not a picture", 13, "memory.jpg", NULL, &image));
  CHECK_SAYS(ctx, "memory.jpg");
  CHECK(!image && !read && !capture);
  EXPECT(ctx, LH_OK, lh_context_set_threads(ctx, 0));
  CHECK(lh_context_message(ctx)[0] == '\0' && lh_context_subject(ctx)[0] == '\0'); /* success clears the error */
  lh_mesh_destroy(mesh);
}

static void capture(lh_context *ctx, const char *scratch) {
  char folder[1024], text[8];
  double pose[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  lh_camera camera = small_camera(10, 10, 10), got;
  lh_capture *capture = NULL;
  lh_image *image = NULL;
  size_t needed = 0;
  char *json;
  snprintf(folder, sizeof folder, "%s/faults_capture", scratch);
  MUST(ctx, lh_capture_create(ctx, folder, &capture));
  MUST(ctx, lh_capture_add_camera(ctx, capture, &camera));
  memset(&got, 0, sizeof got);
  got.struct_size = offsetof(lh_camera, u0);
  got.u0 = 123;
  MUST(ctx, lh_capture_get_camera(ctx, capture, 0, &got));
  CHECK(got.f == 10 && got.u0 == 123 && got.struct_size == offsetof(lh_camera, u0)); /* no more than the caller has */
  EXPECT(ctx, LH_EINVAL, lh_capture_get_camera(ctx, capture, 1, &got));
  EXPECT(ctx, LH_EINVAL, lh_capture_add_shot(ctx, capture, "a/b", "photo.png", 0));
  CHECK_SAYS(ctx, "name");
  EXPECT(ctx, LH_EINVAL, lh_capture_add_shot(ctx, capture, "caf\xe9", "photo.png", 0)); /* not UTF-8 */
  EXPECT(ctx, LH_EINVAL, lh_capture_add_shot(ctx, capture, "a", "photo.png", 1));
  EXPECT(ctx, LH_ENOTFOUND, lh_capture_add_shot(ctx, capture, "a", "photo.png", 0));
  CHECK_SAYS(ctx, "photo.png");
  EXPECT(ctx, LH_EINVAL, lh_capture_get_pose(ctx, capture, 0, pose));
  CHECK_SAYS(ctx, "shot");
  EXPECT(ctx, LH_EINVAL, lh_capture_read_mask(ctx, capture, 0, &image));
  EXPECT(ctx, LH_EINVAL, lh_capture_set_hold_out(ctx, capture, -3));
  EXPECT(ctx, LH_EINVAL, lh_capture_set_option(ctx, capture, "nonsense", "k", "1"));
  EXPECT(ctx, LH_EINVAL, lh_capture_set_option(ctx, capture, "hull", "nonsense", "1"));
  EXPECT(ctx, LH_EINVAL, lh_capture_set_option(ctx, capture, "hull", "resolution", "many"));
  CHECK_SAYS(ctx, "many");
  EXPECT(ctx, LH_EINVAL, lh_capture_run_stage(ctx, capture, "nonsense", 0, NULL, NULL));
  EXPECT(ctx, LH_ENOTFOUND, lh_capture_evaluation(ctx, capture, NULL, 0, &needed));
  MUST(ctx, lh_capture_set_option(ctx, capture, "hull", "resolution", "100"));
  EXPECT(ctx, LH_EINVAL, lh_capture_get_option(ctx, capture, "hull", "resolution", text, 3, &needed));
  CHECK_SAYS(ctx, "buffer");
  MUST(ctx, lh_capture_get_option(ctx, capture, "hull", "resolution", text, sizeof text, &needed));
  CHECK(needed == 4 && strcmp(text, "100") == 0);

  MUST(ctx, lh_capture_describe(ctx, capture, NULL, 0, &needed));
  json = malloc(needed);
  MUST(ctx, lh_capture_describe(ctx, capture, json, needed, NULL));
  CHECK(strlen(json) + 1 == needed && json[0] == '{');
  free(json);
  MUST(ctx, lh_stage_options(ctx, "hull", NULL, 0, &needed));
  json = malloc(needed);
  MUST(ctx, lh_stage_options(ctx, "hull", json, needed, &needed));
  CHECK(strstr(json, "resolution") != NULL);
  free(json);
  MUST(ctx, lh_capture_save(ctx, capture));
  EXPECT(ctx, LH_EINVAL, lh_capture_create(ctx, folder, &capture)); /* in use; the handle is still the old one */
  lh_capture_destroy(capture);
}

/* ---- cancel -------------------------------------------------------------------------------------------------------
 */

typedef struct {
  lh_context *ctx;
  int calls;
  lh_status inner;
} Watch;

static void stop_at_once(void *user, const lh_progress *progress) {
  Watch *watch = user;
  double v[3] = {0, 0, 1}, pose[12];
  ++watch->calls;
  CHECK(progress->struct_size == sizeof *progress && progress->stage && progress->done <= progress->total);
  watch->inner = lh_pose_look_at(watch->ctx, v, v, v, pose); /* the context is busy */
  lh_context_cancel(watch->ctx);
}

static void *stop_soon(void *ctx) {
  const struct timespec pause = {0, 5000000};
  nanosleep(&pause, NULL);
  lh_context_cancel(ctx);
  return NULL;
}

/* Trains on so many colours that it takes a while. */
static lh_status train(lh_context *ctx, lh_color_key **out) {
  enum { kColors = 400000 };
  static uint8_t colors[3 * kColors];
  uint32_t state = 1;
  size_t i;
  for (i = 0; i < sizeof colors; ++i) {
    state = state * 1664525u + 1013904223u;
    colors[i] = (uint8_t)(state >> 24);
  }
  return lh_color_key_train(ctx, colors, kColors, NULL, 0, NULL, out);
}

static void cancel(lh_context *ctx) {
  static Ball ball;
  Watch watch = {NULL, 0, LH_OK};
  lh_mesh *mesh = NULL;
  lh_color_key *key = NULL;
  pthread_t thread;
  uint8_t colors[3 * 8] = {0};
  watch.ctx = ctx;

  /* From the progress callback. */
  make_ball(ctx, &ball);
  MUST(ctx, lh_context_set_progress(ctx, stop_at_once, &watch));
  EXPECT(ctx, LH_ECANCELLED, lh_hull_carve(ctx, kBallViews, ball.cameras, ball.poses, ball.masks, NULL, &mesh));
  CHECK(watch.calls >= 1 && watch.inner == LH_EINVAL && mesh == NULL);
  CHECK(lh_context_cancelled(ctx) == 1);
  MUST(ctx, lh_context_set_progress(ctx, NULL, NULL));

  /* It is sticky: the next long call does not begin. */
  EXPECT(ctx, LH_ECANCELLED, lh_color_key_train(ctx, colors, 8, NULL, 0, NULL, &key));
  lh_context_clear_cancel(ctx);
  EXPECT(ctx, LH_OK, lh_color_key_train(ctx, colors, 8, NULL, 0, NULL, &key));
  lh_color_key_destroy(key);
  key = NULL;

  /* From another thread. */
  CHECK(pthread_create(&thread, NULL, stop_soon, ctx) == 0);
  EXPECT(ctx, LH_ECANCELLED, train(ctx, &key));
  CHECK(pthread_join(thread, NULL) == 0);
  CHECK(key == NULL);
  CHECK_SAYS(ctx, "stopped");
  lh_context_clear_cancel(ctx);
}

int main(int argc, char **argv) {
  const char *scratch = argc > 1 ? argv[1] : ".";
  lh_context *ctx = lh_context_create();
  if (!ctx) return 1;
  no_context();
  nulls(ctx);
  sizes(ctx);
  numbers(ctx);
  struct_sizes(ctx);
  files(ctx, scratch);
  capture(ctx, scratch);
  cancel(ctx);
  lh_context_destroy(ctx);
  return check_result();
}
