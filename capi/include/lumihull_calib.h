/**
 * Lumihull's C interface: printed targets, where they are in photographs, lens calibration, resection. A part of
 * lumihull.h, whose rules hold here, too; include that.
 */
#ifndef LUMIHULL_CALIB_H
#define LUMIHULL_CALIB_H

#include <lumihull.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- families of targets ----------------------------------------------------------------------------------------- */

#define LH_TARGETS_CIRCLES 0
#define LH_TARGETS_SQUARES 1

#define LH_CELL_DARK 0
#define LH_CELL_LIGHT 1
#define LH_CELL_UNKNOWN 2

/** What a family of coded targets is: "paper4x4", "matrix5x5", "matrix6x6" (circles on a grid; the left column and the
 *  bottom row are dark, the others hold the id), "apriltag:36h11", …, "aruco:6x6_250", … (squares). */
typedef struct lh_target_family {
  size_t struct_size;
  int32_t kind;             /**< LH_TARGETS_… */
  int32_t grid;             /**< cells along a side; squares: with the black border */
  int32_t id_count;
  int32_t minimum_distance; /**< cells in which two ids differ at least, one of them turned by 0 to 3 quarters */
} lh_target_family;

/** What was read from cells. */
typedef struct lh_decoded_target {
  size_t struct_size;
  int32_t id;            /**< -1: no id, or more than one, is near enough */
  int32_t quarter_turns; /**< clockwise turns by 90 degrees that bring the cells upright, 0 … 3 */
  int32_t corrected;     /**< cells that were wrong */
  int32_t erased;        /**< cells that were unknown */
} lh_decoded_target;

/** The names of all families, one a line. */
LH_API lh_status lh_target_families(lh_context *ctx, char *buffer, size_t size, size_t *needed);
/** LH_EINVAL: no such family; LH_EUNSUPPORTED: a family of AprilTag with cells outside of its border. */
LH_API lh_status lh_target_family_info(lh_context *ctx, const char *family, lh_target_family *out);
/** ids: room for id_count; ascending. */
LH_API lh_status lh_target_family_ids(lh_context *ctx, const char *family, int32_t *ids, size_t n);
/** cells: room for grid x grid, row-major from the top left: LH_CELL_DARK, LH_CELL_LIGHT. LH_EINVAL: no such id. */
LH_API lh_status lh_target_family_cells(lh_context *ctx, const char *family, int32_t id, uint8_t *cells, size_t n);
/** Circles only: the id that n = grid x grid cells (LH_CELL_…) show in some rotation. strength 0 … 1: how much of the
 *  code's power corrects wrong cells; 0: none is accepted. LH_OK with id = -1 where there is no answer. */
LH_API lh_status lh_target_family_decode(lh_context *ctx, const char *family, const uint8_t *cells, size_t n,
                                         double strength, lh_decoded_target *out);

/* ---- sets of targets --------------------------------------------------------------------------------------------- */

/** What was printed and what is known of how it lies: designs, boards of targets at known places, fields of points. */
typedef struct lh_target_set lh_target_set;

/** One kind of target as printed. A target's frame: origin in the middle, x right, y down, z into the paper, metres. */
typedef struct lh_target_design {
  size_t struct_size;
  double size_m;            /**< circles: from one centre to the next; squares: side of the black square. Where sheets
                                 are written 0 is as large as fits */
  double circle_diameter_m; /**< 0: half of size_m. Circles only */
  double ring_diameter_m;   /**< of a ring's light centre; 0: 0.55 of the circle's. Circles only */
  double scale_x, scale_y;  /**< true length / drawn length; 0: 1 */
  int32_t solid_light;      /**< light cells are discs without a ring. Circles only */
  int32_t has_colors;       /**< 0: circles dark green on light green, squares black on white */
  uint32_t ink, paper;      /**< 0xRRGGBB, where has_colors */
} lh_target_design;

#define LH_GRID_CIRCLES 0
#define LH_GRID_CHESSBOARD 1

/** A field of points for lens calibration: circles, or the inner corners of a chessboard; row-major. */
typedef struct lh_point_grid {
  size_t struct_size;
  int32_t kind;             /**< LH_GRID_… */
  int32_t columns, rows;    /**< points along x and y, 2 … 100 */
  double spacing_m;         /**< where a sheet is written 0 is as large as fits */
  double circle_diameter_m; /**< 0: half of the spacing. Circles only */
} lh_point_grid;

/** Reads a "lumihull-targets" file. LH_EINPUT names the place of what is wrong or contradicts itself. */
LH_API lh_status lh_target_set_load(lh_context *ctx, const char *file, lh_target_set **out);
/** From FAMILY:SIZE, as "matrix5x5:18mm", "aruco:6x6_250:35mm", "chessboard:9x6:25mm"; several joined by commas. */
LH_API lh_status lh_target_set_from_word(lh_context *ctx, const char *word, lh_target_set **out);
/** A file where `text` names one (it ends with ".json" or exists), else a word. */
LH_API lh_status lh_target_set_from_text(lh_context *ctx, const char *text, lh_target_set **out);
LH_API lh_status lh_target_set_save(lh_context *ctx, const lh_target_set *set, const char *file);
/** NULL is allowed. */
LH_API void lh_target_set_destroy(lh_target_set *set);

/** 0 for NULL. */
LH_API size_t lh_target_set_design_count(const lh_target_set *set);
LH_API size_t lh_target_set_board_count(const lh_target_set *set);
LH_API size_t lh_target_set_grid_count(const lh_target_set *set);
/** 0 for NULL and where there is no such board. */
LH_API size_t lh_target_set_board_size(const lh_target_set *set, size_t board);

LH_API lh_status lh_target_set_design(lh_context *ctx, const lh_target_set *set, size_t design, lh_target_design *out);
/** The design's family. */
LH_API lh_status lh_target_set_family(lh_context *ctx, const lh_target_set *set, size_t design, char *buffer, size_t size,
                                      size_t *needed);
/** xy: room for n x 2: where a design's features are in the target's frame, m: grid² circles, row-major from the top
 *  left, or four corners: top left, top right, bottom right, bottom left. */
LH_API lh_status lh_target_set_features(lh_context *ctx, const lh_target_set *set, size_t design, double *xy, size_t n);
LH_API lh_status lh_target_set_board_name(lh_context *ctx, const lh_target_set *set, size_t board, char *buffer,
                                          size_t size, size_t *needed);
/** Target i of a board. design, id, board_from_target (3 x 4): each may be NULL. */
LH_API lh_status lh_target_set_board_target(lh_context *ctx, const lh_target_set *set, size_t board, size_t i,
                                            size_t *design, int32_t *id, double *board_from_target);
LH_API lh_status lh_target_set_grid(lh_context *ctx, const lh_target_set *set, size_t grid, lh_point_grid *out);

/* ---- sheets to print --------------------------------------------------------------------------------------------- */

#define LH_PAPER_LETTER 0
#define LH_PAPER_A4 1

#define LH_SHEET_PDF 1
#define LH_SHEET_SVG 2

typedef struct lh_sheet_options {
  size_t struct_size;
  int32_t paper;       /**< LH_PAPER_… */
  int32_t formats;     /**< LH_SHEET_… joined by |; 0: PDF */
  int32_t per_sheet;   /**< targets on a sheet, 1 or 4; 0: 1 */
  int32_t paint_paper; /**< fill the sheet with the paper's colour, for white paper */
  int32_t no_text;     /**< no ids and no description in plain text */
  int32_t no_bar;      /**< no bar of 150.0 mm */
} lh_sheet_options;

/**
 * Draws sheets of targets: STEM.pdf with a page a sheet, or STEM-1.svg, STEM-2.svg, …; and STEM.json, which says where
 * each target is: a board for each sheet, its origin the sheet's upper left corner.
 *
 * @param design  NULL: the defaults, as large as fits
 * @param ids     n of the family's, each once
 * @param out     NULL, or what was written into STEM.json
 * @return LH_EINVAL: ids that the family does not have, a size that does not fit on the paper
 */
LH_API lh_status lh_target_sheets_write(lh_context *ctx, const char *stem, const char *family,
                                        const lh_target_design *design, const int32_t *ids, size_t n,
                                        const lh_sheet_options *options, lh_target_set **out);
/** The same for one sheet with a field of points, black on white. */
LH_API lh_status lh_grid_sheet_write(lh_context *ctx, const char *stem, const lh_point_grid *grid,
                                     const lh_sheet_options *options, lh_target_set **out);

/* ---- targets in photographs -------------------------------------------------------------------------------------- */

/** Finds, reads and measures the targets of a set. Never changes: any number of threads may use one. */
typedef struct lh_target_detector lh_target_detector;
/** What was found in one photograph. Never changes. */
typedef struct lh_detections lh_detections;

typedef struct lh_detect_options {
  size_t struct_size;
  /** Ink (its foreground) against enclosure and paper (its background); borrowed for lh_target_detector_create. NULL:
   *  adaptive contrast */
  const lh_color_key *ink_key;
  double min_circle_px; /**< smallest minor axis that is looked for, at least 3; 0: 4.5 */
  double correct; /**< how much of a code's power to correct wrong cells is used, up to 1; 0: 1; negative: none */
  int32_t coarse; /**< yes: circles by the dual-conic operator alone, faster; else to the bound that noise sets */
} lh_detect_options;

/** @return LH_EINVAL: options; a set that contradicts itself */
LH_API lh_status lh_target_detector_create(lh_context *ctx, const lh_target_set *set, const lh_detect_options *options,
                                           lh_target_detector **out);
LH_API void lh_target_detector_destroy(lh_target_detector *detector);

/** photo: any size and type, 1, 3 or 4 channels. @return LH_ECANCELLED */
LH_API lh_status lh_target_detector_detect(lh_context *ctx, const lh_target_detector *detector, const lh_image *photo,
                                           lh_detections **out);
LH_API void lh_detections_destroy(lh_detections *detections);

typedef struct lh_detection {
  size_t struct_size;
  int32_t design; /**< which of the set's designs */
  int32_t id;
  size_t features;   /**< points that were measured */
  int32_t corrected; /**< cells that were read wrongly and corrected */
  int32_t erased;    /**< cells that could not be read */
  /** Row-major; the target's plane in metres. Circles are to be seen at their ellipses' centres through it. */
  double pixel_from_target[9];
  double rms_px; /**< sqrt(sum of dx² + dy² / features) about that homography */
} lh_detection;

/** Targets that were found; 0 for NULL. */
LH_API size_t lh_detections_count(const lh_detections *detections);
LH_API lh_status lh_detections_get(lh_context *ctx, const lh_detections *detections, size_t i, lh_detection *out);

/**
 * The measured points of target i.
 *
 * @param index      n, or NULL: which point of the target. Circles: row-major from the top left; squares: corners from the
 *                   top left, clockwise
 * @param pixel      n x 2, or NULL. Circles: their *ellipses'* centres, which is not where circles' centres are seen
 * @param covariance n x 3, or NULL: xx, xy, yy of pixel, px²
 * @param dual_conic n x 9, or NULL, row-major: of the ellipse, its last element 1; zero for corners
 * @param n          at least as many as the target has features
 */
LH_API lh_status lh_detections_features(lh_context *ctx, const lh_detections *detections, size_t i, int32_t *index,
                                        double *pixel, double *covariance, double *dual_conic, size_t n);

#define LH_REFUSED_NO_CODE 0          /**< no id of its family */
#define LH_REFUSED_HOMOGRAPHY 1       /**< its points do not lie as printed */
#define LH_REFUSED_DUPLICATE 2        /**< the id was found twice */
#define LH_REFUSED_TOO_FEW_FEATURES 3 /**< too little of it is seen */
#define LH_REFUSED_UNKNOWN_ID 4       /**< an id that the set does not hold */
#define LH_REFUSED_OVEREXPOSED 5      /**< too little of it is seen, for the light about it is clipped: expose less */

typedef struct lh_refused_target {
  size_t struct_size;
  int32_t reason; /**< LH_REFUSED_… */
  int32_t id;     /**< -1: none was read */
  double pixel[2];
  double size_px;
} lh_refused_target;

/** What looked like a target and was refused; 0 for NULL. */
LH_API size_t lh_detections_refused_count(const lh_detections *detections);
LH_API lh_status lh_detections_refused(lh_context *ctx, const lh_detections *detections, size_t i,
                                       lh_refused_target *out);

/** The photograph with what was found drawn in. magnify: of residuals; 0: 100. */
LH_API lh_status lh_detections_draw(lh_context *ctx, const lh_detections *detections,
                                    const lh_target_detector *detector, const lh_image *photo, double magnify,
                                    lh_image **out);

/** Samples of targets' ink and of what is around it. One thread at a time. */
typedef struct lh_ink_samples lh_ink_samples;
LH_API lh_status lh_ink_samples_create(lh_context *ctx, lh_ink_samples **out);
LH_API void lh_ink_samples_destroy(lh_ink_samples *samples);
/** From a photograph and what detector found in it without a key. */
LH_API lh_status lh_ink_samples_add(lh_context *ctx, lh_ink_samples *samples, const lh_image *photo,
                                    const lh_target_detector *detector, const lh_detections *found);
/** A key whose foreground is the ink, for lh_detect_options. k: neighbours asked; 0: 7.
 *  @return LH_EDEGENERATE: fewer than 1000 pixels of ink */
LH_API lh_status lh_ink_samples_train(lh_context *ctx, const lh_ink_samples *samples, int32_t k, lh_color_key **out);

/* ---- resection --------------------------------------------------------------------------------------------------- */

/** Arrays are borrowed for the call; NULL: the default for all matches. */
typedef struct lh_resect_options {
  size_t struct_size;
  const double *covariances; /**< n x 2 x 2, px², of the pixels; NULL: 1 px² each */
  const double *radii;       /**< n, in the world's unit: > 0 a circle, whose pixel is its ellipse's centre; NULL: points */
  const double *normals;     /**< n x 3, of the circles' planes; not NULL where radii is not */
  double outlier_sigma;      /**< beyond so many standard deviations (2-D) a match is an outlier, 2 … 100; 0: 4 */
  int32_t not_robust;        /**< yes: every match counts */
  int32_t max_iterations;    /**< 1 … 1000; 0: 20 */
  uint64_t seed;             /**< of the minimal samples; 0: 1 */
} lh_resect_options;

typedef struct lh_resection {
  size_t struct_size;
  /** 6 x 6, of (rotation vector, translation) of a small motion applied after cam_from_world, in the camera's frame:
   *  rad, world's unit. Times sigma0² where that is above 1 by more than chance. */
  double covariance[36];
  double rms_px;       /**< sqrt(sum of dx² + dy² over the matches that count / their number) */
  double sigma0;       /**< about 1 where the covariances are right */
  uint64_t outliers;   /**< how many matches don't count */
  int32_t iterations;
  /** Yes: a plane seen almost without perspective; another tilt fits nearly as well. */
  int32_t has_alternative;
  double alternative[12];        /**< cam_from_world, too */
  double alternative_chi2_ratio; /**< its weighted squared residuals over those of the first, >= 1 */
} lh_resection;

/**
 * Finds the pose of one photograph from points of known position.
 *
 * @param pixels         n x 2, px
 * @param world          n x 3, any unit
 * @param n              >= 4, at different places, not all on a line
 * @param cam_from_world 3 x 4
 * @param result         NULL, or what is known about it
 * @param outlier        NULL, or n: 1 for a match that does not count, else 0
 * @return LH_EINVAL: n too small or a value not finite; LH_EDEGENERATE: collinear or repeated points, points behind the
 *         camera, a mirrored world, no pose that the matches agree on
 * Source: Hartley & Zisserman 2000, ch. 7 (DLT), refined by reprojection error through the lens.
 */
LH_API lh_status lh_resect(lh_context *ctx, const lh_camera *camera, const double *pixels, const double *world, size_t n,
                           const lh_resect_options *options, double cam_from_world[12], lh_resection *result,
                           uint8_t *outlier);

/* ---- lens calibration -------------------------------------------------------------------------------------------- */

/** A calibrated camera: intrinsics with their covariance, poses, residuals. */
typedef struct lh_lens lh_lens;

/** The ten parameters of lh_camera in the order of covariances, as bits of lh_lens_options.free. */
#define LH_INTRINSIC_F (1u << 0)
#define LH_INTRINSIC_S (1u << 1)
#define LH_INTRINSIC_SKEW (1u << 2)
#define LH_INTRINSIC_U0 (1u << 3)
#define LH_INTRINSIC_V0 (1u << 4)
#define LH_INTRINSIC_K1 (1u << 5)
#define LH_INTRINSIC_K2 (1u << 6)
#define LH_INTRINSIC_K3 (1u << 7)
#define LH_INTRINSIC_P1 (1u << 8)
#define LH_INTRINSIC_P2 (1u << 9)
#define LH_INTRINSIC_NONE (1u << 31) /**< no parameter: poses alone */

typedef struct lh_lens_options {
  size_t struct_size;
  uint32_t free_parameters; /**< LH_INTRINSIC_…; 0: f, u0, v0, k1, k2, p1, p2 */
  int32_t keep_all;         /**< yes: plain least squares, no point is an outlier */
  double outlier_sigma;     /**< standard deviations (2-D) from where on a point is one; 0: 4 */
  int32_t max_iterations;   /**< 0: 100 */
} lh_lens_options;

/**
 * Calibrates a camera and its lens from photographs ("views") of a body of known points. Start in closed form (planes:
 * Zhang 2000; others: DLT), then the reprojection error is minimised over the free parameters and a pose for each view.
 *
 * @param views      number of views
 * @param counts     views: points in each one; the arrays below hold them one view after another, n = the sum
 * @param pixels     n x 2, px
 * @param points     n x 3: places on the body, metres
 * @param covariance NULL: 1 px² each; or n x 2 x 2, px²
 * @param radii      NULL: points; or n, metres: > 0 for a circle, whose *ellipse's* centre `pixels` holds then
 * @param normals    NULL: z; or n x 3, of the circles' planes
 * @param start      NULL: from nothing; or a camera to start from, and for the values of what is fixed
 * @return LH_EINVAL: sizes, not finite, covariances that are none; LH_EDEGENERATE: too few views or points, or views that
 *         do not determine the parameters (all parallel, …); LH_ECANCELLED
 */
LH_API lh_status lh_lens_calibrate(lh_context *ctx, size_t views, const size_t *counts, const double *pixels,
                                   const double *points, const double *covariance, const double *radii,
                                   const double *normals, int32_t width, int32_t height, const lh_camera *start,
                                   const lh_lens_options *options, lh_lens **out);
LH_API void lh_lens_destroy(lh_lens *lens);

/** camera: its struct_size says how much of it is filled. */
LH_API lh_status lh_lens_camera(lh_context *ctx, const lh_lens *lens, lh_camera *camera);
/** covariance: 10 x 10, in the order of the bits above; zero rows for what was fixed. */
LH_API lh_status lh_lens_covariance(lh_context *ctx, const lh_lens *lens, double covariance[100]);

typedef struct lh_lens_statistics {
  size_t struct_size;
  double rms_px;                 /**< sqrt(sum of dx² + dy² / points that count) */
  double sigma0;                 /**< residuals over their covariances: about 1 */
  double cross_validation_px;    /**< two halves of the views: largest difference over the picture; < 0: too few views */
  double cross_validation_sigma; /**< that difference over what the covariances expect */
  size_t points, outliers;
} lh_lens_statistics;

/** statistics: its struct_size says how much of it is filled. */
LH_API lh_status lh_lens_get_statistics(lh_context *ctx, const lh_lens *lens, lh_lens_statistics *statistics);
/** @return LH_ENOTFOUND: the view could not be used */
LH_API lh_status lh_lens_pose(lh_context *ctx, const lh_lens *lens, size_t view, double cam_from_body[12]);
/** Residuals in the order in which the points were given: errors n x 2, measured less predicted, px, NaN where there is
 *  none; outlier n: 1 or 0, also 1 where the view was left out. rows: the room in both, >= n. */
LH_API lh_status lh_lens_residuals(lh_context *ctx, const lh_lens *lens, double *errors, uint8_t *outlier, size_t rows);
/** Sentences about views that could not be used, weak geometry, and what to do. */
LH_API size_t lh_lens_problem_count(const lh_lens *lens);
LH_API lh_status lh_lens_problem(lh_context *ctx, const lh_lens *lens, size_t index, char *buffer, size_t size,
                                 size_t *needed);
/** The standard deviation (px, larger axis) of a distant point's pixel, the rotation that best compensates for a change of
 *  the intrinsics taken off: rows x columns places evenly over the picture; infinite beyond the lens's domain. */
LH_API lh_status lh_lens_uncertainty(lh_context *ctx, const lh_lens *lens, int32_t columns, int32_t rows,
                                     double *sigma_px);
/** A file ("lumihull-intrinsics"): camera, covariance, statistics. Loaded, it has neither poses nor residuals.
 *  @return save: LH_EIO; load: LH_ENOTFOUND, LH_EIO, LH_EINPUT */
LH_API lh_status lh_lens_save(lh_context *ctx, const lh_lens *lens, const char *file);
LH_API lh_status lh_lens_load(lh_context *ctx, const char *file, lh_lens **out);

/* ---- a capture's calibration: what the stage "calibrate" left -------------------------------------------------------- */

/** The targets as they were solved and how good the calibration is. Never changes. */
typedef struct lh_target_model lh_target_model;

/** targets.json of a capture, with its cameras and poses. @return LH_ENOTFOUND: the stage has not been run; LH_EINPUT */
LH_API lh_status lh_target_model_open(lh_context *ctx, const lh_capture *capture, lh_target_model **out);
LH_API void lh_target_model_destroy(lh_target_model *model);

typedef struct lh_calibration {
  size_t struct_size;
  size_t photos, photos_placed;
  size_t targets, targets_placed; /**< targets, or boards of targets */
  size_t removed;                 /**< observations, detections, targets and photographs that were left out */
  double rms_px;                  /**< sqrt(sum of dx² + dy² / observations that count) */
  double share;                   /**< of the observations in placed photographs that count */
  double sigma0;                  /**< residuals over their covariances: about 1 */
  double cross_validation_m;      /**< two halves of the photographs: RMS distance of the points; < 0: too few */
  double cross_validation_sigma;  /**< that over what the covariances expect, about 1; < 0: too few */
  double bend_m;                  /**< largest departure from flat, or from as printed */
  double print_scale[2];          /**< true length / length as printed, along x and y */
  int32_t parts;                  /**< parts of the photographs that share no target; the largest one is placed */
} lh_calibration;

/** calibration: its struct_size says how much of it is filled. */
LH_API lh_status lh_target_model_calibration(lh_context *ctx, const lh_target_model *model, lh_calibration *calibration);
/** All figures, what was removed and why, intrinsics with standard deviations and the verdict, as one JSON object. */
LH_API lh_status lh_target_model_describe(lh_context *ctx, const lh_target_model *model, char *buffer, size_t size,
                                          size_t *needed);

typedef struct lh_solved_target {
  size_t struct_size;
  int32_t board;              /**< which of the set's boards; -1: a target of its own */
  int32_t design, id;         /**< of a target of its own; else -1 */
  int32_t placed;             /**< yes: it has a pose and points in the world */
  size_t points;              /**< printed points */
  int32_t photos;             /**< that show it */
  double rms_px;
  double world_from_body[12]; /**< 3 x 4, metres, where placed */
  int32_t part;               /**< which part of the photographs it was solved with; 0: the placed one; -1: none */
  double part_from_body[12];  /**< as world_from_body, in the frame of its part, where part >= 0 */
} lh_solved_target;

/** Targets, or boards of targets; 0 for NULL. */
LH_API size_t lh_target_model_count(const lh_target_model *model);
LH_API lh_status lh_target_model_get(lh_context *ctx, const lh_target_model *model, size_t i, lh_solved_target *out);
/** "matrix5x5 17", or a board's name. */
LH_API lh_status lh_target_model_name(lh_context *ctx, const lh_target_model *model, size_t i, char *buffer, size_t size,
                                      size_t *needed);
/**
 * The points of target or board i.
 *
 * @param names      n x 3, or NULL: design, id, feature
 * @param xyz        n x 3, or NULL: in the world, metres; NaN where it is not placed
 * @param covariance n x 9, or NULL: 3 x 3 each, m²; NaN where it is not placed
 * @param n          at least as many as it has points
 */
LH_API lh_status lh_target_model_points(lh_context *ctx, const lh_target_model *model, size_t i, int32_t *names,
                                        double *xyz, double *covariance, size_t n);

typedef struct lh_solved_photo {
  size_t struct_size;
  int32_t camera;           /**< which of the capture's cameras */
  int32_t part;             /**< parts are joined by no target; 0: the placed one; -1: it has no pose */
  int32_t in_model;         /**< yes: the targets' model was made from it; no: placed by the model, then adjusted with all */
  double cam_from_part[12]; /**< 3 x 4, metres, where part >= 0; of part 0: cam_from_world */
} lh_solved_photo;

/** Photographs that were there when the capture was calibrated; 0 for NULL. */
LH_API size_t lh_target_model_photo_count(const lh_target_model *model);
LH_API lh_status lh_target_model_photo(lh_context *ctx, const lh_target_model *model, size_t i, lh_solved_photo *out);
LH_API lh_status lh_target_model_photo_name(lh_context *ctx, const lh_target_model *model, size_t i, char *buffer,
                                            size_t size, size_t *needed);
/** Why it makes the model, or need not, or has no pose. */
LH_API lh_status lh_target_model_photo_reason(lh_context *ctx, const lh_target_model *model, size_t i, char *buffer,
                                              size_t size, size_t *needed);

/** How well a photograph's pose is known. covariance: 6 x 6, of (rotation vector, translation) of a small motion applied
 *  after cam_from_world: rad, metres. covariance, points, rms_px: each may be NULL.
 *  @return LH_ENOTFOUND: the pose was not calibrated, or there is none */
LH_API lh_status lh_capture_pose_quality(lh_context *ctx, const lh_capture *capture, size_t shot, double covariance[36],
                                         size_t *points, double *rms_px);
/** covariance: 10 x 10, in the order of lh_lens_covariance. @return LH_ENOTFOUND: the camera was not refined */
LH_API lh_status lh_capture_camera_covariance(lh_context *ctx, const lh_capture *capture, size_t camera,
                                              double covariance[100]);

#ifdef __cplusplus
}
#endif

#endif
