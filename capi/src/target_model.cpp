#include <lumihull/calib/target_model.h>

#include <algorithm>
#include <limits>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

namespace {

const calib::CalibratedBody& body(const lh_target_model* model, size_t i) {
  const auto& bodies = given(model, "model").value.calibration.bodies;
  return bodies[index(i, bodies.size(), "i")];
}

size_t photo(const lh_target_model* model, size_t i) {
  return index(i, given(model, "model").value.photos.size(), "i");
}

}  // namespace

lh_status lh_target_model_open(lh_context* ctx, const lh_capture* capture, lh_target_model** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, calib::TargetModel::of(given(capture, "capture").value));
  });
}

void lh_target_model_destroy(lh_target_model* model) { delete model; }

lh_status lh_target_model_calibration(lh_context* ctx, const lh_target_model* model, lh_calibration* out) {
  return guarded(ctx, [&] {
    const calib::Calibration& c = given(model, "model").value.calibration;
    lh_calibration value{};
    value.photos = c.photos.size();
    value.photos_placed = size_t(std::count_if(c.photos.begin(), c.photos.end(),
                                               [](const auto& p) { return p.cam_from_world.has_value(); }));
    value.targets = c.bodies.size();
    value.targets_placed =
        size_t(std::count_if(c.bodies.begin(), c.bodies.end(), [](const auto& b) { return b.placed; }));
    value.removed = c.removed.size();
    value.rms_px = c.rms_px;
    value.share = c.share;
    value.sigma0 = c.sigma0;
    value.cross_validation_m = c.cross_validation_m;
    value.cross_validation_sigma = c.cross_validation_sigma;
    value.bend_m = c.bend_m;
    value.print_scale[0] = c.print_scale.x(), value.print_scale[1] = c.print_scale.y();
    value.parts = c.parts;
    write_struct(out, value, "calibration");
  });
}

lh_status lh_target_model_describe(lh_context* ctx, const lh_target_model* model, char* buffer, size_t size,
                                   size_t* needed) {
  return guarded(ctx,
                 [&] { give_text(calib::calibration_json(given(model, "model").value), buffer, size, needed); });
}

size_t lh_target_model_count(const lh_target_model* model) {
  return model ? model->value.calibration.bodies.size() : 0;
}

lh_status lh_target_model_get(lh_context* ctx, const lh_target_model* model, size_t i, lh_solved_target* out) {
  return guarded(ctx, [&] {
    const calib::CalibratedBody& b = body(model, i);
    lh_solved_target value{};
    value.board = b.board;
    value.design = b.design;
    value.id = b.id;
    value.placed = b.placed;
    value.points = b.body.points.size();
    value.photos = b.photos;
    value.rms_px = b.rms_px;
    pose_to(b.body.world_from_body, value.world_from_body);
    value.part = b.part;
    if (b.part_from_body) pose_to(*b.part_from_body, value.part_from_body);
    write_struct(out, value, "out");
  });
}

lh_status lh_target_model_name(lh_context* ctx, const lh_target_model* model, size_t i, char* buffer, size_t size,
                               size_t* needed) {
  return guarded(ctx, [&] { give_text(body(model, i).name, buffer, size, needed); });
}

lh_status lh_target_model_points(lh_context* ctx, const lh_target_model* model, size_t i, int32_t* names, double* xyz,
                                 double* covariance, size_t n) {
  return guarded(ctx, [&] {
    const calib::CalibratedBody& b = body(model, i);
    const size_t count = b.body.points.size();
    if (n < count)
      invalid("expected room for " + std::to_string(count) + " points, found " + std::to_string(n), "n");
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    for (size_t k = 0; k < count; ++k) {
      if (names) {
        names[3 * k] = b.features[k].design;
        names[3 * k + 1] = b.features[k].id;
        names[3 * k + 2] = b.features[k].feature;
      }
      for (int r = 0; xyz && r < 3; ++r) xyz[3 * k + size_t(r)] = b.placed ? b.points[k](r) : kNaN;
      for (int r = 0; covariance && r < 9; ++r)
        covariance[9 * k + size_t(r)] = b.placed ? b.point_covariances[k](r / 3, r % 3) : kNaN;
    }
  });
}

size_t lh_target_model_photo_count(const lh_target_model* model) { return model ? model->value.photos.size() : 0; }

lh_status lh_target_model_photo(lh_context* ctx, const lh_target_model* model, size_t i, lh_solved_photo* out) {
  return guarded(ctx, [&] {
    const size_t k = photo(model, i);
    const calib::CalibratedPhoto& p = model->value.calibration.photos.at(k);
    lh_solved_photo value{};
    value.camera = model->value.photos[k].camera;
    value.part = p.part;
    value.in_model = p.in_model;
    if (p.cam_from_part) pose_to(*p.cam_from_part, value.cam_from_part);
    write_struct(out, value, "out");
  });
}

lh_status lh_target_model_photo_name(lh_context* ctx, const lh_target_model* model, size_t i, char* buffer, size_t size,
                                     size_t* needed) {
  return guarded(ctx, [&] { give_text(model->value.photos[photo(model, i)].name, buffer, size, needed); });
}

lh_status lh_target_model_photo_reason(lh_context* ctx, const lh_target_model* model, size_t i, char* buffer,
                                       size_t size, size_t* needed) {
  return guarded(
      ctx, [&] { give_text(model->value.calibration.photos.at(photo(model, i)).reason, buffer, size, needed); });
}

lh_status lh_capture_pose_quality(lh_context* ctx, const lh_capture* capture, size_t shot, double covariance[36],
                                  size_t* points, double* rms_px) {
  return guarded(ctx, [&] {
    const auto& shots = given(capture, "capture").value.shots;
    const Shot& s = shots[index(shot, shots.size(), "shot")];
    if (!s.pose_quality)
      throw Error(ErrorCode::not_found, "this photograph's pose does not come from the stage \"calibrate\"", s.name);
    if (covariance)
      for (int k = 0; k < 36; ++k) covariance[k] = s.pose_quality->covariance(k / 6, k % 6);
    if (points) *points = size_t(s.pose_quality->points);
    if (rms_px) *rms_px = s.pose_quality->rms_px;
  });
}

lh_status lh_capture_camera_covariance(lh_context* ctx, const lh_capture* capture, size_t camera,
                                       double covariance[100]) {
  return guarded(ctx, [&] {
    const Capture& c = given(capture, "capture").value;
    given(covariance, "covariance");
    const auto at = c.camera_covariances.find(int(index(camera, c.cameras.size(), "camera")));
    if (at == c.camera_covariances.end())
      throw Error(ErrorCode::not_found, "this camera was not refined by the stage \"calibrate\"",
                  std::to_string(camera));
    for (int k = 0; k < 100; ++k) covariance[k] = at->second(k / 10, k % 10);
  });
}
