#include <lumihull.h>
#include <stdio.h>
#include <string.h>

int main(void) {
  const double eye[3] = {0, 0, 5}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
  double cam_from_world[12] = {0};
  lh_context *ctx = lh_context_create();
  const lh_status status = lh_pose_look_at(ctx, eye, target, up, cam_from_world);
  lh_context_destroy(ctx);
  printf("C: version %s, %s\n", lh_version(), lh_status_text(status));
  return status == LH_OK && cam_from_world[11] == 5 ? 0 : 1;
}
