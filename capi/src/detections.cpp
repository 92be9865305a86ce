#include <lumihull/calib/detect_targets.h>

#include <algorithm>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;
using calib::Detection;
using calib::RefusedTarget;

static_assert(LH_REFUSED_NO_CODE == int(RefusedTarget::Reason::no_code) &&
              LH_REFUSED_HOMOGRAPHY == int(RefusedTarget::Reason::homography) &&
              LH_REFUSED_DUPLICATE == int(RefusedTarget::Reason::duplicate) &&
              LH_REFUSED_TOO_FEW_FEATURES == int(RefusedTarget::Reason::too_few_features) &&
              LH_REFUSED_UNKNOWN_ID == int(RefusedTarget::Reason::unknown_id) &&
              LH_REFUSED_OVEREXPOSED == int(RefusedTarget::Reason::overexposed));

namespace {

void store(const Eigen::Matrix3d& m, double* row_major) {
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row_major, 3, 3) = m;
}

const Detection& target(const lh_detections* detections, size_t i) {
  const auto& targets = given(detections, "detections").value.targets;
  return targets[index(i, targets.size(), "i")];
}

}  // namespace

lh_status lh_target_detector_create(lh_context* ctx, const lh_target_set* set, const lh_detect_options* user,
                                    lh_target_detector** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const lh_detect_options o = read_struct(user, "options");
    calib::DetectOptions options;
    if (o.ink_key) options.ink_key = o.ink_key->value;
    options.min_circle_px = or_default(o.min_circle_px, options.min_circle_px);
    options.correct = o.correct < 0 ? 0 : or_default(o.correct, options.correct);
    options.refine = !o.coarse;
    options.validate();
    give(out, calib::TargetDetector(given(set, "set").value, std::move(options)));
  });
}

void lh_target_detector_destroy(lh_target_detector* detector) { delete detector; }

lh_status lh_target_detector_detect(lh_context* ctx, const lh_target_detector* detector, const lh_image* photo,
                                    lh_detections** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    give(out, given(detector, "detector").value.detect(given(photo, "photo").value, job));
  });
}

void lh_detections_destroy(lh_detections* detections) { delete detections; }

size_t lh_detections_count(const lh_detections* detections) {
  return detections ? detections->value.targets.size() : 0;
}

lh_status lh_detections_get(lh_context* ctx, const lh_detections* detections, size_t i, lh_detection* out) {
  return guarded(ctx, [&] {
    const Detection& d = target(detections, i);
    lh_detection value{};
    value.design = d.design;
    value.id = d.id;
    value.features = d.features.size();
    value.corrected = d.corrected;
    value.erased = d.erased;
    store(d.pixel_from_target, value.pixel_from_target);
    value.rms_px = d.rms_px;
    write_struct(out, value, "out");
  });
}

lh_status lh_detections_features(lh_context* ctx, const lh_detections* detections, size_t i, int32_t* indices,
                                 double* pixel, double* covariance, double* dual_conic, size_t n) {
  return guarded(ctx, [&] {
    const auto& features = target(detections, i).features;
    if (n < features.size())
      invalid("expected room for " + std::to_string(features.size()) + " points, found " + std::to_string(n), "n");
    for (size_t k = 0; k < features.size(); ++k) {
      const calib::Feature& f = features[k];
      if (indices) indices[k] = f.index;
      if (pixel) pixel[2 * k] = f.pixel.x(), pixel[2 * k + 1] = f.pixel.y();
      if (covariance) {
        covariance[3 * k] = f.covariance(0, 0);
        covariance[3 * k + 1] = f.covariance(0, 1);
        covariance[3 * k + 2] = f.covariance(1, 1);
      }
      if (dual_conic) store(f.dual_conic, dual_conic + 9 * k);
    }
  });
}

size_t lh_detections_refused_count(const lh_detections* detections) {
  return detections ? detections->value.refused.size() : 0;
}

lh_status lh_detections_refused(lh_context* ctx, const lh_detections* detections, size_t i, lh_refused_target* out) {
  return guarded(ctx, [&] {
    const auto& refused = given(detections, "detections").value.refused;
    const RefusedTarget& r = refused[index(i, refused.size(), "i")];
    lh_refused_target value{};
    value.reason = int32_t(r.reason);
    value.id = r.id;
    value.pixel[0] = r.pixel.x(), value.pixel[1] = r.pixel.y();
    value.size_px = r.size_px;
    write_struct(out, value, "out");
  });
}

lh_status lh_detections_draw(lh_context* ctx, const lh_detections* detections, const lh_target_detector* detector,
                             const lh_image* photo, double magnify, lh_image** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, calib::draw_detections(given(photo, "photo").value, given(detector, "detector").value.set(),
                                     given(detections, "detections").value, or_default(magnify, 100.0)));
  });
}

lh_status lh_ink_samples_create(lh_context* ctx, lh_ink_samples** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out);
  });
}

void lh_ink_samples_destroy(lh_ink_samples* samples) { delete samples; }

lh_status lh_ink_samples_add(lh_context* ctx, lh_ink_samples* samples, const lh_image* photo,
                             const lh_target_detector* detector, const lh_detections* found) {
  return guarded(ctx, [&] {
    given(samples, "samples")
        .value.add(given(photo, "photo").value, given(detector, "detector").value.set(), given(found, "found").value);
  });
}

lh_status lh_ink_samples_train(lh_context* ctx, const lh_ink_samples* samples, int32_t k, lh_color_key** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    give(out, given(samples, "samples").value.train(or_default(int(k), 7), job));
  });
}
