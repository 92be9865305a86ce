/* The functions on arrays: what comes out is right. */
#include "check.h"

static void versions(void) {
  unsigned major, minor, patch;
  CHECK(sscanf(lh_version(), "%u.%u.%u", &major, &minor, &patch) == 3);
  CHECK(strcmp(lh_status_text(LH_ENOTFOUND), "not found") == 0);
  CHECK(strcmp(lh_status_text(-1000), "unknown status") == 0);
}

static void camera(lh_context *ctx) {
  lh_camera c = small_camera(640, 480, 500);
  const double points[9] = {0.1, -0.2, 2, 0, 0, 1, 0.3, 0.1, -1};
  double pixels[6], jacobians[18], rays[9], moved[3], pixel[2];
  int i, k;
  c.k1 = -0.05, c.k2 = 0.01, c.p1 = 1e-3, c.skew = 2, c.s = 1.1;
  MUST(ctx, lh_camera_project(ctx, &c, points, 3, pixels, jacobians));
  CHECK(fabs(pixels[2] - 320) < 1e-9 && fabs(pixels[3] - 240) < 1e-9);
  CHECK(isnan(pixels[4]) && isnan(pixels[5]) && isnan(jacobians[12]));

  /* Unprojecting gives the direction back. */
  MUST(ctx, lh_camera_unproject(ctx, &c, pixels, 3, rays));
  CHECK(fabs(rays[0] - 0.05) < 1e-10 && fabs(rays[1] + 0.1) < 1e-10 && rays[2] == 1);
  CHECK(isnan(rays[6]));

  /* Jacobians against central differences. */
  for (k = 0; k < 3; ++k) {
    const double step = 1e-6;
    double high[2];
    memcpy(moved, points, sizeof moved);
    moved[k] += step;
    MUST(ctx, lh_camera_project(ctx, &c, moved, 1, high, NULL));
    moved[k] -= 2 * step;
    MUST(ctx, lh_camera_project(ctx, &c, moved, 1, pixel, NULL));
    for (i = 0; i < 2; ++i) CHECK(fabs((high[i] - pixel[i]) / (2 * step) - jacobians[3 * i + k]) < 1e-5);
  }
  MUST(ctx, lh_camera_project(ctx, &c, NULL, 0, NULL, NULL));
}

static void pose(lh_context *ctx) {
  const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
  double m[12];
  MUST(ctx, lh_pose_look_at(ctx, eye, target, up, m));
  CHECK(fabs(m[11] - 5) < 1e-12 && fabs(m[3]) < 1e-12); /* the origin is 5 in front */
  CHECK(fabs(m[6] + 1) < 1e-12);                        /* world z is the camera's -y */
  EXPECT(ctx, LH_EINVAL, lh_pose_look_at(ctx, eye, target, eye, m));
  CHECK_SAYS(ctx, "up");
}

static void resect(lh_context *ctx) {
  const double eye[3] = {1, -5, 2}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
  lh_camera c = small_camera(3000, 2000, 2500);
  double truth[12], found[12], world[3 * 27], local[3 * 27], pixels[2 * 27], covariances[4 * 27];
  uint8_t outlier[27];
  lh_resect_options options;
  lh_resection result;
  size_t i, k;
  c.k1 = 0.05;
  MUST(ctx, lh_pose_look_at(ctx, eye, target, up, truth));
  for (i = 0; i < 27; ++i) {
    world[3 * i] = (double)(i % 3) - 1, world[3 * i + 1] = (double)(i / 3 % 3) - 1, world[3 * i + 2] = (double)(i / 9) - 1;
    for (k = 0; k < 3; ++k)
      local[3 * i + k] = truth[4 * k] * world[3 * i] + truth[4 * k + 1] * world[3 * i + 1] +
                         truth[4 * k + 2] * world[3 * i + 2] + truth[4 * k + 3];
    covariances[4 * i] = covariances[4 * i + 3] = 0.01, covariances[4 * i + 1] = covariances[4 * i + 2] = 0.001;
  }
  MUST(ctx, lh_camera_project(ctx, &c, local, 27, pixels, NULL));
  MUST(ctx, lh_resect(ctx, &c, pixels, world, 27, NULL, found, NULL, NULL));
  for (i = 0; i < 12; ++i) CHECK(fabs(found[i] - truth[i]) < 1e-9);

  /* All that there is: a wrong match is named, the covariance is symmetric. */
  pixels[2 * 5] += 40;
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.covariances = covariances;
  memset(&result, 0, sizeof result);
  result.struct_size = sizeof result;
  MUST(ctx, lh_resect(ctx, &c, pixels, world, 27, &options, found, &result, outlier));
  for (i = 0; i < 12; ++i) CHECK(fabs(found[i] - truth[i]) < 1e-9);
  for (i = 0; i < 27; ++i) CHECK(outlier[i] == (i == 5));
  CHECK(result.outliers == 1 && result.rms_px < 1e-6 && !result.has_alternative);
  for (i = 0; i < 6; ++i) CHECK(result.covariance[7 * i] > 0 && result.covariance[i] == result.covariance[6 * i]);
  options.not_robust = 1;
  MUST(ctx, lh_resect(ctx, &c, pixels, world, 27, &options, found, &result, outlier));
  CHECK(result.outliers == 0 && result.sigma0 > 10);

  EXPECT(ctx, LH_EINVAL, lh_resect(ctx, &c, pixels, world, 3, NULL, found, NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_resect(ctx, &c, NULL, world, 27, NULL, found, NULL, NULL));
  options.radii = covariances;
  EXPECT(ctx, LH_EINVAL, lh_resect(ctx, &c, pixels, world, 27, &options, found, NULL, NULL));
  CHECK_SAYS(ctx, "normals");
  for (i = 0; i < 27; ++i) world[3 * i] = world[3 * i + 1] = world[3 * i + 2] = (double)i;
  EXPECT(ctx, LH_EDEGENERATE, lh_resect(ctx, &c, pixels, world, 27, NULL, found, NULL, NULL));
  CHECK_SAYS(ctx, "line");
}

static void image(lh_context *ctx, const char *scratch) {
  uint8_t pixels[4 * 3 * 3 + 4 * 3];
  const uint8_t *data;
  char file[1024];
  lh_image *made = NULL, *read = NULL, *grey = NULL;
  lh_image_options options;
  size_t i;
  for (i = 0; i < sizeof pixels; ++i) pixels[i] = (uint8_t)(7 * i);
  MUST(ctx,
       lh_image_from_array(ctx, pixels, 4, 3, 3, LH_PIXEL_U8, 16, &made)); /* rows 16 bytes apart, 12 of them used */
  CHECK(lh_image_width(made) == 4 && lh_image_height(made) == 3 && lh_image_channels(made) == 3);
  CHECK(lh_image_pixel_type(made) == LH_PIXEL_U8);
  data = lh_image_data(made);
  CHECK(memcmp(data, pixels, 12) == 0 && memcmp(data + 24, pixels + 32, 12) == 0);

  snprintf(file, sizeof file, "%s/values.png", scratch);
  MUST(ctx, lh_image_write_png(ctx, made, file));
  MUST(ctx, lh_image_read(ctx, file, NULL, &read));
  CHECK(memcmp(lh_image_data(read), data, 36) == 0);
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.channels = 1;
  MUST(ctx, lh_image_read(ctx, file, &options, &grey));
  CHECK(lh_image_channels(grey) == 1);
  lh_image_destroy(made);
  lh_image_destroy(read);
  lh_image_destroy(grey);
}

static void color_key(lh_context *ctx, const char *scratch) {
  uint8_t background[3 * 512], asked[6] = {20, 180, 30, 200, 30, 40}, mask[2], again[2];
  double probability[2];
  uint8_t photo[3 * 64];
  char file[1024];
  lh_color_key *key = NULL, *loaded = NULL;
  lh_image *picture = NULL, *silhouette = NULL;
  lh_color_key_options options;
  int i;
  for (i = 0; i < 512; ++i) {
    background[3 * i] = (uint8_t)(16 + i % 8);
    background[3 * i + 1] = (uint8_t)(176 + i / 8 % 8);
    background[3 * i + 2] = (uint8_t)(26 + i / 64);
  }
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.k = 5;
  MUST(ctx, lh_color_key_train(ctx, background, 512, NULL, 0, &options, &key));
  MUST(ctx, lh_color_key_decide(ctx, key, asked, 2, mask));
  CHECK(mask[0] == 0 && mask[1] == 255);
  MUST(ctx, lh_color_key_probability(ctx, key, asked, 2, probability));
  CHECK(probability[0] < 0.5 && probability[1] > 0.5);

  snprintf(file, sizeof file, "%s/values_key.json", scratch);
  MUST(ctx, lh_color_key_save(ctx, key, file));
  MUST(ctx, lh_color_key_load(ctx, file, &loaded));
  MUST(ctx, lh_color_key_decide(ctx, loaded, asked, 2, again));
  CHECK(memcmp(mask, again, 2) == 0);

  for (i = 0; i < 64; ++i)
    memcpy(photo + 3 * i, asked + (i % 8 < 4 ? 0 : 3), 3); /* left half enclosure, right object */
  MUST(ctx, lh_image_from_array(ctx, photo, 8, 8, 3, LH_PIXEL_U8, 0, &picture));
  MUST(ctx, lh_color_key_silhouette(ctx, key, picture, NULL, &silhouette));
  CHECK(lh_image_channels(silhouette) == 1 && lh_image_width(silhouette) == 8);
  CHECK(((const uint8_t *)lh_image_data(silhouette))[0] == 0 && ((const uint8_t *)lh_image_data(silhouette))[7] == 255);

  lh_image_destroy(picture);
  lh_image_destroy(silhouette);
  lh_color_key_destroy(key);
  lh_color_key_destroy(loaded);

  /* Both kinds of samples given. */
  MUST(ctx, lh_color_key_train(ctx, background, 512, asked + 3, 1, NULL, &key));
  lh_color_key_destroy(key);
}

static void mesh_and_rays(lh_context *ctx, const char *scratch) {
  lh_mesh *mesh = tetrahedron(ctx), *read = NULL;
  lh_ray_scene *scene = NULL;
  float vertices[12], normals[12], distance[3], barycentric[6];
  uint32_t triangles[12], hit[3];
  double volume = 0;
  char file[1024];
  const float origins[9] = {0.5f, 0.5f, 5, 9, 9, 9, 0.5f, 0.5f, 0.5f};
  const float directions[9] = {0, 0, -1, 0, 0, 1, NAN, 0, 1};
  const float inside[3] = {0.5f, 0.5f, 0.5f};
  uint8_t hidden = 9;

  CHECK(lh_mesh_vertex_count(mesh) == 4 && lh_mesh_triangle_count(mesh) == 4);
  MUST(ctx, lh_mesh_volume(ctx, mesh, &volume));
  CHECK(fabs(volume - 1.0 / 3) < 1e-6);
  MUST(ctx, lh_mesh_normals(ctx, mesh, normals, 4));
  CHECK(fabs(normals[0] + sqrt(1.0 / 3)) < 1e-6); /* at the origin's corner outwards is (-1, -1, -1) */

  snprintf(file, sizeof file, "%s/values.ply", scratch);
  MUST(ctx, lh_mesh_write(ctx, mesh, file));
  MUST(ctx, lh_mesh_read(ctx, file, &read));
  MUST(ctx, lh_mesh_vertices(ctx, read, vertices, 4));
  MUST(ctx, lh_mesh_triangles(ctx, read, triangles, 4));
  CHECK(vertices[3] == 1 && vertices[4] == 1 && vertices[5] == 0);
  CHECK(triangles[1] < 4);

  MUST(ctx, lh_ray_scene_create(ctx, mesh, &scene));
  MUST(ctx, lh_ray_scene_hit(ctx, scene, origins, directions, 3, hit, distance, barycentric));
  CHECK(hit[0] < 4 && distance[0] > 3.9f && distance[0] < 5);
  CHECK(hit[1] == LH_NO_HIT && isinf(distance[1]) && barycentric[2] == 0);
  CHECK(hit[2] == LH_NO_HIT); /* a direction that is not finite hits nothing */
  MUST(ctx, lh_ray_scene_hit(ctx, scene, origins, directions, 3, hit, NULL, NULL));
  MUST(ctx, lh_ray_scene_occluded(ctx, scene, origins, inside, 1, 0, &hidden));
  CHECK(hidden == 1); /* the surface is at z = 1, eight ninths of the way */
  MUST(ctx, lh_ray_scene_occluded(ctx, scene, origins, inside, 1, 0.2f, &hidden));
  CHECK(hidden == 0);

  lh_ray_scene_destroy(scene);
  lh_mesh_destroy(mesh);
  lh_mesh_destroy(read);
}

static void carve(lh_context *ctx) {
  static Ball ball;
  double volume = 0;
  lh_carve_options options;
  lh_mesh *hull = NULL, *half = NULL;
  const double plane[4] = {0, 0, 1, 0};
  make_ball(ctx, &ball);
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.resolution = 64;
  MUST(ctx, lh_hull_carve(ctx, kBallViews, ball.cameras, ball.poses, ball.masks, &options, &hull));
  MUST(ctx, lh_mesh_volume(ctx, hull, &volume));
  /* The hull of a ball contains it; twelve cones leave some more. */
  CHECK(volume > 4.18 && volume < 4.9);
  {
    lh_mesh_report report;
    lh_mesh *small = NULL;
    double moved = -1;
    memset(&report, 0, sizeof report);
    report.struct_size = sizeof report;
    MUST(ctx, lh_mesh_check(ctx, hull, 1, &report));
    CHECK(report.closed && report.manifold && report.oriented && report.parts == 1 && report.euler == 2);
    CHECK(report.self_intersections == 0);
    MUST(ctx, lh_mesh_simplify(ctx, hull, 1000, 0, &small, &moved));
    CHECK(lh_mesh_triangle_count(small) <= 1000 && moved > 0 && moved < 0.1);
    EXPECT(ctx, LH_EINVAL, lh_mesh_simplify(ctx, hull, 0, 0, &small, NULL));
    lh_mesh_destroy(small);
  }

  options.cut_planes = plane;
  options.cut_plane_count = 1;
  MUST(ctx, lh_hull_carve(ctx, kBallViews, ball.cameras, ball.poses, ball.masks, &options, &half));
  {
    double half_volume = 0;
    MUST(ctx, lh_mesh_volume(ctx, half, &half_volume));
    CHECK(half_volume < 0.65 * volume && half_volume > 0.4 * volume);
  }
  lh_mesh_destroy(hull);
  lh_mesh_destroy(half);

  /* Nothing is left where one view sees nothing: it is named. */
  {
    static uint8_t nothing[kBallSize * kBallSize];
    lh_mesh *none = NULL;
    ball.masks[3] = nothing;
    options.cut_plane_count = 0;
    options.min_views = kBallViews; /* so that every view has its say wherever something could be left */
    EXPECT(ctx, LH_EDEGENERATE, lh_hull_carve(ctx, kBallViews, ball.cameras, ball.poses, ball.masks, &options, &none));
    CHECK_SAYS(ctx, "view 3");
    CHECK(none == NULL);
  }
}

static void metrics(lh_context *ctx) {
  static uint8_t a[16 * 16 * 3], b[16 * 16 * 3], mask[16 * 16], other[16 * 16];
  double value = 0;
  int i;
  for (i = 0; i < 16 * 16 * 3; ++i) a[i] = b[i] = (uint8_t)(i * 31);
  MUST(ctx, lh_picture_psnr(ctx, a, b, NULL, 16, 16, &value));
  CHECK(value == 100);
  MUST(ctx, lh_picture_ssim(ctx, a, b, NULL, 16, 16, &value));
  CHECK(fabs(value - 1) < 1e-12);
  for (i = 0; i < 16 * 16 * 3; ++i) a[i] = 100, b[i] = 110;
  MUST(ctx, lh_picture_psnr(ctx, a, b, NULL, 16, 16, &value));
  CHECK(fabs(value - 10 * log10(255.0 * 255 / 100)) < 1e-9);
  MUST(ctx, lh_picture_psnr(ctx, a, b, mask, 16, 16, &value));
  CHECK(isnan(value)); /* the mask is empty */
  for (i = 0; i < 16 * 16; ++i) mask[i] = i < 128 ? 255 : 0, other[i] = i < 64 ? 128 : 127;
  MUST(ctx, lh_mask_iou(ctx, mask, other, 16, 16, &value));
  CHECK(value == 0.5);
}

int main(int argc, char **argv) {
  const char *scratch = argc > 1 ? argv[1] : ".";
  lh_context *ctx = lh_context_create();
  if (!ctx) return 1;
  versions();
  camera(ctx);
  pose(ctx);
  resect(ctx);
  image(ctx, scratch);
  color_key(ctx, scratch);
  mesh_and_rays(ctx, scratch);
  carve(ctx);
  metrics(ctx);
  lh_context_destroy(ctx);
  return check_result();
}
