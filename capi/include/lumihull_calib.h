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

#ifdef __cplusplus
}
#endif

#endif
