// A calibrated camera on disk: JSON.
#include <lumihull/calib/lens_calibration.h>
#include <lumihull/internal/camera_json.h>
#include <lumihull/internal/json.h>
#include <lumihull/internal/small_matrices.h>

namespace lumihull::calib {
namespace {

using lumihull::internal::Json;
using lumihull::internal::JsonReader;

constexpr const char* kFormat = "lumihull-intrinsics";
constexpr std::int64_t kVersion = 1;
constexpr std::size_t kMaxBytes = std::size_t(16) << 20;

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace

std::string intrinsics_json(const LensCalibration& calibration) {
  Json names = Json::array(), covariance = Json::array(), deviations = Json::object();
  for (int i = 0; i < kIntrinsics; ++i) {
    names.push_back(intrinsic_names()[std::size_t(i)]);
    Json row = Json::array();
    for (int k = 0; k < kIntrinsics; ++k) row.push_back(calibration.covariance(i, k));
    covariance.push_back(std::move(row));
    if (calibration.covariance(i, i) > 0)
      deviations[intrinsic_names()[std::size_t(i)]] = std::sqrt(calibration.covariance(i, i));
  }
  std::size_t points = 0, outliers = 0, views = 0;
  for (const auto& residual : calibration.residuals) ++(residual.outlier ? outliers : points);
  for (const auto& pose : calibration.cam_from_board) views += pose.has_value();
  Json top{{"format", kFormat},
           {"version", kVersion},
           {"camera", lumihull::internal::print_camera(calibration.camera)},
           {"standard_deviations", std::move(deviations)},
           {"parameters", std::move(names)},
           {"covariance", std::move(covariance)},
           {"measured",
            {{"views", views},
             {"points", points},
             {"outliers", outliers},
             {"rms_px", finite(calibration.rms_px)},
             {"sigma0", finite(calibration.sigma0)},
             {"cross_validation_px", finite(calibration.cross_validation_px)},
             {"cross_validation_sigma", finite(calibration.cross_validation_sigma)}}},
           {"problems", calibration.problems}};
  return lumihull::internal::print_json(top, "intrinsics");
}

void save_intrinsics(const std::filesystem::path& file, const LensCalibration& calibration) {
  write_file(file, intrinsics_json(calibration));
}

LensCalibration load_intrinsics(const std::filesystem::path& file) {
  const Json json = lumihull::internal::read_json(file, kMaxBytes);
  const JsonReader top(json, file.string());
  lumihull::internal::check_format(top, kFormat, kVersion);
  LensCalibration calibration;
  calibration.camera = lumihull::internal::read_camera(top.at("camera"), true);
  const JsonReader names = top.at("parameters");
  for (std::size_t i = 0; i < std::size_t(kIntrinsics); ++i)
    if (names.at(i).string(16) != intrinsic_names()[i]) names.at(i).fail("\"" + intrinsic_names()[i] + "\"");
  if (names.array_size(kIntrinsics) != std::size_t(kIntrinsics)) names.fail("10 names");
  const JsonReader rows = top.at("covariance");
  if (rows.array_size(kIntrinsics) != std::size_t(kIntrinsics)) rows.fail("10 rows");
  auto& c = calibration.covariance;
  for (int i = 0; i < kIntrinsics; ++i) {
    const JsonReader row = rows.at(std::size_t(i));
    if (row.array_size(kIntrinsics) != std::size_t(kIntrinsics)) row.fail("10 numbers");
    for (int k = 0; k < kIntrinsics; ++k) c(i, k) = row.at(std::size_t(k)).number(-1e30, 1e30);
    if (!(c(i, i) >= 0)) row.at(std::size_t(i)).fail("a variance of at least 0");
  }
  if (!(c - c.transpose()).isMuchSmallerThan(c.cwiseAbs().maxCoeff() + 1e-300, 1e-9)) rows.fail("a symmetric matrix");
  if (!internal::is_covariance(c)) rows.fail("a covariance (no negative eigenvalue)");
  for (int i = 0; i < kIntrinsics; ++i)
    if (!(c(i, i) > 0) && !c.row(i).isZero(0)) rows.at(std::size_t(i)).fail("zeros where the variance is 0");
  return calibration;
}

}  // namespace lumihull::calib
