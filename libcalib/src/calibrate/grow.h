#pragma once

// How photographs and bodies get their first poses.

#include <functional>

#include "network.h"

namespace lumihull::calib::network {

/// Whether a sighting is met by a pose, roughly: its distance is below a share of its size as seen. Poses that
/// later adjustments have not seen yet are off by more than noise. Its distance over what counts as roughly met.
double rough_distance(const Network& network, const Sighting& sighting, const Pose& cam_from_body);
bool roughly_met(const Network& network, const Sighting& sighting, const Pose& cam_from_body);

/// Places photographs and bodies that have no pose yet as one more part, from the surest start on: two photographs
/// whose common bodies agree on how one lies to the other, or one photograph of one body. `adjust` is called whenever
/// the part has grown by a third. False where nothing more can be placed.
bool grow_part(Network& network, int part, Job& job, const std::function<void()>& adjust);

/// Goes on with a part that stands: photographs and bodies that are seen with it.
void grow_on(Network& network, int part, Job& job, const std::function<void()>& adjust);

/// A photograph's pose from bodies of a part; false where too little agrees.
bool place_photo(Network& network, int photo, int part);

/// A better pose of a body from those that already stand, over the sightings (of photographs with poses) for which
/// `use` is true: Gauss-Newton, robust.
Pose refined_body(const Network& network, int body, Pose world_from_body, const std::function<bool(int)>& use);

/// The pose that most of the given sightings of a body agree on, in the world of their photographs, and which they are;
/// not where a body stands that is seen more often.
struct BodyPlace {
  Pose world_from_body;
  std::vector<int> sightings;
};
std::optional<BodyPlace> agreed_place(const Network& network, const std::vector<int>& sightings);

/// Whether another body, seen more often than `sightings` times, stands there: two targets can't, so one was misread.
bool occupied(const Network& network, int body, const Pose& world_from_body, std::size_t sightings, int part);

}  // namespace lumihull::calib::network
