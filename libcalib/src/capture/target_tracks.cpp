// A calibration's observations as tracks of points.
#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/detect_capture.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/calib/target_tracks.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <system_error>

namespace lumihull::calib {
namespace {

struct Place {
  std::size_t body = 0, point = 0, track = 0;
};

/// Observations and detections that calibration left out, by photograph.
class LeftOut {
 public:
  explicit LeftOut(const TargetModel& model) : by_photo_(model.photos.size()) {
    for (const Removed& r : model.calibration.removed)
      if (r.kind == Removed::Kind::observation || r.kind == Removed::Kind::detection)
        by_photo_.at(std::size_t(r.photo)).push_back(&r);
  }
  bool has(std::size_t photo, int body, const Detection& target, int feature) const {
    const auto names = [&](const Removed* r) {
      return (r->body < 0 || r->body == body) && (r->design < 0 || r->design == target.design) &&
             (r->id < 0 || r->id == target.id) && (r->feature < 0 || r->feature == feature);
    };
    return std::any_of(by_photo_[photo].begin(), by_photo_[photo].end(), names);
  }

 private:
  std::vector<std::vector<const Removed*>> by_photo_;
};

/// Where the circle's centre is seen, from where its ellipse's centre was measured.
std::optional<Eigen::Vector2d> pixel_of_center(const View& view, const CalibratedBody& body, std::size_t point,
                                               const Eigen::Vector2d& measured) {
  const BodyPoint& printed = body.body.points[point];
  if (!(printed.radius > 0)) return measured;
  Circle3 circle;
  circle.center = view.cam_from_world * body.points[point];
  const Eigen::Vector3d normal = view.cam_from_world.rotation * (body.body.world_from_body.rotation * printed.normal);
  circle.u = normal.unitOrthogonal();
  circle.v = normal.cross(circle.u);
  circle.radius = printed.radius;
  const auto ellipse = projected_circle_center(view.camera, circle), center = view.camera.project(circle.center);
  if (!ellipse || !center) return std::nullopt;
  return measured + *center - *ellipse;
}

}  // namespace

std::vector<Track> target_tracks(const Capture& capture) {
  std::error_code ignored;
  if (!std::filesystem::exists(target_model_path(capture), ignored)) return {};
  const TargetModel model = TargetModel::of(capture);
  const Calibration& c = model.calibration;
  std::vector<Track> tracks;
  std::map<std::array<int, 3>, std::vector<Place>> places;  // by design, id, feature; two where a target was moved
  for (std::size_t b = 0; b < c.bodies.size(); ++b) {
    const CalibratedBody& body = c.bodies[b];
    if (!body.placed) continue;
    for (std::size_t k = 0; k < body.points.size(); ++k) {
      const auto& name = body.features[k];
      places[{name.design, name.id, name.feature}].push_back({b, k, tracks.size()});
      tracks.push_back({body.points[k], {}});
    }
  }
  const LeftOut left_out(model);
  std::map<std::string_view, std::size_t> photo_of;
  for (std::size_t i = 0; i < model.photos.size(); ++i) photo_of[model.photos[i].name] = i;
  const CaptureDetections seen = kept_detections(capture, model.set);
  for (std::size_t shot = 0; shot < capture.shots.size(); ++shot) {
    const auto photo = photo_of.find(capture.shots[shot].name);
    if (!capture.positioned(shot) || photo == photo_of.end()) continue;
    const View view = capture.view(shot);
    for (const Detection& target : seen.photos[shot].targets)
      for (const Feature& feature : target.features) {
        const auto at = places.find({target.design, target.id, feature.index});
        if (at == places.end()) continue;
        const auto distance = [&](const Place& p) {
          const auto pixel = view.project(c.bodies[p.body].points[p.point]);
          return pixel ? (*pixel - feature.pixel).squaredNorm() : std::numeric_limits<double>::infinity();
        };
        const Place& place =
            *std::min_element(at->second.begin(), at->second.end(),
                              [&](const Place& p, const Place& q) { return distance(p) < distance(q); });
        if (left_out.has(photo->second, int(place.body), target, feature.index)) continue;
        if (const auto pixel = pixel_of_center(view, c.bodies[place.body], place.point, feature.pixel))
          tracks[place.track].sights.push_back({shot, *pixel});
      }
  }
  std::erase_if(tracks, [](const Track& track) { return track.sights.size() < 2; });
  return tracks;
}

}  // namespace lumihull::calib
