/* A capture session through the C interface, with an application's own robot, camera and operator. */
#include "check.h"

enum { kStops = 4 };

/* What the devices did, and what they are to do. */
typedef struct {
  lh_context *pictures; /* not the session's: that one is busy */
  int moves, shots, asked, made_safe, fail_move, refuse, forget, cancel_at;
  uint32_t ids[32];
  double azimuth;
  char last_stop[64], told[64];
  const char *answer;
  lh_context *session;
} Rig;

static lh_status robot_state(void *user, lh_robot_state *state, char *reason) {
  (void)user, (void)reason;
  state->ready = 1;
  state->position_known = 1;
  return LH_OK;
}

static lh_status robot_move(void *user, const char *name, const lh_stop *stop, const double *lengths_m, char *reason) {
  Rig *rig = user;
  (void)lengths_m;
  if (++rig->moves == rig->fail_move) {
    strcpy(reason, "the belt\nslipped");
    return LH_EIO;
  }
  if (rig->moves == rig->cancel_at) lh_context_cancel(rig->session);
  CHECK(stop->cables == 0 && stop->photograph == 1);
  rig->azimuth = stop->theta_rad;
  snprintf(rig->last_stop, sizeof rig->last_stop, "%s", name);
  return LH_OK;
}

static void robot_safe(void *user) { ++((Rig *)user)->made_safe; }

/* Each picture is another: its pixels are the shot's number. */
static lh_status camera_shoot(void *user, uint32_t id, double exposure_s, const char *folder, lh_shot *shot,
                              char *reason) {
  Rig *rig = user;
  static uint8_t pixels[24 * 16 * 3];
  lh_image *image = NULL;
  (void)reason;
  CHECK(exposure_s == 0.002 && shot->state == LH_SHOT_UNKNOWN);
  rig->ids[rig->shots++] = id;
  if (rig->refuse > 0) {
    --rig->refuse;
    shot->state = LH_SHOT_REFUSED;
    strcpy(shot->detail, "no focus");
    return LH_OK;
  }
  if (rig->forget > 0) {
    --rig->forget;
    return LH_OK; /* unknown */
  }
  memset(pixels, (int)(20 + 10 * id), sizeof pixels);
  snprintf(shot->file, sizeof shot->file, "%s/card%u.png", folder, (unsigned)id);
  MUST(rig->pictures, lh_image_from_array(rig->pictures, pixels, 24, 16, 3, LH_PIXEL_U8, 0, &image));
  MUST(rig->pictures, lh_image_write_png(rig->pictures, image, shot->file));
  lh_image_destroy(image);
  shot->state = LH_SHOT_DONE;
  return LH_OK;
}

static lh_status ask(void *user, int32_t question, const char *text, const char *const *choices, size_t n,
                     size_t *answer) {
  Rig *rig = user;
  size_t i;
  ++rig->asked;
  CHECK(text[0] != '\0' && question >= LH_QUESTION_MOTION && question <= LH_QUESTION_TASK);
  for (i = 0; i < n; ++i)
    if (strcmp(choices[i], rig->answer && question == LH_QUESTION_DOUBT ? rig->answer : choices[0]) == 0) {
      *answer = i;
      return LH_OK;
    }
  return LH_EINVAL;
}

static lh_plan *hand_plan(lh_context *ctx) {
  lh_plan_options options;
  lh_plan *plan = NULL;
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.azimuths = kStops, options.rows = 1;
  options.settle_s = -1;
  options.exposure_s = 0.002;
  options.travel_s = 0.001;
  MUST(ctx, lh_plan_hemisphere(ctx, &options, &plan));
  CHECK(lh_plan_stop_count(plan) == kStops);
  return plan;
}

typedef struct {
  Rig rig;
  lh_robot *robot;
  lh_camera_device *camera;
  lh_operator who;
  lh_session_options options;
  lh_session_result result;
} Scene;

static void begin(lh_context *ctx, Scene *scene) {
  lh_robot_functions robot;
  lh_camera_functions camera;
  memset(scene, 0, sizeof *scene);
  scene->rig.session = ctx;
  scene->rig.pictures = lh_context_create();
  if (!scene->rig.pictures) exit(1);
  memset(&robot, 0, sizeof robot);
  robot.struct_size = sizeof robot;
  robot.user = &scene->rig;
  robot.state = robot_state;
  robot.move_to = robot_move;
  robot.make_safe = robot_safe;
  MUST(ctx, lh_robot_create(ctx, &robot, &scene->robot));
  memset(&camera, 0, sizeof camera);
  camera.struct_size = sizeof camera;
  camera.user = &scene->rig;
  camera.delivers_files = 1;
  camera.shoot = camera_shoot;
  MUST(ctx, lh_camera_device_create(ctx, &camera, &scene->camera));
  scene->who.struct_size = sizeof scene->who;
  scene->who.user = &scene->rig;
  scene->who.ask = ask;
  scene->options.struct_size = sizeof scene->options;
  scene->result.struct_size = sizeof scene->result;
}

static void end(Scene *scene) {
  lh_robot_destroy(scene->robot);
  lh_camera_device_destroy(scene->camera);
  lh_context_destroy(scene->rig.pictures);
}

static void pauses_and_goes_on(lh_context *ctx, const lh_plan *plan, const char *folder) {
  Scene s;
  lh_capture *capture = NULL;
  char text[2000], name[256];
  size_t i, k;
  begin(ctx, &s);
  MUST(ctx, lh_session_dry_run(ctx, plan, s.robot, &s.camera, 1, folder, &s.options, text, sizeof text, NULL));
  CHECK(strstr(text, "\"problems\":[]") && strstr(text, "\"left\":4"));
  EXPECT(ctx, LH_EINVAL, lh_session_dry_run(ctx, plan, s.robot, &s.camera, 1, folder, &s.options, text, 5, NULL));
  CHECK(s.rig.moves == 0 && s.rig.shots == 0);

  s.options.pause_after = 2;
  s.rig.refuse = 1;
  MUST(ctx, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, &s.options, &s.who, &s.result));
  CHECK(s.result.views == 2 && s.result.of == kStops && s.result.taken == 2 && s.result.paused == 1);
  CHECK(s.rig.shots == 3 && s.rig.ids[0] == s.rig.ids[1] && s.rig.ids[2] != s.rig.ids[1]); /* a retry has its number */
  CHECK(s.rig.asked >= 1 && s.rig.made_safe >= 1);

  s.options.pause_after = 0;
  MUST(ctx, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, &s.options, &s.who, &s.result));
  CHECK(s.result.views == kStops && s.result.taken == 2 && s.result.paused == 0 && s.result.awaited == 0);
  CHECK(s.rig.shots == 5 && s.rig.moves == kStops);

  MUST(ctx, lh_capture_open(ctx, folder, &capture));
  CHECK(lh_capture_shot_count(capture) == kStops);
  for (i = 0; i < kStops; ++i) {
    MUST(ctx, lh_plan_stop_name(ctx, plan, i, name, sizeof name, NULL));
    MUST(ctx, lh_capture_shot_name(ctx, capture, i, text, sizeof text, NULL));
    CHECK(strstr(text, name));
  }
  lh_capture_destroy(capture);
  for (i = 0; i < 5; ++i)
    for (k = i + 1; k < 5; ++k) CHECK((s.rig.ids[i] == s.rig.ids[k]) == (i == 0 && k == 1));
  end(&s);
}

static void faults(lh_context *ctx, const lh_plan *plan, const char *folder) {
  Scene s;
  begin(ctx, &s);
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, NULL, NULL, &s.result));
  CHECK(s.rig.moves == 0 && s.result.views == 0); /* nobody agreed to motion */

  s.rig.fail_move = 2;
  EXPECT(ctx, LH_EIO, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, NULL, &s.who, &s.result));
  CHECK_SAYS(ctx, "the belt slipped");
  CHECK(s.rig.shots == 1 && s.rig.made_safe >= 1);

  s.rig.cancel_at = s.rig.moves + 1;
  EXPECT(ctx, LH_ECANCELLED, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, NULL, &s.who, &s.result));
  lh_context_clear_cancel(ctx);
  s.rig.cancel_at = 0;

  /* In doubt: nobody decides; then the operator says "again", which is a new number. */
  s.rig.forget = 1;
  s.options.agree_to_motion = 1;
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, &s.options, NULL, &s.result));
  CHECK_SAYS(ctx, "taken");
  s.rig.answer = "again";
  MUST(ctx, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, &s.options, &s.who, &s.result));
  CHECK(s.result.views == kStops && s.rig.shots == kStops + 1);
  end(&s);
}

static void wrong_use(lh_context *ctx, const lh_plan *plan, const char *folder) {
  Scene s;
  lh_robot_functions functions;
  lh_robot *robot = NULL;
  lh_camera_device *camera = NULL, *none = NULL;
  lh_serial_link *link = NULL;
  begin(ctx, &s);
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, NULL, s.robot, &s.camera, 1, folder, NULL, &s.who, NULL));
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, plan, NULL, &s.camera, 1, folder, NULL, &s.who, NULL));
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, plan, s.robot, &none, 1, folder, NULL, &s.who, NULL));
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, plan, s.robot, &s.camera, 1, "", NULL, &s.who, NULL));
  EXPECT(ctx, LH_EINPUT, lh_session_run(ctx, plan, s.robot, NULL, 0, folder, NULL, &s.who, NULL));
  CHECK_SAYS(ctx, "cameras");
  s.result.struct_size = 1;
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, NULL, &s.who, &s.result));
  s.who.ask = NULL;
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, plan, s.robot, &s.camera, 1, folder, NULL, &s.who, NULL));
  CHECK(s.rig.moves == 0 && s.rig.shots == 0);
  memset(&functions, 0, sizeof functions);
  functions.struct_size = sizeof functions;
  EXPECT(ctx, LH_EINVAL, lh_robot_create(ctx, &functions, &robot));
  EXPECT(ctx, LH_EINVAL, lh_robot_create(ctx, NULL, &robot));
  EXPECT(ctx, LH_EINVAL, lh_camera_device_create(ctx, NULL, &camera));
  EXPECT(ctx, LH_EINVAL, lh_robot_by_word(ctx, "drone", &robot));
  EXPECT(ctx, LH_EINVAL, lh_camera_device_by_word(ctx, "eye", &camera));
  EXPECT(ctx, LH_EINVAL, lh_robot_by_word(ctx, "rig", &robot));
  CHECK_SAYS(ctx, "`lumihull capture --robot rig");
  EXPECT(ctx, LH_EINVAL, lh_camera_device_by_word(ctx, "rig:bust:600", &camera));
  CHECK_SAYS(ctx, "`lumihull capture --robot rig");
  EXPECT(ctx, LH_ENOTFOUND, lh_serial_link_open(ctx, "/nowhere/tty", 0, &link));
  EXPECT(ctx, LH_EINVAL, lh_robot_serial(ctx, NULL, NULL, &robot));
  EXPECT(ctx, LH_EINVAL, lh_camera_device_serial(ctx, NULL, &camera));
  CHECK(!robot && !camera && !link);
  MUST(ctx, lh_robot_by_word(ctx, "hand", &robot));
  lh_robot_destroy(robot);
  lh_robot_destroy(NULL);
  lh_camera_device_destroy(NULL);
  lh_serial_link_destroy(NULL);
  end(&s);
}

/* Devices of the library's own: each session opens them anew, and what is simulated remembers. */
static void by_words(lh_context *ctx, const lh_plan *plan, const char *folder) {
  lh_robot *robot = NULL;
  lh_camera_device *camera = NULL, *serial = NULL;
  Scene s;
  begin(ctx, &s);
  MUST(ctx, lh_robot_by_word(ctx, "simulate", &robot));
  MUST(ctx, lh_camera_device_by_word(ctx, "simulate", &camera));
  MUST(ctx, lh_camera_device_by_word(ctx, "serial", &serial));
  s.options.agree_to_motion = 1;
  s.options.pause_after = 3;
  MUST(ctx, lh_session_run(ctx, plan, robot, &camera, 1, folder, &s.options, NULL, &s.result));
  CHECK(s.result.taken == 3 && s.result.paused == 1);
  EXPECT(ctx, LH_EINVAL, lh_session_run(ctx, plan, robot, &serial, 1, folder, &s.options, NULL, &s.result));
  CHECK_SAYS(ctx, "no serial port");
  /* An application's own robot with the library's camera. */
  MUST(ctx, lh_session_run(ctx, plan, s.robot, &camera, 1, folder, &s.options, &s.who, &s.result));
  CHECK(s.result.taken == 1 && s.result.views == kStops && s.rig.moves == 1);
  lh_robot_destroy(robot);
  lh_camera_device_destroy(camera);
  lh_camera_device_destroy(serial);
  end(&s);
}

static void count_lines(void *user, const char *line) { *(int *)user += line[0] != '\0'; }

/* A camera that a person fires keeps its pictures on a card; they carry no time, so that their order tells. */
static void card(lh_context *ctx, const lh_plan *plan, const char *folder, const char *pictures) {
  lh_camera_device *camera = NULL;
  lh_card_options options;
  lh_card_result result;
  lh_capture *capture = NULL;
  char text[256];
  int lines = 0;
  Scene s;
  begin(ctx, &s);
  MUST(ctx, lh_camera_device_by_word(ctx, "hand", &camera));
  MUST(ctx, lh_session_run(ctx, plan, s.robot, &camera, 1, folder, NULL, &s.who, &s.result));
  CHECK(s.result.awaited == kStops && s.result.views == 0);
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.user = &lines;
  options.tell = count_lines;
  options.dry_run = 1;
  memset(&result, 0, sizeof result);
  result.struct_size = sizeof result;
  MUST(ctx, lh_card_land(ctx, folder, pictures, &options, &result));
  CHECK(result.matched == kStops && result.landed == 0 && result.missing == 0 && lines >= kStops);
  options.dry_run = 0;
  MUST(ctx, lh_card_land(ctx, folder, pictures, &options, &result));
  CHECK(result.landed == kStops && result.extra == 0 && result.troubles == 0);
  MUST(ctx, lh_card_land(ctx, folder, pictures, NULL, &result)); /* all are there */
  CHECK(result.matched == 0 && result.landed == 0);
  MUST(ctx, lh_capture_open(ctx, folder, &capture));
  CHECK(lh_capture_shot_count(capture) == kStops);
  EXPECT(ctx, LH_EINPUT, lh_repeatability(ctx, capture, text, sizeof text, NULL));
  CHECK_SAYS(ctx, "no scale");
  lh_capture_destroy(capture);
  options.camera = "other";
  EXPECT(ctx, LH_EINVAL, lh_card_land(ctx, folder, pictures, &options, NULL));
  EXPECT(ctx, LH_ENOTFOUND, lh_card_land(ctx, folder, "/nowhere", NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_card_land(ctx, NULL, pictures, NULL, NULL));
  lh_camera_device_destroy(camera);
  end(&s);
}

static void experiments(lh_context *ctx) {
  enum { kFrames = 200 };
  static double time_s[kFrames], center[2 * kFrames], distance[kFrames];
  double poses[24] = {1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1.5, 0, 1, 0, 0, 0, 0, 1, 0};
  double mean[12], far[2], settle = 0, rest = 0;
  int i;
  MUST(ctx, lh_pose_spread(ctx, poses, 2, mean, far, NULL));
  CHECK(fabs(mean[3] - 1) < 1e-12 && fabs(far[0] - 0.5) < 1e-12 && fabs(far[1] - 0.5) < 1e-12);
  EXPECT(ctx, LH_EINVAL, lh_pose_spread(ctx, poses, 0, mean, NULL, NULL));
  poses[0] = 2;
  EXPECT(ctx, LH_EINVAL, lh_pose_spread(ctx, poses, 2, mean, NULL, NULL));
  for (i = 0; i < kFrames; ++i) {
    time_s[i] = 0.05 * i;
    center[2 * i] = 100 + 8 * exp(-time_s[i]); /* within 0.5 px from ln 16 = 2.77 s on */
    center[2 * i + 1] = 50;
  }
  MUST(ctx, lh_stability(ctx, time_s, center, kFrames, 0, 0, distance, &settle, &rest));
  CHECK(fabs(settle - 2.8) < 1e-9 && fabs(distance[0] - 8) < 0.01 && rest < 0.01);
  MUST(ctx, lh_stability(ctx, time_s, center, kFrames, 1e-9, 0, NULL, &settle, NULL));
  CHECK(settle == -1);
  EXPECT(ctx, LH_EINVAL, lh_stability(ctx, time_s, center, 2, 0, 0, NULL, NULL, NULL));
  EXPECT(ctx, LH_EINVAL, lh_stability(ctx, NULL, center, kFrames, 0, 0, NULL, NULL, NULL));
}

int main(int argc, char **argv) {
  const char *scratch = argc > 1 ? argv[1] : ".";
  char folder[1024], pictures[1024];
  lh_plan *plan;
  lh_context *ctx = lh_context_create();
  if (!ctx) return 1;
  plan = hand_plan(ctx);
  snprintf(folder, sizeof folder, "%s/session", scratch);
  pauses_and_goes_on(ctx, plan, folder);
  snprintf(folder, sizeof folder, "%s/session_faults", scratch);
  faults(ctx, plan, folder);
  snprintf(folder, sizeof folder, "%s/session_none", scratch);
  wrong_use(ctx, plan, folder);
  snprintf(folder, sizeof folder, "%s/session_words", scratch);
  by_words(ctx, plan, folder);
  snprintf(folder, sizeof folder, "%s/session_card", scratch);
  snprintf(pictures, sizeof pictures, "%s/session/photos", scratch);
  card(ctx, plan, folder, pictures);
  experiments(ctx);
  lh_plan_destroy(plan);
  lh_context_destroy(ctx);
  return check_result();
}
