#include <lumihull/capture/robot.h>

namespace lumihull::capture {

Robot::~Robot() = default;
CameraDevice::~CameraDevice() = default;

}  // namespace lumihull::capture
