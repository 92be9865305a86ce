// Printed sheets in the room: what the detector finds in photographs is where they were put up.
#include <lumihull/base/error.h>
#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/rig/target_sheets.h>
#include <lumihull/rig/trajectory.h>

#include <map>
#include <set>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

using test::coarse_light;

struct HungRoom {
  Scene scene = make_scene(make_sphere(.6, 6), kGreenPaint, false, 5);
  Camera camera = default_camera(1536);
  Hemisphere around;
  RoomTargets targets;

  HungRoom() {
    around.target = scene.center().cast<double>();
    around.radius = framing_distance(camera, scene.radius(), .7);
    targets = scatter_targets(scene, camera, around.radius, {.circle_px = 9});
    scene.sheets = targets.prints;
  }
};

TEST(TargetSheets, AreFoundWhereTheyHang) {
  const HungRoom room;
  Job job;
  const Photographer photographer(room.scene, coarse_light(), job);
  const calib::TargetDetector detector(room.targets.set);
  std::map<int, const PlacedTarget*> placed;
  for (const PlacedTarget& t : room.targets.placed) placed[t.id] = &t;
  PhotoOptions options;
  options.blur_px = .7;
  double sum = 0;
  int points = 0, disturbed = 0;
  for (const Pose& pose : hemisphere_trajectory(6, room.around)) {
    const View view{room.camera, pose};
    const Photo photo = photographer.photograph(view, options, 3, job);
    const calib::Detections found = detector.detect(photo.picture, job);
    EXPECT_GE(found.targets.size(), 5u);  // paper, 3.1
    for (const calib::Detection& d : found.targets) {
      ASSERT_TRUE(placed.contains(d.id)) << "a wrong id";
      const PlacedTarget& t = *placed[d.id];
      EXPECT_EQ(d.design, t.design);
      const calib::TargetDesign& design = room.targets.set.designs[std::size_t(t.design)];
      const Pose cam_from_target = pose * t.world_from_target;
      for (const calib::Feature& f : d.features) {
        calib::Circle3 circle;
        const Eigen::Vector2d place = design.feature(f.index);
        circle.center = cam_from_target * Eigen::Vector3d(place.x(), place.y(), 0);
        circle.u = cam_from_target.rotation * Eigen::Vector3d::UnitX();
        circle.v = cam_from_target.rotation * Eigen::Vector3d::UnitY();
        circle.radius = design.circle_radius_m();
        const auto truth = calib::projected_circle_center(room.camera, circle);
        ASSERT_TRUE(truth.has_value());
        const double off = (f.pixel - *truth).norm();
        EXPECT_LT(off, .5) << "target " << d.id << ", circle " << f.index;
        if (off > .2) {  // the object's outline crosses it
          ++disturbed;
          continue;
        }
        sum += off * off;
        ++points;
      }
    }
  }
  ASSERT_GT(points, 500);
  EXPECT_LE(disturbed * 500, points);
  EXPECT_LT(std::sqrt(sum / points), .03);
}

TEST(TargetSheets, StandBehindTheObjectAndChangeNothingElse) {
  HungRoom room;
  Job job;
  const View view{room.camera, hemisphere_trajectory(3, room.around)[1]};
  const PhotoOptions noiseless = test::noiseless();
  const Photo with = Photographer(room.scene, coarse_light(), job).photograph(view, noiseless, 1, job);
  room.scene.sheets.clear();
  const Photo without = Photographer(room.scene, coarse_light(), job).photograph(view, noiseless, 1, job);
  int object = 0, changed = 0, alike = 0;
  for (int y = 0; y < with.mask.height(); ++y)
    for (int x = 0; x < with.mask.width(); ++x) {
      const std::uint8_t* a = with.picture.row<std::uint8_t>(y) + 3 * x;
      const std::uint8_t* b = without.picture.row<std::uint8_t>(y) + 3 * x;
      const bool same = std::equal(a, a + 3, b);
      if (with.mask.row<std::uint8_t>(y)[x] == 255) {
        ++object;
        EXPECT_TRUE(same) << x << ", " << y;
      } else {
        same ? ++alike : ++changed;
      }
    }
  EXPECT_GT(object, 10'000);
  EXPECT_GT(changed, 10'000);
  EXPECT_GT(alike, 10'000);
}

TEST(TargetSheets, RefusesWhatCantBeHung) {
  const HungRoom room;
  for (const TargetSheetOptions& o :
       {TargetSheetOptions{.circle_px = 0}, TargetSheetOptions{.circle_px = NAN}, TargetSheetOptions{.density = 1}})
    EXPECT_THROW(scatter_targets(room.scene, room.camera, 1, o), Error);
  EXPECT_THROW(scatter_targets(room.scene, room.camera, NAN, {}), Error);
  EXPECT_THROW(scatter_targets(room.scene, room.camera, 1, {.circle_px = 1}), Error);  // more sheets than ids
}

}  // namespace
}  // namespace lumihull::rig
