// One camera as text for OpenCV and COLMAP.

#include <lumihull/base/error.h>
#include <lumihull/base/export.h>

#include <cstdio>

#include "colmap_model.h"
#include "lens_models.h"

namespace lumihull {

namespace {

std::string matrix(const char* name, int rows, int columns, std::initializer_list<double> values) {
  std::string text = std::string(name) + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
                     "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data: [";
  const char* separator = " ";
  for (const double value : values) {
    char number[40];
    std::snprintf(number, sizeof number, "%s%.16e", separator, value);
    text += number;
    separator = ",\n      ";
  }
  return text + " ]\n";
}

}  // namespace

CameraText opencv_camera(const Camera& camera, const ExportOptions& options) {
  const internal::ForwardRefit refit = internal::simplest_refit(camera, {3, 6}, options.max_refit_error_px, "camera");
  const internal::ForwardCamera& c = refit.camera;
  std::string text =
      "%YAML:1.0\n---\nimage_width: " + std::to_string(c.width) + "\nimage_height: " + std::to_string(c.height) + "\n";
  text += matrix("camera_matrix", 3, 3, {c.fx, 0, c.cx - 0.5, 0, c.fy, c.cy - 0.5, 0, 0, 1});
  if (c.k[3] != 0 || c.k[4] != 0 || c.k[5] != 0)
    text += matrix("distortion_coefficients", 8, 1, {c.k[0], c.k[1], c.p1, c.p2, c.k[2], c.k[3], c.k[4], c.k[5]});
  else
    text += matrix("distortion_coefficients", 5, 1, {c.k[0], c.k[1], c.p1, c.p2, c.k[2]});
  return {text, refit.largest_error_px};
}

CameraText colmap_camera(const Camera& camera, const ExportOptions& options) {
  const internal::ForwardRefit refit = internal::simplest_refit(camera, {2, 6}, options.max_refit_error_px, "camera");
  internal::ColmapModel model;
  model.cameras[1] = refit.camera;
  return {internal::print_colmap_cameras(model), refit.largest_error_px};
}

}  // namespace lumihull
