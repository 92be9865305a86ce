#pragma once

// What the opaque handles of lumihull.h are.

#include <lumihull/base/capture.h>
#include <lumihull/base/image.h>
#include <lumihull/calib/color_key.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/ink_key.h>
#include <lumihull/calib/lens_calibration.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/calib/target_set.h>
#include <lumihull/capture/mechanism_calibration.h>
#include <lumihull/capture/planner.h>
#include <lumihull/capture/robot.h>
#include <lumihull/capture/serial.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

struct lh_image {
  lumihull::Image value;
};

struct lh_color_key {
  lumihull::calib::ColorKey value;
};

struct lh_target_set {
  lumihull::calib::TargetSet value;
};

struct lh_mesh {
  lumihull::hull::Mesh value;
};

struct lh_ray_scene {
  lumihull::hull::RayScene value;
};

struct lh_capture {
  lumihull::Capture value;
};

struct lh_target_detector {
  lumihull::calib::TargetDetector value;
};

struct lh_detections {
  lumihull::calib::Detections value;
};

struct lh_lens {
  lumihull::calib::LensCalibration value;
  std::vector<std::size_t> first;  ///< of each view's points, and their number at the end
};

struct lh_target_model {
  lumihull::calib::TargetModel value;
};

struct lh_ink_samples {
  lumihull::calib::InkSamples value;
};

struct lh_mechanism {
  lumihull::capture::Mechanism value;
};

struct lh_mechanism_calibration {
  lumihull::capture::MechanismCalibration value;
};

struct lh_plan {
  lumihull::capture::PlannedTour value;
  lumihull::capture::PoseLimits limits;  ///< that it was made with
};

struct lh_serial_link {
  std::shared_ptr<lumihull::capture::SerialLink> value;
};

struct lh_robot {
  std::unique_ptr<lumihull::capture::Robot> device;  ///< none: by `word`
  std::string word;
};

struct lh_camera_device {
  std::unique_ptr<lumihull::capture::CameraDevice> device;  ///< none: by `word`
  std::string word;
};
