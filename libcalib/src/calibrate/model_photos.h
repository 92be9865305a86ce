#pragma once

#include <string>
#include <vector>

#include "network.h"

namespace lumihull::calib::network {

/// Which photographs make the model of the targets, and why each of them does, or need not.
struct ModelPhotos {
  std::vector<bool> use;
  std::vector<std::string> reason;
};

/// At most `most` photographs of a part (0: all of them), chosen greedily: each new view of a body counts by how many
/// views from about the same side it already has, and each part of a camera's picture by how many points it has.
ModelPhotos choose_model_photos(const Network& network, int most);

}  // namespace lumihull::calib::network
