/* Checks for test programs in C: each failure says where, and the program's exit status counts. */
#ifndef LUMIHULL_TESTS_CHECK_H
#define LUMIHULL_TESTS_CHECK_H

#include <lumihull.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int check_failures = 0;

#define CHECK(condition)                                                        \
  do {                                                                          \
    if (!(condition)) {                                                         \
      fprintf(stderr, "%s:%d: not true: %s\n", __FILE__, __LINE__, #condition); \
      ++check_failures;                                                         \
    }                                                                           \
  } while (0)

/* The call must return that status; else its message is printed. */
#define EXPECT(ctx, status, call)                                                                                      \
  do {                                                                                                                 \
    const lh_status check_status = (call);                                                                             \
    if (check_status != (status)) {                                                                                    \
      fprintf(stderr, "%s:%d: %s: expected \"%s\", found \"%s\": %s: %s\n", __FILE__, __LINE__, #call,                 \
              lh_status_text(status), lh_status_text(check_status), lh_context_subject(ctx), lh_context_message(ctx)); \
      ++check_failures;                                                                                                \
    }                                                                                                                  \
  } while (0)

/* The same for what everything after it depends on. */
#define MUST(ctx, call)                          \
  do {                                           \
    const int check_before = check_failures;     \
    EXPECT(ctx, LH_OK, call);                    \
    if (check_failures != check_before) exit(1); \
  } while (0)

/* The last call's failure names `word` in its message or subject, in one line. */
#define CHECK_SAYS(ctx, word)                                                                                   \
  do {                                                                                                          \
    if (!strstr(lh_context_message(ctx), word) && !strstr(lh_context_subject(ctx), word)) {                     \
      fprintf(stderr, "%s:%d: expected \"%s\" in: %s: %s\n", __FILE__, __LINE__, word, lh_context_subject(ctx), \
              lh_context_message(ctx));                                                                         \
      ++check_failures;                                                                                         \
    }                                                                                                           \
    CHECK(!strchr(lh_context_message(ctx), '\n'));                                                              \
  } while (0)

static inline int check_result(void) {
  if (check_failures) fprintf(stderr, "%d checks failed\n", check_failures);
  return check_failures ? 1 : 0;
}

/* What several tests use. */

static inline lh_camera small_camera(int32_t width, int32_t height, double f) {
  lh_camera c;
  memset(&c, 0, sizeof c);
  c.struct_size = sizeof c;
  c.width = width;
  c.height = height;
  c.f = f;
  c.s = 1;
  c.u0 = 0.5 * width;
  c.v0 = 0.5 * height;
  return c;
}

/* A tetrahedron of edge sqrt(2), oriented outwards; volume 1/3. */
static inline lh_mesh *tetrahedron(lh_context *ctx) {
  static const float vertices[12] = {0, 0, 0, 1, 1, 0, 1, 0, 1, 0, 1, 1};
  static const uint32_t triangles[12] = {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
  lh_mesh *mesh = NULL;
  MUST(ctx, lh_mesh_from_arrays(ctx, vertices, 4, triangles, 4, &mesh));
  return mesh;
}

/* Twelve views of a ball of radius 1 and their silhouettes: eight cameras around, four above. */
enum { kBallViews = 12, kBallSize = 96 };

typedef struct {
  lh_camera cameras[kBallViews];
  double poses[kBallViews * 12];
  uint8_t pixels[kBallSize * kBallSize];
  const uint8_t *masks[kBallViews];
} Ball;

static inline void make_ball(lh_context *ctx, Ball *ball) {
  const double distance = 6, f = 200, outline = f / sqrt(distance * distance - 1);
  const double origin[3] = {0, 0, 0}, up[3] = {0, 0, 1};
  int i, x, y;
  for (y = 0; y < kBallSize; ++y)
    for (x = 0; x < kBallSize; ++x) {
      const double r = hypot(x + 0.5 - 0.5 * kBallSize, y + 0.5 - 0.5 * kBallSize);
      ball->pixels[kBallSize * y + x] = (uint8_t)(255 * fmin(1, fmax(0, outline - r + 0.5)) + 0.5);
    }
  for (i = 0; i < kBallViews; ++i) {
    const double turn = 6.283185307179586 * i / 8, height = i < 8 ? 0.3 : 1.1;
    const double eye[3] = {distance * cos(turn) * cos(height), distance * sin(turn) * cos(height),
                           distance * sin(height)};
    ball->cameras[i] = small_camera(kBallSize, kBallSize, f);
    ball->masks[i] = ball->pixels;
    MUST(ctx, lh_pose_look_at(ctx, eye, origin, up, ball->poses + 12 * i));
  }
}

#endif
