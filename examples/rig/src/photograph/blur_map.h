#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/rig/photographer.h>

#include <cstdint>
#include <vector>

#include "light/lit_scene.h"
#include "shutter.h"

namespace lumihull::rig {

/// How many rays the pixels of a blurred picture need, from a first look along one sharp ray each: `edge_rays` where
/// the blur reaches from an outline, more than `rays` on objects that are blurred by many pixels, else `rays`.
class BlurMap {
 public:
  struct Pixel {
    int side = 1;  ///< side x side rays
    bool plain_room =
        false;  ///< the room there is much coarser than its blur: one look at the middle of all rays will do
    bool operator==(const Pixel&) const = default;
  };

  BlurMap(const LitScene& scene, const View& view, const PhotoOptions& options, const Shutter& shutter, Job& job);
  Pixel at(int x, int y) const { return pixels_[std::size_t(y) * std::size_t(width_) + std::size_t(x)]; }

 private:
  int width_;
  std::vector<Pixel> pixels_;
};

}  // namespace lumihull::rig
