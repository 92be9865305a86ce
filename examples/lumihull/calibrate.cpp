// lumihull calibrate CAPTURE --targets WORD|FILE: a pose for every photograph, cameras, and where the targets are.

#include <lumihull/calib/target_model.h>

#include <filesystem>

#include "program.h"

namespace lumihull::program {

void add_calibrate(Program& program) {
  add_stage_verb(program, "calibrate", "find a pose for every photograph, from printed targets in them",
                 [](const Capture& capture) {
                   // Poses from features leave no model of targets.
                   return std::filesystem::exists(calib::target_model_path(capture))
                              ? calib::calibration_json(calib::TargetModel::of(capture))
                              : slf::describe_json(capture) + "\n";
                 });
}

}  // namespace lumihull::program
