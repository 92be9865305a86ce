// The one file that finds point grids with OpenCV.
#include "grid_start.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace lumihull::calib::lens {
namespace {

/// Detectors take seconds on large pictures, and a start needs no more resolution than this.
constexpr int kLargestSide = 1600;

bool find_circles(const cv::Mat& picture, cv::Size size, std::vector<cv::Point2f>& found) {
  cv::SimpleBlobDetector::Params params;
  params.minArea = 12;
  params.maxArea = float(picture.total()) / 16;
  params.minDistBetweenBlobs = 3;
  params.minThreshold = 10;
  params.maxThreshold = 245;
  const auto blobs = cv::SimpleBlobDetector::create(params);
  return cv::findCirclesGrid(picture, size, found, cv::CALIB_CB_SYMMETRIC_GRID, blobs) ||
         cv::findCirclesGrid(picture, size, found, cv::CALIB_CB_SYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING, blobs);
}

}  // namespace

std::vector<Eigen::Vector2d> grid_start(const Image& photo, const PointGrid& grid) try {
  cv::Mat picture(photo.height(), photo.width(), CV_8UC1, const_cast<std::byte*>(photo.data()), photo.row_bytes());
  const int side = std::max(photo.width(), photo.height());
  const double scale = std::max(1.0, double(side) / kLargestSide);
  cv::Mat small = picture;
  if (scale > 1)
    cv::resize(picture, small, {std::max(1, int(photo.width() / scale)), std::max(1, int(photo.height() / scale))}, 0,
               0, cv::INTER_AREA);
  const double scale_x = double(photo.width()) / small.cols, scale_y = double(photo.height()) / small.rows;

  const cv::Size size(grid.columns, grid.rows);
  std::vector<cv::Point2f> found;
  bool good = false;
  if (grid.kind == PointGrid::Kind::circles) {
    good = find_circles(small, size, found);
  } else {
    good =
        cv::findChessboardCornersSB(small, size, found, cv::CALIB_CB_NORMALIZE_IMAGE) ||
        cv::findChessboardCorners(
            small, size, found, cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK);
  }
  std::vector<Eigen::Vector2d> points;
  if (!good || found.size() != std::size_t(grid.columns) * std::size_t(grid.rows)) return points;
  for (const cv::Point2f& p : found) points.emplace_back((p.x + 0.5) * scale_x, (p.y + 0.5) * scale_y);
  return points;
} catch (const cv::Exception&) {
  return {};  // pictures that are too small for its windows
}

}  // namespace lumihull::calib::lens
