#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace lumihull::capture {

/// Lens and sensor, as their makers give them. The default is a 6.3 megapixel camera of the paper's kind.
struct Optics {
  double focal_length_mm = 18;
  double sensor_width_mm = 22.7, sensor_height_mm = 15.1;
  int width_px = 3072, height_px = 2048;
  double f_number = 16;
  double circle_of_confusion_mm = 0.015;  ///< blur that still counts as sharp; about two pixels of that sensor
};

/// Error{invalid_argument} naming the first value that is not positive, not finite or beyond what is built.
LUMIHULL_API void check(const Optics& optics);

/// An upright cylinder about the centre of the views that holds the object; a sphere where height_m is 0.
struct LUMIHULL_API ObjectSize {
  double diameter_m = 0;
  double height_m = 0;

  double bounding_radius_m() const;  ///< of the sphere about the centre that holds it
};
LUMIHULL_API void check(const ObjectSize& object);

/// Which side of the picture lies in the meridian plane, i.e. upright where the view is from the side.
enum class Orientation : std::uint8_t { landscape, portrait };

/// Distance from the lens to the image, mm, when it is focused at a distance: v = f D / (D - f) (thin lens).
/// Error{invalid_argument} where the distance is not beyond the focal length.
LUMIHULL_API double image_distance_mm(const Optics& optics, double focus_m);

/// The camera without distortion that such a lens makes when focused at a distance.
LUMIHULL_API Camera ideal_camera(const Optics& optics, double focus_m);

/// Points whose projections enclose the object's as seen from `eye` (world, m, outside): of a sphere the contour of its
/// tangent cone, of a cylinder its two rims. The ring is sampled `samples` times; between samples it lies outside of
/// the polygon by the factor 1 / cos(pi / samples), which is added to the radius. Empty where `eye` is inside.
LUMIHULL_API std::vector<Eigen::Vector3d> object_outline(const ObjectSize& object, const Eigen::Vector3d& center,
                                                         const Eigen::Vector3d& eye, int samples = 48);

/// Where the object lies in the picture.
struct Framing {
  bool whole = false;          ///< all of it is in front of the camera and inside the picture
  double least_margin_px = 0;  ///< between its outline and the border; negative: cut off; -infinity: not projectable
  double fill = 0;             ///< its larger extent relative to the picture's in that direction
};
LUMIHULL_API Framing framing(const View& view, const ObjectSize& object, const Eigen::Vector3d& center);

/// The smallest radius of a hemisphere, m, from all of which the object fills the picture up to `margin` (share of the
/// picture's size left free on each side, 0 … 0.45). The cameras look at the centre, but for an error of pointing
/// along the meridian of at most `pointing_error_rad` (0 … 60 degrees) to both sides.
/// Error{degenerate} where no radius up to 1 km does.
LUMIHULL_API double fill_radius(const Optics& optics, const ObjectSize& object, Orientation orientation,
                                double margin = 0.05, double pointing_error_rad = 0);

/// How sharp and how fine a picture is at a distance.
struct Sharpness {
  double pixels_per_mm = 0;      ///< at the object's centre, across the line of sight
  double near_m = 0, far_m = 0;  ///< the depth of field, from the lens; far may be infinite
  double hyperfocal_m = 0;
  double field_horizontal_rad = 0, field_vertical_rad = 0;  ///< of the picture in landscape
  double largest_speed_m_s = 0;  ///< across the line of sight, for a blur within the allowance
  double largest_turn_rad_s = 0;
};

/// Thin-lens depth of field: H = f² / (N c) + f, near = D (H - f) / (H + D - 2 f), far = D (H - f) / (H - D).
/// blur_px: what the motion may smear during the exposure.
LUMIHULL_API Sharpness sharpness(const Optics& optics, double distance_m, double exposure_s, double blur_px = 0.5);

/// Step between neighbouring views, rad, so that they share `overlap` (0 … 0.99) of the arc of surface that a view
/// shows. A view of a ball of radius R from the distance r shows normals up to acos(R / r) off the line of sight, and
/// up to `usable_rad` of it are of use; neighbours a step apart share 1 - step / (2 min(usable, acos(R / r))).
LUMIHULL_API double step_for_overlap(double overlap, double object_radius_m, double distance_m,
                                     double usable_rad = 1.0471975511965976);

/// What an operator should know before photographing: depth of field smaller than the object, blur too large at the
/// resolution wanted, a camera inside of the object. Empty where all is well.
LUMIHULL_API std::vector<std::string> optics_warnings(const Optics& optics, const ObjectSize& object, double distance_m,
                                                      double exposure_s);

}  // namespace lumihull::capture
