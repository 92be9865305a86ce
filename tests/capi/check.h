/* Checks for test programs in C: each failure says where, and the program's exit status counts. */
#ifndef LUMIHULL_TESTS_CHECK_H
#define LUMIHULL_TESTS_CHECK_H

#include <lumihull.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int check_failures = 0;

#define CHECK(condition)                                                    \
  do {                                                                      \
    if (!(condition)) {                                                     \
      fprintf(stderr, "%s:%d: not true: %s\n", __FILE__, __LINE__, #condition); \
      ++check_failures;                                                     \
    }                                                                       \
  } while (0)

/* The call must return that status; else its message is printed. */
#define EXPECT(ctx, status, call)                                                                                   \
  do {                                                                                                              \
    const lh_status check_status = (call);                                                                          \
    if (check_status != (status)) {                                                                                 \
      fprintf(stderr, "%s:%d: %s: expected \"%s\", found \"%s\": %s: %s\n", __FILE__, __LINE__, #call,              \
              lh_status_text(status), lh_status_text(check_status), lh_context_subject(ctx), lh_context_message(ctx)); \
      ++check_failures;                                                                                             \
    }                                                                                                               \
  } while (0)

/* The same for what everything after it depends on. */
#define MUST(ctx, call)                     \
  do {                                      \
    const int check_before = check_failures; \
    EXPECT(ctx, LH_OK, call);               \
    if (check_failures != check_before) exit(1); \
  } while (0)

/* The last call's failure names `word` in its message or subject, in one line. */
#define CHECK_SAYS(ctx, word)                                                                               \
  do {                                                                                                      \
    if (!strstr(lh_context_message(ctx), word) && !strstr(lh_context_subject(ctx), word)) {                 \
      fprintf(stderr, "%s:%d: expected \"%s\" in: %s: %s\n", __FILE__, __LINE__, word, lh_context_subject(ctx), \
              lh_context_message(ctx));                                                                     \
      ++check_failures;                                                                                     \
    }                                                                                                       \
    CHECK(!strchr(lh_context_message(ctx), '\n'));                                                          \
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

#endif
