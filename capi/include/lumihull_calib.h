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

#ifdef __cplusplus
}
#endif

#endif
