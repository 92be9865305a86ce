#pragma once

// Boards that others photographed, and OpenCV's answers from them.

#include <lumihull/calib/lens_calibration.h>

#include <filesystem>
#include <vector>

namespace lumihull::test {

/// Zhang's five views of 256 corners: pixels and places as in his files (inches).
std::vector<calib::BoardView> zhang_views(const std::filesystem::path& folder);

/// Photographs of the 9 x 6 board whose names begin with `side` ("left"), in the order of their names.
std::vector<std::filesystem::path> chessboard_photos(const std::filesystem::path& folder, const std::string& side);

/// The same board's corners by OpenCV (findChessboardCorners, cornerSubPix) and by find_point_grid, in views whose
/// points correspond; photographs in which either finds none are left out. Places in fields.
struct ChessboardViews {
  std::vector<calib::BoardView> opencv, ours;
  int width = 0, height = 0;
};
ChessboardViews chessboard_views(const std::filesystem::path& folder, const std::string& side);

/// What cv::calibrateCamera makes of views: fx, fy, cx, cy, k1, k2, p1, p2 and, where free, k3.
struct OpenCvCalibration {
  double rms_px = 0, fx = 0, fy = 0, cx = 0, cy = 0;  ///< cx, cy with the first pixel's centre at 0.5
  double fx_sigma = 0, seconds = 0;
};
OpenCvCalibration opencv_calibration(std::span<const calib::BoardView> views, int width, int height, bool free_k3);

}  // namespace lumihull::test
