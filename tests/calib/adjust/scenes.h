#pragma once

// Photographs of targets, made up: what they show, where they were taken, and a start that is off. Deterministic for a
// seed.

#include <lumihull/calib/adjustment.h>

#include <cstdint>

namespace lumihull::test {

/// Cameras on a hemisphere, 0.8 to 2.7 m from targets of `side` x `side` points that lie, tilted, on a ring of 1 m.
struct SceneMaker {
  int shots = 12, bodies = 6;
  int side = 5;          ///< points along a target's side
  double pitch = 0.024;  ///< between them, m
  double radius = 0;     ///< of circles, m; 0: points
  double ring = 0.5;     ///< radius of the ring, m
  calib::BodyModel model = calib::BodyModel::rigid;
  double noise = 0.05;    ///< px; covariances vary about noise² and are correlated
  double seen = 1;        ///< share of (photograph, target) that is there
  bool inside = false;    ///< only what is inside of the picture
  int cameras = 1;        ///< 2: a second one on the rig, 0.2 m to the right, turned in by 0.1 rad, same lens model
  bool free_lens = true;  ///< f, u0, v0, k1, k2, p1, p2; else known
  double bend = 0;        ///< standard deviation of a, b, c, 1/m
  Eigen::Vector2d print_scale{1, 1};  ///< the start has (1, 1)
  int bars = 0;                       ///< between first points of targets 0 and 1, 2 and 3, …; 1e-5 m
  double off = 1;  ///< how far the start is off: 1: 5 mrad, 5 mm, 1 % of f, lens without distortion; 0: the truth
};

struct Scene {
  calib::Adjustment truth;  ///< with exact observations' pixels replaced by the noisy ones of `start`
  calib::Adjustment start;
};

Scene make_scene(const SceneMaker& maker, std::uint64_t seed);

/// The camera of these scenes: 9 megapixels, moderate distortion.
Camera scene_camera();

/// Where an observation is predicted: by the public functions of camera and circles alone. Not a number where nowhere.
Eigen::Vector2d predicted_pixel(const calib::Adjustment& state, const calib::Observation& observation);

/// sqrt(mean |difference|²) of all points in the world, m; `best`: after the similarity that fits best.
double point_rms(const calib::Adjustment& a, const calib::Adjustment& b, bool best);

}  // namespace lumihull::test
