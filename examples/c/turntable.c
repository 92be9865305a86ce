/* Opens a capture, makes its model where that is not up to date, and renders eight views around the object. */
#include <lumihull.h>
#include <stdio.h>

static int failed(const lh_context *ctx) {
  fprintf(stderr, "%s: %s\n", lh_context_subject(ctx), lh_context_message(ctx));
  return 1;
}

int main(int argc, char **argv) {
  enum { kFrames = 8, kWidth = 320, kHeight = 240 };
  static uint8_t rgba[kWidth * kHeight * 4];
  lh_context *ctx = lh_context_create();
  lh_capture *capture = NULL;
  lh_renderer *renderer = NULL;
  lh_camera camera = {0};
  double cam_from_world[kFrames][12];
  int i;

  if (argc != 2 || !ctx) return 2;
  camera.struct_size = sizeof camera;
  if (lh_capture_open(ctx, argv[1], &capture) || lh_capture_run(ctx, capture, 0, NULL, NULL) ||
      lh_renderer_create(ctx, capture, "lumigraph", &renderer) ||
      lh_renderer_turntable(ctx, renderer, kFrames, kWidth, kHeight, 0.35, &camera, cam_from_world[0]))
    return failed(ctx);

  for (i = 0; i < kFrames; ++i) {
    char file[64];
    lh_image *picture = NULL;
    snprintf(file, sizeof file, "turntable_%d.png", i);
    if (lh_renderer_render(ctx, renderer, &camera, cam_from_world[i], 2, rgba, sizeof rgba, NULL) ||
        lh_image_from_array(ctx, rgba, kWidth, kHeight, 4, LH_PIXEL_U8, 0, &picture) ||
        lh_image_write_png(ctx, picture, file))
      return failed(ctx);
    lh_image_destroy(picture);
    puts(file);
  }
  lh_renderer_destroy(renderer);
  lh_capture_destroy(capture);
  lh_context_destroy(ctx);
  return 0;
}
