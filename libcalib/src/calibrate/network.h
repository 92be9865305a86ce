#pragma once

// Photographs, bodies and who saw whom: what calibrate_targets works on.

#include <lumihull/base/job.h>
#include <lumihull/calib/calibrate.h>
#include <lumihull/calib/resect.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lumihull::calib::network {

/// One measured point of one body in one photograph.
struct Seen {
  int photo = 0, body = 0, point = 0, detection = 0;  ///< detection: index into the photograph's targets
  Eigen::Vector2d pixel{0, 0};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  double size_px = 0;
  bool counts = true;
};

/// All that one photograph shows of one body.
struct Sighting {
  int photo = 0, body = 0;
  std::vector<std::uint32_t> seen;  ///< indices into Network::seen
  /// Poses that explain it, the better one first: a small plane can be tilted either way.
  std::array<Pose, 2> cam_from_body;
  int poses = 0;
  bool sure = false;   ///< the second pose, if there is one, is refuted by this photograph alone
  double size_px = 0;  ///< of the body as seen: twice the RMS distance of its points from their mean
  bool counts = true;
};

/// The state of the work. Photographs and bodies have poses once they are placed, in the frame of their part.
struct Network {
  std::span<const PhotoTargets> photos;
  std::vector<Camera> cameras;
  std::vector<CalibratedBody> bodies;  ///< placed: body.world_from_body holds
  Eigen::Vector2d print_scale{1, 1};   ///< of all bodies' patterns
  std::vector<Seen> seen;
  std::vector<Sighting> sightings;
  std::vector<std::vector<int>> by_photo, by_body;  ///< indices into sightings
  std::vector<std::optional<Pose>> cam_from_world;  ///< of each photograph
  std::vector<int> photo_part, body_part;           ///< -1: not placed
  std::vector<Removed> removed;
  std::vector<bool> in_model;  ///< of each photograph: the model of the targets is made from it

  const Camera& camera_of(int photo) const { return cameras[std::size_t(photos[std::size_t(photo)].camera)]; }
  /// A seen point as resection takes it: in the body's frame, or (placed bodies) in the world.
  PointMatch match(const Seen& s, bool in_world) const;
  std::vector<PointMatch> matches(const Sighting& s, bool in_world) const;
};

/// Observations and sightings of everything that was found; mirrored photographs and targets on no board are left out
/// and named. Poses are not there yet.
Network make_network(const TargetSet& set, std::span<const PhotoTargets> photos);

/// The pose, or the two poses, of each sighting. Needs cameras.
void find_poses(Network& network, Job& job);

/// Focal length, px, at which the planes of a camera's photographs are seen as planes of undistorted pattern: minimum
/// of a robust cost over homographies (Zhang 2000: h1ᵀ ω h2 = 0, h1ᵀ ω h1 = h2ᵀ ω h2), principal point in the middle.
/// 0: no sighting says anything.
double focal_from_planes(const Network& network, int camera, int width, int height);

/// How far a pose puts a sighting's points from where they are seen, px: the median over all of them, whether they
/// count or not; infinite where one lies behind the camera or beyond the lens.
double distance_px(const Network& network, const Sighting& sighting, const Pose& cam_from_body);

/// "photograph 0012", "target matrix5x5 17"
std::string photo_text(const Network& network, int photo);
std::string body_text(const Network& network, int body);

/// Names something that is left out.
void remove_photo(Network& network, int photo, Removed::Why why, std::string text);

}  // namespace lumihull::calib::network
