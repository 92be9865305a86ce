#include <lumihull/calib/lens_calibration.h>

#include <limits>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;
using calib::kIntrinsics;

namespace {

calib::LensCalibrationOptions options_from(const lh_lens_options* user, const lh_camera* start) {
  const lh_lens_options o = read_struct(user, "options");
  calib::LensCalibrationOptions options;
  constexpr uint32_t kKnown = (1u << kIntrinsics) - 1;
  if (o.free_parameters & ~(kKnown | LH_INTRINSIC_NONE))
    invalid("expected LH_INTRINSIC_… in free_parameters", "options");
  if (o.free_parameters)
    for (int i = 0; i < kIntrinsics; ++i) options.free[size_t(i)] = o.free_parameters >> i & 1u;
  options.robust = !o.keep_all;
  options.outlier_sigma = or_default(o.outlier_sigma, options.outlier_sigma);
  options.max_iterations = or_default(int(o.max_iterations), options.max_iterations);
  if (start) options.start = camera_from(start, "start");
  return options;
}

}  // namespace

lh_status lh_lens_calibrate(lh_context* ctx, size_t count, const size_t* counts, const double* pixels,
                            const double* points, const double* covariance, const double* radii, const double* normals,
                            int32_t width, int32_t height, const lh_camera* start, const lh_lens_options* user,
                            lh_lens** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    const calib::LensCalibrationOptions options = options_from(user, start);
    std::vector<size_t> first{0};
    for (const size_t n : array(counts, count, 1, "counts")) {
      if (n > size_t(1) << 32 || first.back() > size_t(1) << 40) invalid("expected fewer points", "counts");
      first.push_back(first.back() + n);
    }
    const size_t n = first.back();
    array(pixels, n, 2, "pixels");
    array(points, n, 3, "points");
    std::vector<calib::BoardView> views(count);
    for (size_t v = 0; v < count; ++v) {
      views[v].name = std::to_string(v);
      for (size_t i = first[v]; i < first[v + 1]; ++i) {
        calib::BoardMatch& m = views[v].matches.emplace_back();
        m.pixel = Eigen::Map<const Eigen::Vector2d>(pixels + 2 * i);
        m.board = Eigen::Map<const Eigen::Vector3d>(points + 3 * i);
        if (covariance) m.covariance = Eigen::Map<const Eigen::Matrix2d>(covariance + 4 * i);
        if (radii) m.radius = radii[i];
        if (normals) m.normal = Eigen::Map<const Eigen::Vector3d>(normals + 3 * i);
      }
    }
    calib::LensCalibration found = calib::calibrate_lens(views, width, height, options, job);
    give(out, std::move(found), std::move(first));
  });
}

void lh_lens_destroy(lh_lens* lens) { delete lens; }

lh_status lh_lens_camera(lh_context* ctx, const lh_lens* lens, lh_camera* camera) {
  return guarded(ctx, [&] { write_struct(camera, camera_to(given(lens, "lens").value.camera), "camera"); });
}

lh_status lh_lens_covariance(lh_context* ctx, const lh_lens* lens, double covariance[100]) {
  return guarded(ctx, [&] {
    const auto& c = given(lens, "lens").value.covariance;
    Eigen::Map<Eigen::Matrix<double, kIntrinsics, kIntrinsics>>(&given(covariance, "covariance")) = c;
  });
}

lh_status lh_lens_get_statistics(lh_context* ctx, const lh_lens* lens, lh_lens_statistics* statistics) {
  return guarded(ctx, [&] {
    const calib::LensCalibration& c = given(lens, "lens").value;
    lh_lens_statistics s{};
    s.rms_px = c.rms_px;
    s.sigma0 = c.sigma0;
    s.cross_validation_px = c.cross_validation_px;
    s.cross_validation_sigma = c.cross_validation_sigma;
    for (const auto& residual : c.residuals) ++(residual.outlier ? s.outliers : s.points);
    write_struct(statistics, s, "statistics");
  });
}

lh_status lh_lens_pose(lh_context* ctx, const lh_lens* lens, size_t view, double cam_from_body[12]) {
  return guarded(ctx, [&] {
    const auto& poses = given(lens, "lens").value.cam_from_board;
    given(cam_from_body, "cam_from_body");
    const auto& pose = poses[index(view, poses.size(), "view")];
    if (!pose) throw Error(ErrorCode::not_found, "this view was left out: it has no pose", "view");
    pose_to(*pose, cam_from_body);
  });
}

lh_status lh_lens_residuals(lh_context* ctx, const lh_lens* lens, double* errors, uint8_t* outlier, size_t rows) {
  return guarded(ctx, [&] {
    const lh_lens& l = given(lens, "lens");
    const size_t n = l.first.empty() ? 0 : l.first.back();
    const auto e = room(errors, rows, n, 2, "errors");
    const auto o = room(outlier, rows, n, 1, "outlier");
    std::fill(e.begin(), e.end(), std::numeric_limits<double>::quiet_NaN());
    std::fill(o.begin(), o.end(), uint8_t(1));
    for (const auto& r : l.value.residuals) {
      const size_t i = l.first[size_t(r.view)] + size_t(r.match);
      e[2 * i] = r.error.x();
      e[2 * i + 1] = r.error.y();
      o[i] = r.outlier;
    }
  });
}

size_t lh_lens_problem_count(const lh_lens* lens) { return lens ? lens->value.problems.size() : 0; }

lh_status lh_lens_problem(lh_context* ctx, const lh_lens* lens, size_t i, char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] {
    const auto& problems = given(lens, "lens").value.problems;
    give_text(problems[index(i, problems.size(), "index")], buffer, size, needed);
  });
}

lh_status lh_lens_uncertainty(lh_context* ctx, const lh_lens* lens, int32_t columns, int32_t rows, double* sigma_px) {
  return guarded(ctx, [&] {
    const calib::LensCalibration& c = given(lens, "lens").value;
    given(sigma_px, "sigma_px");
    const std::vector<double> sigma = calib::projection_uncertainty(c, columns, rows);
    std::copy(sigma.begin(), sigma.end(), sigma_px);
  });
}

lh_status lh_lens_save(lh_context* ctx, const lh_lens* lens, const char* file) {
  return guarded(ctx, [&] { calib::save_intrinsics(path(file, "file"), given(lens, "lens").value); });
}

lh_status lh_lens_load(lh_context* ctx, const char* file, lh_lens** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, calib::load_intrinsics(path(file, "file")), std::vector<size_t>{});
  });
}
