// Measured distances as people write them.
#include <lumihull/base/error.h>
#include <lumihull/calib/target_bar.h>

#include "support.h"

namespace lumihull::calib {
namespace {

using testing::HasSubstr;

TEST(TargetBar, IsReadFromWords) {
  EXPECT_TRUE(bars_from_text("").empty());
  EXPECT_TRUE(bars_from_text(" ; ").empty());
  const auto bars = bars_from_text("3.0,17.24,0.5; aruco:6x6_250:5.1 , 6.3, 25.5 cm, 0.2mm ;1.0,1.24,144mm");
  ASSERT_EQ(bars.size(), 3u);
  EXPECT_EQ(bars[0].text, "3.0,17.24,0.5");
  EXPECT_EQ(bars[0].a.id, 3);
  EXPECT_EQ(bars[0].a.point, 0);
  EXPECT_EQ(bars[0].b.id, 17);
  EXPECT_EQ(bars[0].b.point, 24);
  EXPECT_EQ(bars[0].length_m, 0.5);
  EXPECT_EQ(bars[0].sigma_m, 0.5e-3);
  EXPECT_EQ(bars[1].a.family, "aruco:6x6_250");
  EXPECT_EQ(bars[1].a.id, 5);
  EXPECT_EQ(bars[1].b.family, "");
  EXPECT_DOUBLE_EQ(bars[1].length_m, 0.255);
  EXPECT_DOUBLE_EQ(bars[1].sigma_m, 0.2e-3);
  EXPECT_DOUBLE_EQ(bars[2].length_m, 0.144);
}

TEST(TargetBar, NonsenseIsRefused) {
  for (const char* text : {"3.0", "3.0,4.0", "3.0,4.0,1,2,3", "3,4.0,1", "3.,4.0,1", ".0,4.0,1", "3.0,4.0,",
                           "3.0,4.0,0", "3.0,4.0,nan", "3.0,4.0,inf", "3.0,4.0,1,0", "3.0,4.0,1,-1", "-3.0,4.0,1",
                           "3.0,4.0,1km", "3.-1,4.0,1", "99999999999.0,4.0,1", "a:,4.0,1", "3.0x,4.0,1"}) {
    const Error e = test::expect_error([&] { bars_from_text(text); });
    EXPECT_EQ(e.code(), ErrorCode::invalid_argument) << text;
    EXPECT_EQ(e.subject(), "bar");
    EXPECT_THAT(e.message(), HasSubstr(text)) << text;
  }
}

TEST(TargetBar, FindsItsBodies) {
  TargetSet set = TargetSet::from_word("matrix5x5:18mm,aruco:6x6_250:35mm");
  std::vector<PhotoTargets> photos(1);
  for (const auto& [design, id] : {std::pair(0, 3), {0, 5}, {1, 5}}) {
    Detection d;
    d.design = design, d.id = id;
    photos[0].targets.push_back(d);
  }
  const std::vector<CalibratedBody> bodies = bodies_of(set, photos);
  ASSERT_EQ(bodies.size(), 3u);
  const auto between = [&](const char* text) { return bar_between(bars_from_text(text).at(0), set, bodies); };
  const ScaleBar bar = between("3.24,aruco:6x6_250:5.2,0.5,1mm");
  EXPECT_EQ(bar.body_a, 0u);
  EXPECT_EQ(bar.point_a, 24u);
  EXPECT_EQ(bar.body_b, 2u);
  EXPECT_EQ(bar.point_b, 2u);
  EXPECT_EQ(bar.length_m, 0.5);
  EXPECT_EQ(bar.sigma_m, 1e-3);
  const auto says = [&](const char* text, const char* what) {
    EXPECT_THAT(test::expect_error([&] { between(text); }).message(), HasSubstr(what)) << text;
  };
  says("3.0,5.0,0.5", "FAMILY:ID.POINT");
  says("3.0,4.0,0.5", "no photograph shows target 4");
  says("3.0,aruco:6x6_250:3.0,0.5", "no photograph shows target aruco:6x6_250 3");
  says("3.0,aruco:6x6_250:5.4,0.5", "has no point 4");
  says("3.7,3.7,0.5", "two points");
}

}  // namespace
}  // namespace lumihull::calib
