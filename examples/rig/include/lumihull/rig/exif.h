#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

namespace lumihull::rig {

/// What the virtual camera writes into its files.
struct ExifTags {
  std::string make = "Lumihull", model = "Virtual Rig", lens = "18 mm";
  std::string time;  ///< "YYYY:MM:DD hh:mm:ss"
  double focal_length_mm = 18;
  double sensor_width_mm = 22.7;
  int width = 0, height = 0;  ///< px
  double exposure_s = 0.125;
  double f_number = 11;
  int iso = 100;
  int orientation = 1;  ///< 1: upright; 3, 6, 8: as the camera was held
};

/// What a camera's sensor of gravity makes of how it is held: 1 (the picture's top is up), 6 (its left side is up), 8
/// (its right side), 3; 1 where it looks so steeply up or down that no side is up. up: in the camera's frame.
int exif_orientation(const Eigen::Vector3d& up);

/// A JPEG with an Exif 2.3 APP1 segment behind its start marker. Error{invalid_argument} where `jpeg` is none.
std::string with_exif(std::string_view jpeg, const ExifTags& tags);

}  // namespace lumihull::rig
