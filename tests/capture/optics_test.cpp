// Lens and distance: against the equations of thin lenses and spheres, and by looking.
#include <lumihull/capture/optics.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "support.h"

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

/// The blur disc on the sensor, mm, of a point at `at` when focused at `focus`, by similar triangles.
double blur_mm(const Optics& o, double focus_m, double at_m) {
  const double f = o.focal_length_mm, v = image_distance_mm(o, focus_m), v_at = image_distance_mm(o, at_m);
  return f / o.f_number * std::abs(v_at - v) / v_at;
}

TEST(Optics, DepthOfFieldEndsWhereTheBlurDiscIsTheCircleOfConfusion) {
  for (const double focal : {10.0, 18.0, 50.0})
    for (const double distance : {0.8, 1.5, 2.7}) {
      Optics o;
      o.focal_length_mm = focal, o.f_number = 8;
      const Sharpness s = sharpness(o, distance, 0.5);
      EXPECT_NEAR(blur_mm(o, distance, s.near_m), o.circle_of_confusion_mm, 1e-9);
      if (std::isfinite(s.far_m)) {
        EXPECT_NEAR(blur_mm(o, distance, s.far_m), o.circle_of_confusion_mm, 1e-9);
      } else {
        EXPECT_LE(blur_mm(o, distance, 1e9), o.circle_of_confusion_mm * (1 + 1e-6));
      }
    }
  const Optics o;
  const double h = sharpness(o, 1, 0.5).hyperfocal_m;
  EXPECT_NEAR(sharpness(o, 0.9999 * h, 0.5).far_m / h, 1e4, 2e2);
  EXPECT_EQ(sharpness(o, 1.0001 * h, 0.5).far_m, std::numeric_limits<double>::infinity());
}

TEST(Optics, PapersLensesSeeWhatTheirFocalLengthSays) {
  Optics wide;
  wide.focal_length_mm = 10;
  const Sharpness s = sharpness(wide, 2.7, 0.5);
  EXPECT_NEAR(s.field_horizontal_rad / kDegree, 96.6, 1);  // paper, 5.4
  EXPECT_NEAR(s.field_vertical_rad / kDegree, 73.6, 1);
  EXPECT_NEAR(s.pixels_per_mm, 10.0372 / (15.1 / 2048) / 2700, 1e-4);
}

TEST(Optics, ASphereFillsThePictureAtItsRadius) {
  for (const double focal : {10.0, 18.0})
    for (const double margin : {0.0, 0.1}) {
      Optics o;
      o.focal_length_mm = focal;
      const double r = fill_radius(o, {1.0, 0}, Orientation::landscape, margin);
      const double half = (1 - 2 * margin) * 0.5 * o.sensor_height_mm / image_distance_mm(o, r);
      EXPECT_NEAR(r, 0.5 / std::sin(std::atan(half)), 1e-3 * r);
      EXPECT_DOUBLE_EQ(fill_radius(o, {1.0, 0}, Orientation::portrait, margin), r);
    }
}

TEST(Optics, FromTheRadiusFoundTheCylinderIsWholeAndNearerItIsNot) {
  const Optics o;
  const ObjectSize tall{0.5, 1.4}, flat{1.6, 0.3};
  for (const ObjectSize& object : {tall, flat})
    for (const Orientation orientation : {Orientation::landscape, Orientation::portrait}) {
      const double r = fill_radius(o, object, orientation, 0);
      const auto whole = [&](double radius) {
        for (int i = 0; i <= 90; ++i) {
          const double phi = i * kDegree;
          const Vector3d out(std::sin(phi), 0, std::cos(phi)), up(-std::cos(phi), 0, std::sin(phi));
          const View view{
              ideal_camera(o, radius),
              look_at(radius * out, Vector3d::Zero(), orientation == Orientation::landscape ? up : Vector3d(0, 1, 0))};
          if (!framing(view, object, Vector3d::Zero()).whole) return false;
        }
        return true;
      };
      EXPECT_TRUE(whole(1.005 * r));
      EXPECT_FALSE(whole(0.99 * r));
    }
  EXPECT_LT(fill_radius(o, tall, Orientation::portrait), 0.9 * fill_radius(o, tall, Orientation::landscape));
  EXPECT_GT(fill_radius(o, tall, Orientation::portrait, 0.05, 15 * kDegree),
            fill_radius(o, tall, Orientation::portrait, 0.05));
}

TEST(Optics, OutlineOfASphereIsTangent) {
  const ObjectSize ball{1.0, 0};
  const Vector3d center(0.3, -0.2, 0.1), eye(2, 1, 0.7);
  const auto outline = object_outline(ball, center, eye, 360);
  ASSERT_EQ(outline.size(), 360u);
  for (const Vector3d& p : outline) {
    const Vector3d d = (p - eye).normalized();
    EXPECT_NEAR((center - eye).cross(d).norm(), 0.5, 1e-4);
  }
  EXPECT_TRUE(object_outline(ball, center, center + Vector3d(0.1, 0, 0)).empty());
}

TEST(Optics, FramingSeesWhatIsCutOff) {
  const Camera camera = ideal_camera({}, 2);
  const ObjectSize ball{0.5, 0};
  const Vector3d eye(2, 0, 0);
  const Framing centred = framing({camera, look_at(eye, Vector3d::Zero(), Vector3d::UnitZ())}, ball, Vector3d::Zero());
  EXPECT_TRUE(centred.whole);
  EXPECT_GT(centred.least_margin_px, 300);
  // Turned so far that half of it is beyond the border.
  const double half = std::atan(0.5 * camera.height / camera.f);
  const Framing cut =
      framing({camera, look_at(eye, eye + Vector3d(-std::cos(half), 0, std::sin(half)), Vector3d::UnitZ())}, ball,
              Vector3d::Zero());
  EXPECT_FALSE(cut.whole);
  EXPECT_LT(cut.least_margin_px, -200);
  const Framing behind = framing({camera, look_at(eye, 2 * eye, Vector3d::UnitZ())}, ball, Vector3d::Zero());
  EXPECT_FALSE(behind.whole);
  EXPECT_EQ(behind.least_margin_px, -std::numeric_limits<double>::infinity());
}

TEST(Optics, FramingGoesThroughTheDistortion) {
  Camera camera = ideal_camera({}, 1.2);
  const View plain{camera, look_at({1.2, 0, 0}, Vector3d::Zero(), Vector3d::UnitZ())};
  View barrel = plain;
  barrel.camera.k1 = 0.3;  // corrected = distorted (1 + 0.3 r²): the picture is drawn together
  const ObjectSize ball{0.7, 0};
  EXPECT_GT(framing(barrel, ball, Vector3d::Zero()).least_margin_px,
            framing(plain, ball, Vector3d::Zero()).least_margin_px + 20);
}

TEST(Optics, StepLeavesTheOverlapThatWasAskedFor) {
  EXPECT_NEAR(step_for_overlap(0.75, 0, 1), 0.25 * 2 * 60 * kDegree, 1e-12);
  // From 1.1 radii only acos(1 / 1.1) of the ball is seen.
  EXPECT_NEAR(step_for_overlap(0, 1, 1.1), 2 * std::acos(1 / 1.1), 1e-12);
  EXPECT_THROW(step_for_overlap(0.5, 1, 0.9), Error);
}

TEST(Optics, WarnsWhereTheObjectIsDeeperThanTheDepthOfField) {
  Optics open;
  open.focal_length_mm = 50, open.f_number = 2.8;
  const auto warnings = optics_warnings(open, {1, 0}, 2.5, 0.5);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("depth of field"));
  EXPECT_TRUE(optics_warnings({}, {1, 0}, 2.5, 0.5).empty());
  EXPECT_THAT(optics_warnings({}, {3, 0}, 1, 0.5).at(0), HasSubstr("inside"));
}

TEST(Optics, RefusesWhatIsNoLens) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (double Optics::*field : {&Optics::focal_length_mm, &Optics::sensor_width_mm, &Optics::sensor_height_mm,
                                &Optics::f_number, &Optics::circle_of_confusion_mm})
    for (const double bad : {0.0, -1.0, nan, 1e300}) {
      Optics o;
      o.*field = bad;
      EXPECT_EQ(test::expect_error([&] { check(o); }).code(), ErrorCode::invalid_argument);
    }
  EXPECT_EQ(test::expect_error([] { check(ObjectSize{0, 0}); }).subject(), "object diameter, m");
  EXPECT_EQ(test::expect_error([] { check(ObjectSize{1, -1}); }).subject(), "object height, m");
  EXPECT_EQ(test::expect_error([] { fill_radius({}, {1, 0}, Orientation::portrait, 0.5); }).subject(), "margin");
  Optics tele;
  tele.focal_length_mm = 8000;
  EXPECT_EQ(test::expect_error([&] {
              fill_radius(tele, {900, 0}, Orientation::portrait);
            }).code(),
            ErrorCode::degenerate);
}

}  // namespace
}  // namespace lumihull::capture
