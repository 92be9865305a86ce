#pragma once

// All that an adjustment can be made of, one kind of scene each.

#include <vector>

#include "scenes.h"

namespace lumihull::test {

struct Kind {
  const char* name;
  SceneMaker maker;
};

inline std::vector<Kind> kinds() {
  using calib::BodyModel;
  const Eigen::Vector2d print(1.004, 0.998);
  return {
      {"rigid", {}},
      {"free", {.model = BodyModel::free}},
      {"bending", {.model = BodyModel::bending, .bend = 0.3}},
      {"rig", {.cameras = 2}},
      {"print", {.print_scale = print, .bars = 2}},
      {"free with bars", {.model = BodyModel::free, .bars = 2}},
      {"free on a rig", {.model = BodyModel::free, .cameras = 2}},
      {"circles", {.radius = 0.009}},
      {"free circles", {.radius = 0.009, .model = BodyModel::free}},
      {"circles, bent, print",
       {.radius = 0.009, .model = BodyModel::bending, .bend = 0.3, .print_scale = print, .bars = 2}},
      {"more bodies than shots", {.shots = 5, .bodies = 14}},
      {"print, more bodies than shots", {.shots = 4, .bodies = 9, .print_scale = print, .bars = 2}},
      {"free, many shots", {.shots = 40, .bodies = 6, .model = BodyModel::free, .seen = 0.7}},
  };
}

}  // namespace lumihull::test
