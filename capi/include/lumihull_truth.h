/**
 * Lumihull's C interface: a capture beside what is known to be true about it. A part of lumihull.h, whose rules hold
 * here, too; include that.
 */
#ifndef LUMIHULL_TRUTH_H
#define LUMIHULL_TRUTH_H

#include <lumihull.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A capture beside the truth about it. */
typedef struct lh_truth_comparison lh_truth_comparison;

/**
 * Compares what a capture holds with a folder of truth as the virtual rig writes it: poses after alignment (and how far
 * their covariances hold), lenses, targets, masks, the hull's surface, new views and the way of highlights. What either
 * side does not have is left out and named. The stage "evaluate" does the same where its option "truth" is set.
 *
 * @param truth cameras.json, targets.json, masks/NAME.png, mesh.ply, test_views.json, test_views/
 * @return LH_ENOTFOUND: no such folder, or nothing of these in it; LH_EINPUT: a damaged file, or one that contradicts the
 *         capture (sizes, names)
 */
LH_API lh_status lh_truth_compare(lh_context *ctx, const lh_capture *capture, const char *truth,
                                  lh_truth_comparison **out);
LH_API void lh_truth_comparison_destroy(lh_truth_comparison *comparison);
/** All of it as one JSON object: "left_out", and of what could be compared "poses", "lenses", "targets", "masks", "surface",
 *  "test_views"; lengths in mm and px as the names say. */
LH_API lh_status lh_truth_comparison_describe(lh_context *ctx, const lh_truth_comparison *comparison, char *buffer,
                                              size_t size, size_t *needed);
/** A page with plots and the worst cases' pictures; capture: the one that was compared. */
LH_API lh_status lh_truth_comparison_page(lh_context *ctx, const lh_truth_comparison *comparison,
                                          const lh_capture *capture, const char *file);

#ifdef __cplusplus
}
#endif

#endif
