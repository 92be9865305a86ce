/**
 * Lumihull's C interface: the robot that carries the camera, its plans, and the capture itself. A part of lumihull.h,
 * whose rules hold here, too; include that.
 *
 * World: z up, metres; the platform's frame lies as the world's where its rotation is the identity. Angles are radians,
 * forces newtons. Views of an object lie on a hemisphere: theta is the azimuth, phi the angle from straight above.
 */
#ifndef LUMIHULL_CAPTURE_H
#define LUMIHULL_CAPTURE_H

#include <lumihull.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- mechanism --------------------------------------------------------------------------------------------------- */

/** A platform that hangs on 3 … 12 cables and carries the camera. Never changes: any number of threads may use one. */
typedef struct lh_mechanism lh_mechanism;

/** Reads a "lumihull-mechanism" file. @return LH_ENOTFOUND, LH_EIO, LH_EINPUT: file, place and what was expected */
LH_API lh_status lh_mechanism_load(lh_context *ctx, const char *file, lh_mechanism **out);
/** Six cables in a room of 10 x 12 x 6 m, the object's centre 1 m above the floor. */
LH_API lh_status lh_mechanism_paper(lh_context *ctx, lh_mechanism **out);
/** Six cables in a room of 16 x 18 x 10 m: for views from 2.7 m. */
LH_API lh_status lh_mechanism_large(lh_context *ctx, lh_mechanism **out);
LH_API lh_status lh_mechanism_save(lh_context *ctx, const lh_mechanism *mechanism, const char *file);
/** NULL is allowed. */
LH_API void lh_mechanism_destroy(lh_mechanism *mechanism);

typedef struct lh_mechanism_body {
  size_t struct_size;
  double mass_kg;
  double center_of_mass[3]; /**< in the platform's frame */
  double room_min[3], room_max[3];
  double platform_radius_m; /**< of a sphere about the platform's origin that holds the end-effector */
  double cable_radius_m;
  double gravity_m_s2; /**< along -z */
} lh_mechanism_body;

typedef struct lh_cable {
  size_t struct_size;
  double departure[3];  /**< where it leaves the wall, in the world */
  double attachment[3]; /**< on the platform, in its frame */
  double min_length_m, max_length_m;
  double min_tension_N, max_tension_N;
  double stiffness_N;  /**< Young's modulus x cross-section; 0: does not stretch */
  double density_kg_m; /**< mass of a metre; 0: weightless */
} lh_cable;

/** 0 for NULL. */
LH_API size_t lh_mechanism_cable_count(const lh_mechanism *mechanism);
LH_API lh_status lh_mechanism_get_body(lh_context *ctx, const lh_mechanism *mechanism, lh_mechanism_body *out);
LH_API lh_status lh_mechanism_cable(lh_context *ctx, const lh_mechanism *mechanism, size_t cable, lh_cable *out);
LH_API lh_status lh_mechanism_cable_name(lh_context *ctx, const lh_mechanism *mechanism, size_t cable, char *buffer,
                                         size_t size, size_t *needed);
/** A copy with other values of one cable. All fields count; zero is zero here. @return LH_EINPUT: what
 *  lh_mechanism_load would refuse, too */
LH_API lh_status lh_mechanism_with_cable(lh_context *ctx, const lh_mechanism *mechanism, size_t cable,
                                         const lh_cable *value, lh_mechanism **out);
/** Where the camera sits (3 x 4) while its bearing, about the platform's z axis, is turned by an angle. */
LH_API lh_status lh_mechanism_camera(lh_context *ctx, const lh_mechanism *mechanism, double bearing_rad,
                                     double cam_from_platform[12]);

/* ---- statics and kinematics ----------------------------------------------------------------------------------------
 */

/*
 * world_from_platform: 3 x 4. n: room for as many values as there are cables. LH_EINVAL: a pose that is none;
 * LH_EDEGENERATE, but for lengths: an attachment within 1 µm of its departure.
 */

/** Straight lengths of the cables, m. */
LH_API lh_status lh_mechanism_lengths(lh_context *ctx, const lh_mechanism *mechanism,
                                      const double world_from_platform[12], double *lengths_m, size_t n);

#define LH_BALANCE_CONTROLLED 0 /**< tensions within their limits; the platform stays where it is */
#define LH_BALANCE_LOOSE 1      /**< balanced, but a tension is outside its limits */
#define LH_BALANCE_SINGULAR 2   /**< balanced, but a motion remains that no cable resists */
#define LH_BALANCE_UNBALANCED 3 /**< no tensions hold the platform here */

typedef struct lh_balance {
  size_t struct_size;
  int32_t state;            /**< LH_BALANCE_… */
  double residual_N;        /**< of the balance of forces and torques, these divided by the attachments' RMS radius */
  double smallest_singular; /**< of the wrench matrix, its torques divided likewise; 0: a motion is free */
} lh_balance;

/** What the cables bear under gravity, >= 0; not unique with more than six: the least within the limits.
 *  tensions_N, balance: each may be NULL. */
LH_API lh_status lh_mechanism_tensions(lh_context *ctx, const lh_mechanism *mechanism,
                                       const double world_from_platform[12], double *tensions_N, size_t n,
                                       lh_balance *balance);

/** The platform's largest motion from errors of the cables' lengths: m per m, rad per m. Infinite where one is free. */
typedef struct lh_sensitivity {
  size_t struct_size;
  double translation_each, rotation_each;   /**< each length within ±1 */
  double translation_joint, rotation_joint; /**< sum of their squares at most 1 */
} lh_sensitivity;
LH_API lh_status lh_mechanism_sensitivity(lh_context *ctx, const lh_mechanism *mechanism,
                                          const double world_from_platform[12], lh_sensitivity *out);

/** What to wind out so that the platform hangs there: unstretched lengths, m. @return LH_EDEGENERATE: nothing holds it
 */
LH_API lh_status lh_mechanism_unstrained(lh_context *ctx, const lh_mechanism *mechanism,
                                         const double world_from_platform[12], double *lengths_m, size_t n);

/**
 * Where the platform hangs: of the many answers the one that is reached from `start`, e.g. the last commanded pose.
 *
 * @param lengths_m  n, one a cable, > 0; elastic: unstretched
 * @param elastic    yes: cables stretch and don't push; each needs a stiffness
 * @param tensions_N NULL, or n: 0 where a cable is slack
 * @return LH_EDEGENERATE: no pose near start satisfies the lengths, or none is stable
 */
LH_API lh_status lh_mechanism_hang(lh_context *ctx, const lh_mechanism *mechanism, const double *lengths_m, size_t n,
                                   const double start[12], int32_t elastic, double world_from_platform[12],
                                   double *tensions_N);

/** What must not be touched: an upright cylinder with a half-sphere's cap. */
typedef struct lh_keep_out {
  size_t struct_size;
  double base[3]; /**< centre of its lower end */
  double radius_m;
  double height_m; /**< of the cylinder, without the cap */
} lh_keep_out;

/** Least distances of surfaces, m; negative: they intersect; infinite: there is nothing to keep away from. */
typedef struct lh_clearance {
  size_t struct_size;
  double cable_cable, cable_platform, cable_camera, cable_object, platform_object, platform_room;
} lh_clearance;
/** object: NULL: none. */
LH_API lh_status lh_mechanism_clearance(lh_context *ctx, const lh_mechanism *mechanism,
                                        const double world_from_platform[12], const lh_keep_out *object,
                                        lh_clearance *out);

/** Two cables that pass through each other on a straight way. */
typedef struct lh_crossing {
  size_t struct_size;
  int32_t crosses;       /**< 0: none, and the rest is 0 */
  int32_t first, second; /**< cables */
  double at;             /**< 0 … 1 of the way */
} lh_crossing;
LH_API lh_status lh_mechanism_crossing(lh_context *ctx, const lh_mechanism *mechanism, const double from[12],
                                       const double to[12], lh_crossing *out);

/* ---- calibration of a mechanism ------------------------------------------------------------------------------------
 */

typedef struct lh_mechanism_calibration lh_mechanism_calibration;

typedef struct lh_mechanism_calibration_options {
  size_t struct_size;
  int32_t gains;             /**< yes: also each winch's metres per commanded metre */
  int32_t apart;             /**< yes: attachment points that coincide in the guess may part */
  double position_sigma_m;   /**< of a pose without covariance; 0: 0.5 mm */
  double rotation_sigma_rad; /**< 0: 0.3 mrad */
  double length_sigma_m;     /**< of a commanded length; 0: 0.05 mm */
  double largest_rms_m;      /**< beyond it lengths and poses do not belong together; 0: 1 cm */
} lh_mechanism_calibration_options;

/**
 * Departures, attachments, offsets of lengths, and how camera and bearing sit, from poses of the camera that
 * photogrammetry measured while the cables had commanded lengths.
 *
 * @param count          observations
 * @param cam_from_world count x 12
 * @param commanded_m    count x cables
 * @param groups         NULL: all one; or count, >= 0: the bearing stayed locked for all observations of a group
 * @param bearings_rad   NULL: zero; or count: its nominal angle; the first one of a group counts
 * @param covariances    NULL: by the options; or count x 36, of (rotation vector, translation) applied after the pose
 * @return LH_EINPUT: numbers not finite; LH_EDEGENERATE: too few observations, poses that hardly differ, lengths that
 * do not belong to them
 */
LH_API lh_status lh_mechanism_calibrate(lh_context *ctx, const lh_mechanism *guess, size_t count,
                                        const double *cam_from_world, const double *commanded_m, const int32_t *groups,
                                        const double *bearings_rad, const double *covariances,
                                        const lh_mechanism_calibration_options *options,
                                        lh_mechanism_calibration **out);
LH_API void lh_mechanism_calibration_destroy(lh_mechanism_calibration *calibration);
/** The guess with what was found. */
LH_API lh_status lh_mechanism_calibration_mechanism(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                                    lh_mechanism **out);

typedef struct lh_mechanism_fit {
  size_t struct_size;
  double length_rms_m; /**< of the residuals of lengths that count */
  double sigma0;       /**< residuals over what was expected: about 1 */
  size_t rejected;     /**< observations whose pose contradicts the others */
  size_t groups;       /**< bearing groups */
  size_t parameters;   /**< rows of the covariance */
} lh_mechanism_fit;
LH_API lh_status lh_mechanism_calibration_fit(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                              lh_mechanism_fit *out);
/** Straight length = gain x commanded + offset. n: cables; each may be NULL. */
LH_API lh_status lh_mechanism_calibration_winches(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                                  double *offsets_m, double *gains, size_t n);
/** The bearing's angles. n: at least the fit's groups; each may be NULL; groups ascend. */
LH_API lh_status lh_mechanism_calibration_bearings(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                                   int32_t *groups, double *bearings_rad, size_t n);
/** indices: room for the fit's rejected observations; ascending. */
LH_API lh_status lh_mechanism_calibration_rejected(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                                   size_t *indices, size_t n);
/** "departure 1 x", "offset 1", …: the covariance's rows. */
LH_API lh_status lh_mechanism_calibration_parameter(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                                    size_t i, char *buffer, size_t size, size_t *needed);
/** covariance: n x n for the fit's n parameters, m² and rad². */
LH_API lh_status lh_mechanism_calibration_covariance(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                                     double *covariance, size_t n);
/** What these observations do not tell, in words; 0 for NULL. */
LH_API size_t lh_mechanism_calibration_problem_count(const lh_mechanism_calibration *calibration);
LH_API lh_status lh_mechanism_calibration_problem(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                                  size_t i, char *buffer, size_t size, size_t *needed);
/** What to command so that the platform stands there, m. n: cables. */
LH_API lh_status lh_mechanism_calibration_commanded(lh_context *ctx, const lh_mechanism_calibration *calibration,
                                                    const double world_from_platform[12], double *lengths_m, size_t n);

/* ---- lens and object -----------------------------------------------------------------------------------------------
 */

/** Lens and sensor as their makers give them; 0 in a field: 18 mm, 22.7 x 15.1 mm, 3072 x 2048, f/16, 0.015 mm. */
typedef struct lh_optics {
  size_t struct_size;
  double focal_length_mm;
  double sensor_width_mm, sensor_height_mm;
  int32_t width_px, height_px;
  double f_number;
  double circle_of_confusion_mm; /**< blur that still counts as sharp */
} lh_optics;

/** An upright cylinder about the centre of the views that holds the object; a sphere where height_m is 0. */
typedef struct lh_object_size {
  size_t struct_size;
  double diameter_m, height_m;
} lh_object_size;

/** The camera without distortion that a lens makes when focused at a distance. */
LH_API lh_status lh_optics_camera(lh_context *ctx, const lh_optics *optics, double focus_m, lh_camera *camera);
/**
 * The smallest radius of a hemisphere, m, from all of which the object fills the picture.
 *
 * @param margin             share of the picture that stays free on each side, 0 … 0.45
 * @param pointing_error_rad the cameras miss the centre by up to that along the meridian, 0 … pi/3
 * @return LH_EDEGENERATE: no radius up to 1 km does
 */
LH_API lh_status lh_optics_fill_radius(lh_context *ctx, const lh_optics *optics, const lh_object_size *object,
                                       int32_t landscape, double margin, double pointing_error_rad, double *radius_m);
/** The object on its pedestal, from the floor to its top. center: of the views; floor_m: its height in the world. */
LH_API lh_status lh_object_keep_out(lh_context *ctx, const lh_object_size *object, const double center[3],
                                    double floor_m, lh_keep_out *out);

/* ---- plan ----------------------------------------------------------------------------------------------------------
 */

/** Where photographs are taken, in which order. Never changes. */
typedef struct lh_plan lh_plan;

#define LH_BEARING_GRAVITY 0 /**< a solenoid frees it where the platform is tilted enough */
#define LH_BEARING_FIXED 1
#define LH_BEARING_MOTOR 2

/** Views of an object from a hemisphere, and how the robot goes there. */
typedef struct lh_plan_options {
  size_t struct_size;
  const lh_mechanism *mechanism; /**< NULL: a turntable or a hand */
  const char *robot;             /**< without a mechanism: "hand" or "turntable"; NULL: "hand" */
  const char *cameras;           /**< names, joined by commas; NULL: "camera" */
  double center[3];
  double radius_m;        /**< 0: 1.5 */
  int32_t azimuths, rows; /**< 0: 24, 10 */
  double spacing_rad;     /**< > 0: in place of azimuths and rows, steps of at most that */
  int32_t thin;           /**< yes: fewer azimuths towards the zenith */
  int32_t landscape;      /**< yes: pictures are wide; without a mechanism only */
  double phi_from_rad;
  double phi_to_rad; /**< 0: pi/2 */
  int32_t own_tilt;  /**< yes: the platform is tilted by tilt_factor phi + tilt_offset_rad; else 2/3, -pi/6 */
  int32_t bearing;   /**< LH_BEARING_… */
  double tilt_factor, tilt_offset_rad;
  double bearing_tolerance_rad; /**< azimuths that far on both sides share a bearing: fewer turns */
  double settle_s;              /**< until the swing has died out; 0: 7; negative: none */
  double exposure_s;            /**< 0: 0.5 */
  double travel_s;              /**< without a mechanism: between views; 0: 3 on a turntable, 10 in a hand */
  double turn_s;                /**< each time the bearing turns; 0: 4 */
  const lh_keep_out *object;    /**< no part of the robot may enter it; NULL: none */
  double clearance_m;           /**< of cables and platform to it, of the platform to the room; 0: 5 cm */
  double cable_clearance_m;     /**< between cables; 0: 5 mm */
  int32_t pictures_per_battery; /**< 0: 1000; negative: no end */
  int32_t raster;               /**< yes: azimuth by azimuth, from above downwards; else a short way is searched for */
  int32_t kicks;                /**< how long; 0: 1000; negative: hardly */
  uint64_t seed;                /**< of the search; 0: 1 */
} lh_plan_options;

/** Stops that can't be taken are left out; lh_plan_describe names them.
 *  @return LH_EINVAL; LH_EDEGENERATE: no stop can be taken, and why; LH_ECANCELLED */
LH_API lh_status lh_plan_hemisphere(lh_context *ctx, const lh_plan_options *options, lh_plan **out);
/** Reads a "lumihull-plan" file. @return LH_ENOTFOUND, LH_EIO, LH_EINPUT */
LH_API lh_status lh_plan_load(lh_context *ctx, const char *file, lh_plan **out);
LH_API lh_status lh_plan_save(lh_context *ctx, const lh_plan *plan, const char *file);
LH_API void lh_plan_destroy(lh_plan *plan);

/** 0 for NULL. */
LH_API size_t lh_plan_stop_count(const lh_plan *plan);
/** Travel, settling and exposures of all stops, s; 0 for NULL. */
LH_API double lh_plan_duration(const lh_plan *plan);
/** @return LH_ENOTFOUND: the plan has none */
LH_API lh_status lh_plan_mechanism(lh_context *ctx, const lh_plan *plan, lh_mechanism **out);

typedef struct lh_stop {
  size_t struct_size;
  double theta_rad, phi_rad;      /**< of the view */
  double roll_rad;                /**< of the bearing; without a mechanism of the camera, 0 wide */
  double world_from_platform[12]; /**< without a mechanism of the camera itself */
  double cam_from_world[12];      /**< commanded */
  double travel_s;                /**< from the stop before */
  double settle_s, exposure_s;
  size_t cables;      /**< lengths that it has */
  int32_t photograph; /**< 0: it is only passed */
} lh_stop;
LH_API lh_status lh_plan_stop(lh_context *ctx, const lh_plan *plan, size_t stop, lh_stop *out);
/** Photographs are named after it. */
LH_API lh_status lh_plan_stop_name(lh_context *ctx, const lh_plan *plan, size_t stop, char *buffer, size_t size,
                                   size_t *needed);
/** What the operator is asked to do before the robot goes there; may be "". */
LH_API lh_status lh_plan_stop_pause(lh_context *ctx, const lh_plan *plan, size_t stop, char *buffer, size_t size,
                                    size_t *needed);
/** n: room for the stop's cables. */
LH_API lh_status lh_plan_stop_lengths(lh_context *ctx, const lh_plan *plan, size_t stop, double *lengths_m, size_t n);

/** Figures and problems as one JSON object: "stops", "photographs", "total_s", …; "left_out": names of stops that can't
 *  be taken, "left_out_why"; "notes"; "problems": stops and ways of the plan that its mechanism can't take. Of a loaded
 *  plan nothing is known of what was left out. */
LH_API lh_status lh_plan_describe(lh_context *ctx, const lh_plan *plan, char *buffer, size_t size, size_t *needed);

/** What the photographs will show, and what the plan asks of the mechanism. */
typedef struct lh_plan_report {
  size_t struct_size;
  size_t photographs;     /**< stops where some are taken */
  size_t cut_off;         /**< of these: the object is not wholly in the picture */
  double least_margin_px; /**< from the object's outline to the border; -infinity: behind the camera */
  double median_fill;     /**< of the picture by the object, along its tighter direction */
  double least_tension_N, greatest_tension_N; /**< over all stops; 0 without a mechanism */
  double least_clearance_m;
  int64_t cables_in_picture; /**< photographs in which a cable may be seen; -1: the lens model ends before a corner */
} lh_plan_report;
LH_API lh_status lh_plan_judge(lh_context *ctx, const lh_plan *plan, const lh_camera *camera,
                               const lh_object_size *object, const double center[3], lh_plan_report *out);

/* ---- capture session -----------------------------------------------------------------------------------------------
 */

/*
 * Robots, cameras and the operator are asked on the thread of the call that uses them. What asks them must not use the
 * call's context, but for lh_context_cancel and lh_context_cancelled. `user` is handed to each function. What fails
 * returns a status; `reason` (256 bytes, "" at first) takes a line that says why.
 */

/** What carries the camera. One thread at a time. */
typedef struct lh_robot lh_robot;
/** What takes photographs. One thread at a time. */
typedef struct lh_camera_device lh_camera_device;
/** A controller on a serial line. */
typedef struct lh_serial_link lh_serial_link;

#define LH_MAX_CABLES 12

typedef struct lh_robot_state {
  size_t struct_size;
  int32_t ready; /**< connected, no fault, may be commanded */
  int32_t moving;
  int32_t position_known; /**< no: the operator is asked before anything moves */
  size_t cables;          /**< lengths that are known; 0: none */
  double lengths_m[LH_MAX_CABLES];
  char fault[256]; /**< in words; "": none */
} lh_robot_state;

typedef struct lh_robot_functions {
  size_t struct_size;
  void *user;
  /** state: zero at first. */
  lh_status (*state)(void *user, lh_robot_state *state, char *reason);
  /** Goes to a stop and waits until it is there; the way was checked. lengths_m: stop->cables of them. */
  lh_status (*move_to)(void *user, const char *name, const lh_stop *stop, const double *lengths_m, char *reason);
  /** NULL: nothing turns. */
  lh_status (*set_roll)(void *user, double roll_rad, char *reason);
  /** The operator says that the platform is at that stop. NULL: nobody needs to know. */
  lh_status (*declare_position)(void *user, const char *name, const lh_stop *stop, const double *lengths_m,
                                char *reason);
  /** Stops motors, leaves outputs safe. NULL: nothing to do. */
  void (*make_safe)(void *user);
} lh_robot_functions;

#define LH_SHOT_DONE 0    /**< exactly one exposure was made */
#define LH_SHOT_REFUSED 1 /**< none was made, surely */
#define LH_SHOT_UNKNOWN 2 /**< one or none: the operator decides */

typedef struct lh_shot {
  size_t struct_size;
  int32_t state;    /**< LH_SHOT_…; LH_SHOT_UNKNOWN at first */
  char file[1024];  /**< where the camera's file is, where it delivers files; else "" */
  char detail[256]; /**< why, for refused and unknown */
} lh_shot;

typedef struct lh_camera_functions {
  size_t struct_size;
  void *user;
  int32_t delivers_files; /**< yes: shoot brings the file; no: it stays on the camera's card */
  /** Releases the shutter once, returns after the exposure in bounded time. A retry after a refusal has the same id,
   * any other exposure a new one. A file goes into `folder` under a name that is not in use there. A status other than
   *  LH_OK: the device is lost. */
  lh_status (*shoot)(void *user, uint32_t id, double exposure_s, const char *folder, lh_shot *shot, char *reason);
  /** What became of an earlier shot. NULL: it can't tell. */
  lh_status (*recall)(void *user, uint32_t id, lh_shot *shot, char *reason);
  void (*make_safe)(void *user); /**< NULL: nothing to do */
} lh_camera_functions;

/** A robot of the application's own. functions is copied; `user` must outlive the robot. */
LH_API lh_status lh_robot_create(lh_context *ctx, const lh_robot_functions *functions, lh_robot **out);
LH_API lh_status lh_camera_device_create(lh_context *ctx, const lh_camera_functions *functions, lh_camera_device **out);
/**
 * By a word, as `lumihull capture` takes them. The device is opened by each session or dry run that uses it, and closed
 * when that ends; then its errors are told, too: LH_ENOTFOUND, LH_EIO.
 *
 * Robots: "simulate", which only takes its time; "turntable" and "hand", the session's operator is asked to do it;
 * "serial:PORT", the winches of the plan's mechanism. Cameras: "simulate", small pictures of a pattern; "hand";
 * "serial:PORT", or "serial" at the robot's own port; "gphoto2", "gphoto2:PORT"; "folder:DIR", where another program
 * leaves files. What is simulated remembers in FOLDER.simulated, beside the session's folder. The program's "rig", the
 * virtual rig that photographs a scene, is not in the library: bring devices of your own by functions, above, or call
 * the program.
 *
 * @return LH_EINVAL: no such word
 */
LH_API lh_status lh_robot_by_word(lh_context *ctx, const char *word, lh_robot **out);
LH_API lh_status lh_camera_device_by_word(lh_context *ctx, const char *word, lh_camera_device **out);
/** Opens a port for this process alone, e.g. "/dev/ttyUSB0". baud: 0: 57600. @return LH_ENOTFOUND, LH_EIO */
LH_API lh_status lh_serial_link_open(lh_context *ctx, const char *device, uint32_t baud, lh_serial_link **out);
/** The robots and cameras on it keep it open. */
LH_API void lh_serial_link_destroy(lh_serial_link *link);
/** The winches. mechanism: that of the plan. */
LH_API lh_status lh_robot_serial(lh_context *ctx, const lh_serial_link *link, const lh_mechanism *mechanism,
                                 lh_robot **out);
/** The shutter's contact; files stay in the camera. */
LH_API lh_status lh_camera_device_serial(lh_context *ctx, const lh_serial_link *link, lh_camera_device **out);
LH_API void lh_robot_destroy(lh_robot *robot);
LH_API void lh_camera_device_destroy(lh_camera_device *camera);

#define LH_QUESTION_MOTION 0   /**< the robot would start to move */
#define LH_QUESTION_POSITION 1 /**< where the platform is */
#define LH_QUESTION_DOUBT 2    /**< what became of a shot */
#define LH_QUESTION_TASK 3     /**< something to do by hand */

/** Who is asked what only a person can tell. */
typedef struct lh_operator {
  size_t struct_size;
  void *user;
  /** *answer: which of n choices; "stop" among them ends the session. */
  lh_status (*ask)(void *user, int32_t question, const char *text, const char *const *choices, size_t n,
                   size_t *answer);
  void (*tell)(void *user, const char *line); /**< NULL: nobody listens */
} lh_operator;

typedef struct lh_session_options {
  size_t struct_size;
  const char *names;       /**< of photographs, with {stop}, {camera}, {number}; NULL: "{stop}-{camera}" */
  double settle_s;         /**< instead of the plan's; 0: the plan's; negative: none */
  double exposure_s;       /**< instead of the plan's; 0: the plan's */
  int32_t retries;         /**< of a refused shot; 0: 2; negative: none */
  int32_t agree_to_motion; /**< yes: without an operator the robot may start where it knows its position */
  const char *retake;      /**< a stop to photograph once more, and nothing else; NULL: none */
  size_t pause_after;      /**< photographs; 0: go on to the end */
  const char *devices;     /**< words for the journal; NULL: the plan's robot */
} lh_session_options;

typedef struct lh_session_result {
  size_t struct_size;
  size_t views, of; /**< photographs in the folder, of the plan's */
  size_t taken;     /**< by this call */
  size_t awaited;   /**< taken, their files still on the camera's card */
  int32_t paused;
} lh_session_result;

/** Checks all that can be checked without moving or writing: {"problems": […], "notes": […], "left": n, "seconds": s}.
 *  cameras: n, in the order of the plan's. */
LH_API lh_status lh_session_dry_run(lh_context *ctx, const lh_plan *plan, lh_robot *robot,
                                    lh_camera_device *const *cameras, size_t n, const char *folder,
                                    const lh_session_options *options, char *buffer, size_t size, size_t *needed);
/**
 * Carries out a plan, or goes on with it: moves, waits until the camera hangs still, releases each camera, puts the
 * photographs into `folder`, which becomes a capture. After a killed session the same call goes on: no view is lost,
 * none is taken twice unless the operator says so. However it ends, robot and cameras are made safe.
 *
 * @param who    NULL: nobody is there; a question that needs an answer ends the session
 * @param result NULL, or how far it came
 * @return LH_EINPUT: a problem that the dry run finds; a folder that was begun with another plan; LH_EIO: disk, device,
 *         another process at work here; LH_EINVAL: a question that nobody answers; LH_ECANCELLED: by lh_context_cancel,
 *         or the operator's "stop"
 */
LH_API lh_status lh_session_run(lh_context *ctx, const lh_plan *plan, lh_robot *robot, lh_camera_device *const *cameras,
                                size_t n, const char *folder, const lh_session_options *options, const lh_operator *who,
                                lh_session_result *result);

typedef struct lh_card_options {
  size_t struct_size;
  const char *camera;    /**< whose card it is, by its name in the plan; NULL: the only camera */
  int32_t clock_known;   /**< yes: clock_offset_s holds to half a minute; else it is found */
  double clock_offset_s; /**< the camera's clock less UTC */
  int32_t again;         /**< yes: shots without a picture are to be photographed again */
  int32_t dry_run;       /**< yes: nothing is done, only told */
  void *user;
  void (*tell)(void *user, const char *line); /**< what is found, a line each; NULL: nobody listens */
} lh_card_options;

typedef struct lh_card_result {
  size_t struct_size;
  size_t matched;   /**< pictures of shots that had not landed before */
  size_t landed;    /**< of these, by this call */
  size_t missing;   /**< shots that were taken, without a picture */
  size_t extra;     /**< pictures of no shot */
  size_t ambiguous; /**< places that fit in more than one way; left out */
  size_t troubles;  /**< pictures that could not be landed; `tell` says why */
} lh_card_result;

/** Pictures of a memory card to the shots of a session's journal. The card is only read, nothing is overwritten.
 *  @param card   the folder of the pictures, or of a copy of them
 *  @param result NULL, or what became of it
 *  @return LH_ENOTFOUND, LH_EINPUT: no journal, a damaged one; LH_EIO: disk, another process at work here */
LH_API lh_status lh_card_land(lh_context *ctx, const char *folder, const char *card, const lh_card_options *options,
                              lh_card_result *result);

/* ---- experiments on the robot --------------------------------------------------------------------------------------
 */

/** How well the robot came back, of a calibrated capture whose plan visits places several times: {"places": [{"name",
 *  "photographs", "distances_m", "angles_rad", …}], "largest_distance_m", "largest_angle_rad", "rms_distance_m",
 *  "rms_angle_rad", "measured_m", …}: distances and angles of measured poses to their place's mean.
 *  @return LH_EINPUT: no scale, or no place with two measured visits */
LH_API lh_status lh_repeatability(lh_context *ctx, const lh_capture *capture, char *buffer, size_t size,
                                  size_t *needed);
/** n poses of 3 x 4; their mean, and how far each is from it: (n) m, (n) rad. Any of the three may be NULL. */
LH_API lh_status lh_pose_spread(lh_context *ctx, const double *world_from_camera, size_t n, double mean[12],
                                double *distance_m, double *angle_rad);
/** When a target in a film stays within allowed_px of where it rests, which is the mean of the last rest_s seconds.
 *  @param time_s      (n), ascending
 *  @param center_px   (n x 2)
 *  @param allowed_px  0: 0.5
 *  @param rest_s      0: 2
 *  @param distance_px NULL, or (n) from where it rests
 *  @param settle_s    NULL, or the first time of these; -1: it was not within at the end
 *  @param rest_px     NULL, or the RMS distance over the rest */
LH_API lh_status lh_stability(lh_context *ctx, const double *time_s, const double *center_px, size_t n,
                              double allowed_px, double rest_s, double *distance_px, double *settle_s, double *rest_px);

#ifdef __cplusplus
}
#endif

#endif
