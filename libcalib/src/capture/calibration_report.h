#pragma once

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/target_model.h>

#include <string>

namespace lumihull::calib {

/// A self-contained page on a calibration. capture: whose photographs it is of; its own cameras and poses are not used.
/// Errors: those of Capture::read_photo; cancelled.
std::string calibration_report_html(const Capture& capture, const TargetModel& model, Job& job);

}  // namespace lumihull::calib
