#include "real_boards.h"

#include <lumihull/base/image.h>
#include <lumihull/calib/board_views.h>
#include <lumihull/calib/point_grids.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace lumihull::test {

std::vector<calib::BoardView> zhang_views(const std::filesystem::path& folder) {
  const auto pairs_of = [](const std::filesystem::path& file) {
    std::ifstream in(file);
    std::vector<Eigen::Vector2d> pairs;
    for (double x, y; in >> x >> y;) pairs.emplace_back(x, y);
    return pairs;
  };
  const auto places = pairs_of(folder / "text/Model.txt");
  std::vector<calib::BoardView> views;
  for (int i = 1; i <= 5; ++i) {
    const auto pixels = pairs_of(folder / ("text/data" + std::to_string(i) + ".txt"));
    calib::BoardView view;
    view.name = "data" + std::to_string(i);
    for (std::size_t k = 0; k < std::min(places.size(), pixels.size()); ++k) {
      calib::BoardMatch match;
      match.pixel = pixels[k];
      match.board = {places[k].x(), places[k].y(), 0};
      view.matches.push_back(match);
    }
    views.push_back(std::move(view));
  }
  return views;
}

std::vector<std::filesystem::path> chessboard_photos(const std::filesystem::path& folder, const std::string& side) {
  std::vector<std::filesystem::path> photos;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().filename().string().starts_with(side)) photos.push_back(entry.path());
  std::sort(photos.begin(), photos.end());
  return photos;
}

ChessboardViews chessboard_views(const std::filesystem::path& folder, const std::string& side) {
  ChessboardViews views;
  const calib::PointGrid grid{.columns = 9, .rows = 6, .spacing_m = 1};
  for (const auto& file : chessboard_photos(folder, side)) {
    const Image photo = read_image(file, {.channels = 1});
    views.width = photo.width(), views.height = photo.height();
    Job job;
    const auto found = calib::find_point_grid(photo, grid, job);
    const cv::Mat picture(photo.height(), photo.width(), CV_8UC1, const_cast<std::byte*>(photo.data()));
    std::vector<cv::Point2f> corners;
    if (!found || found->features.size() != 54 || !cv::findChessboardCorners(picture, {9, 6}, corners)) continue;
    cv::cornerSubPix(picture, corners, {11, 11}, {-1, -1},
                     {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 1e-4});
    const auto at = [&](std::size_t i) { return Eigen::Vector2d(corners[i].x + 0.5, corners[i].y + 0.5); };
    if ((at(0) - found->features[0].pixel).norm() > (at(53) - found->features[0].pixel).norm())
      std::reverse(corners.begin(), corners.end());
    views.ours.push_back(calib::grid_view(grid, *found, file.filename().string()));
    views.opencv.push_back(views.ours.back());
    for (std::size_t i = 0; i < 54; ++i) {
      views.opencv.back().matches[i].pixel = at(i);
      views.opencv.back().matches[i].covariance.setIdentity();
    }
  }
  return views;
}

OpenCvCalibration opencv_calibration(std::span<const calib::BoardView> views, int width, int height, bool free_k3) {
  std::vector<std::vector<cv::Point3f>> places;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const calib::BoardView& view : views) {
    places.emplace_back();
    pixels.emplace_back();
    for (const calib::BoardMatch& m : view.matches) {
      places.back().emplace_back(float(m.board.x()), float(m.board.y()), float(m.board.z()));
      pixels.back().emplace_back(float(m.pixel.x() - 0.5), float(m.pixel.y() - 0.5));
    }
  }
  cv::Mat k, lens, sigmas, ignored, errors;
  std::vector<cv::Mat> rotations, translations;
  const auto start = std::chrono::steady_clock::now();
  OpenCvCalibration result;
  result.rms_px = cv::calibrateCamera(places, pixels, {width, height}, k, lens, rotations, translations, sigmas,
                                      ignored, errors, free_k3 ? 0 : cv::CALIB_FIX_K3,
                                      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-12});
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.fx = k.at<double>(0, 0), result.fy = k.at<double>(1, 1);
  result.cx = k.at<double>(0, 2) + 0.5, result.cy = k.at<double>(1, 2) + 0.5;
  result.fx_sigma = sigmas.at<double>(0);
  return result;
}

}  // namespace lumihull::test
