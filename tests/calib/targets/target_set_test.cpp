// Sets of targets: words, files, and every contradiction refused with its place.
#include <lumihull/base/files.h>
#include <lumihull/calib/target_set.h>
#include <lumihull/internal/json.h>

#include <cmath>
#include <limits>

#include "support.h"

namespace lumihull::calib {
namespace {

using internal::Json;
using testing::HasSubstr;

bool same(const TargetDesign& a, const TargetDesign& b) {
  return a.family == b.family && a.size_m == b.size_m && a.circle_diameter_m == b.circle_diameter_m &&
         a.ring_diameter_m == b.ring_diameter_m && a.solid_light == b.solid_light && a.scale_x == b.scale_x &&
         a.scale_y == b.scale_y && a.ink == b.ink && a.paper == b.paper;
}

bool same(const Pose& a, const Pose& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

/// A box with targets on two faces, a sheet, a chessboard.
TargetSet example() {
  TargetSet set;
  TargetDesign circles;
  circles.size_m = 0.018;
  circles.scale_x = 1.0021;
  circles.ring_diameter_m = 0.004;
  TargetDesign tags;
  tags.family = TargetFamily::by_name("apriltag:36h11");
  tags.size_m = 0.05;
  tags.ink = {0, 0, 0};
  tags.paper = {255, 255, 255};
  set.designs = {circles, tags};
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d(1, 2, -1).normalized()));
  set.boards = {{"box", {{0, 3, {}}, {0, 4, {turned, {0.1, 1.0 / 3, -0.02}}}}},
                {"sheet 1", {{1, 17, {}}, {0, 255, {Eigen::Quaterniond::Identity(), {0.2, 0, 0}}}}}};
  set.grids = {{PointGrid::Kind::chessboard, 9, 6, 0.025, 0}, {PointGrid::Kind::circles, 11, 8, 0.015, 0.006}};
  return set;
}

TEST(TargetSet, FilesGiveBackWhatWasSaved) {
  const test::TemporaryFolder folder;
  const TargetSet set = example();
  set.save(folder / "targets.json");
  const TargetSet again = TargetSet::load(folder / "targets.json");
  ASSERT_EQ(again.designs.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_TRUE(same(again.designs[i], set.designs[i]));
  ASSERT_EQ(again.boards.size(), 2u);
  for (std::size_t b = 0; b < 2; ++b) {
    EXPECT_EQ(again.boards[b].name, set.boards[b].name);
    ASSERT_EQ(again.boards[b].targets.size(), set.boards[b].targets.size());
    for (std::size_t t = 0; t < set.boards[b].targets.size(); ++t) {
      EXPECT_EQ(again.boards[b].targets[t].design, set.boards[b].targets[t].design);
      EXPECT_EQ(again.boards[b].targets[t].id, set.boards[b].targets[t].id);
      EXPECT_TRUE(same(again.boards[b].targets[t].board_from_target, set.boards[b].targets[t].board_from_target));
    }
  }
  ASSERT_EQ(again.grids.size(), 2u);
  EXPECT_EQ(again.grids[1].kind, PointGrid::Kind::circles);
  EXPECT_EQ(again.grids[1].columns, 11);
  EXPECT_EQ(again.grids[1].circle_diameter_m, 0.006);
  again.save(folder / "again.json");
  EXPECT_EQ(read_file(folder / "again.json"), read_file(folder / "targets.json"));
}

TEST(TargetSet, Words) {
  TargetSet set = TargetSet::from_word("matrix5x5:18mm");
  ASSERT_EQ(set.designs.size(), 1u);
  EXPECT_EQ(set.designs[0].family.name(), "matrix5x5");
  EXPECT_DOUBLE_EQ(set.designs[0].size_m, 0.018);
  EXPECT_DOUBLE_EQ(set.designs[0].circle_radius_m(), 0.0045);
  EXPECT_TRUE(set.boards.empty());

  set = TargetSet::from_word("aruco:6x6_250:3.5cm,apriltag:36h11:2in,chessboard:9x6:25mm,circles:11x8:0.015m");
  ASSERT_EQ(set.designs.size(), 2u);
  EXPECT_EQ(set.designs[0].family.name(), "aruco:6x6_250");
  EXPECT_DOUBLE_EQ(set.designs[0].size_m, 0.035);
  EXPECT_EQ(set.designs[0].ink, (Rgb{0, 0, 0}));
  EXPECT_DOUBLE_EQ(set.designs[1].size_m, 0.0508);
  ASSERT_EQ(set.grids.size(), 2u);
  EXPECT_EQ(set.grids[0].kind, PointGrid::Kind::chessboard);
  EXPECT_EQ(set.grids[0].columns, 9);
  EXPECT_EQ(set.grids[0].rows, 6);
  EXPECT_DOUBLE_EQ(set.grids[0].spacing_m, 0.025);
  EXPECT_EQ(set.grids[1].kind, PointGrid::Kind::circles);
  EXPECT_DOUBLE_EQ(set.grids[1].spacing_m, 0.015);
}

TEST(TargetSet, WordsThatAreNone) {
  for (const char* word : {"",
                           ",",
                           "matrix5x5",
                           "matrix5x5:",
                           "matrix5x5:18",
                           "matrix5x5:mm",
                           "matrix5x5:-18mm",
                           "matrix5x5:0mm",
                           "matrix5x5:1e400mm",
                           "matrix5x5:nanmm",
                           "matrix5x5:infmm",
                           "matrix5x5:18mmm",
                           "matrix5x5:18 mm",
                           "matrix5x5:18mm,",
                           "matrix5x5:1000km",
                           "matrix5x5:0.000001mm",
                           "matrix5x5:200m",
                           ":18mm",
                           "aruco:9x9_50:1cm",
                           "apriltag:1cm",
                           "chessboard:25mm",
                           "chessboard:9x:25mm",
                           "chessboard:x6:25mm",
                           "chessboard:9x6x2:25mm",
                           "chessboard:1x6:25mm",
                           "chessboard:999999999999x6:25mm",
                           "circles:9x101:25mm",
                           "matrix5x5:18mm,matrix5x5:36mm",
                           "aruco:4x4_50:1cm,aruco:4x4_100:2cm",
                           "chessboard:9x6:25mm,chessboard:6x9:20mm",
                           "targets.txt"}) {
    const Error e = test::expect_error([&] { TargetSet::from_word(word); });
    EXPECT_EQ(e.code(), ErrorCode::invalid_argument) << word;
    EXPECT_FALSE(e.message().empty()) << word;
  }
  EXPECT_EQ(test::expect_error([] { TargetSet::from_word("apriltag:Circle21h7:5cm"); }).code(), ErrorCode::unsupported);
  EXPECT_EQ(test::expect_error([] { TargetSet::from_word(std::string(100'000, ',')); }).code(),
            ErrorCode::invalid_argument);
  EXPECT_LT(std::string(test::expect_error([] { TargetSet::from_word("matrix5x5:" + std::string(9'000, '1')); }).what())
                .size(),
            400u);
}

TEST(TargetSet, TextIsAFileOrAWord) {
  const test::TemporaryFolder folder;
  example().save(folder / "set.json");
  EXPECT_EQ(TargetSet::from_text((folder / "set.json").string()).boards.size(), 2u);
  EXPECT_EQ(TargetSet::from_text("matrix6x6:30mm").designs.size(), 1u);
  write_file(folder / "odd", read_file(folder / "set.json"));
  EXPECT_EQ(TargetSet::from_text((folder / "odd").string()).boards.size(), 2u);
  EXPECT_EQ(test::expect_error([&] { TargetSet::from_text((folder / "absent.json").string()); }).code(),
            ErrorCode::not_found);
  EXPECT_EQ(test::expect_error([] { TargetSet::from_text(std::string("a\0b", 3)); }).code(),
            ErrorCode::invalid_argument);
}

/// The example as JSON with a value at a pointer replaced (or taken out: null).
std::string edited(const std::string& pointer, const Json& value) {
  const test::TemporaryFolder folder;
  example().save(folder / "set.json");
  Json json = Json::parse(read_file(folder / "set.json"));
  const Json::json_pointer at(pointer);
  if (value.is_null())
    json[at.parent_pointer()].erase(at.back());
  else
    json[at] = value;
  return json.dump();
}

TEST(TargetSet, FilesThatContradictThemselvesAreRefusedWithThePlace) {
  struct Fault {
    std::string pointer;
    Json value;
    std::string complaint;  ///< the pointer in the message
  };
  const Json far = {{"q", {1, 0, 0, 0}}, {"t", {1e9, 0, 0}}};
  const std::vector<Fault> faults{
      {"/format", "lumihull-capture", "/format"},
      {"/version", 2, "/version"},
      {"/version", nullptr, "/"},
      {"/colour", 1, "/"},
      {"/designs", nullptr, "/boards/0/targets/0/design"},
      {"/designs", Json::object(), "/designs"},
      {"/designs/0", 7, "/designs/0"},
      {"/designs/0/family", "matrix7x7", "/designs/0/family"},
      {"/designs/0/family", "apriltag:Standard41h12", "/designs/0/family"},
      {"/designs/0/family", "paper4x4", "/boards/0/targets/0/id"},  // where 3 has a second L
      {"/designs/0/size_m", 0, "/designs/0/size_m"},
      {"/designs/0/size_m", -1, "/designs/0/size_m"},
      {"/designs/0/size_m", 1e9, "/designs/0/size_m"},
      {"/designs/0/size_m", "18mm", "/designs/0/size_m"},
      {"/designs/0/circle_diameter_m", 0.018, "/designs/0/circle_diameter_m"},
      {"/designs/0/circle_diameter_m", -0.01, "/designs/0/circle_diameter_m"},
      {"/designs/0/ring_diameter_m", 0.009, "/designs/0/ring_diameter_m"},
      {"/designs/0/ring_diametre_m", 0.004, "/designs/0"},
      {"/designs/0/solid_light", true, "/designs/0/ring_diameter_m"},
      {"/designs/0/solid_light", 1, "/designs/0/solid_light"},
      {"/designs/0/scale_x", 0.1, "/designs/0/scale_x"},
      {"/designs/0/ink", Json::array({255, 255, 255}), "/designs/0/ink"},
      {"/designs/0/ink", Json::array({0, 0}), "/designs/0/ink"},
      {"/designs/0/ink", Json::array({0, 0, 256}), "/designs/0/ink/2"},
      {"/designs/1/solid_light", true, "/designs/1/solid_light"},
      {"/designs/1/circle_diameter_m", 0.01, "/designs/1/circle_diameter_m"},
      {"/boards", nullptr, ""},  // two designs of unlike looks: nothing wrong
      {"/boards/0/name", "", "/boards/0/name"},
      {"/boards/0/name", "a\nb", "/boards/0/name"},
      {"/boards/1/name", "box", "/boards/1/name"},
      {"/boards/0/targets", Json::array(), "/boards/0/targets"},
      {"/boards/0/targets/0/design", 2, "/boards/0/targets/0/design"},
      {"/boards/0/targets/0/design", -1, "/boards/0/targets/0/design"},
      {"/boards/0/targets/0/id", 256, "/boards/0/targets/0/id"},
      {"/boards/0/targets/0/id", 1.5, "/boards/0/targets/0/id"},
      {"/boards/0/targets/0/id", 4, "/boards/0/targets/1/id"},
      {"/boards/1/targets/1/id", 3, "/boards/1/targets/1/id"},
      {"/boards/0/targets/0/board_from_target/q", Json::array({1, 1, 0, 0}), "/boards/0/targets/0/board_from_target/q"},
      {"/boards/0/targets/0/board_from_target/q", Json::array({0, 0, 0, 0}), "/boards/0/targets/0/board_from_target/q"},
      {"/boards/0/targets/0/board_from_target/t", Json::array({0, 0}), "/boards/0/targets/0/board_from_target/t"},
      {"/boards/0/targets/0/board_from_target", far, "/boards/0/targets/0/board_from_target/t"},
      {"/boards/1/targets/1/board_from_target/t", Json::array({0.05, 0, 0}), "/boards/1/targets/1/board_from_target"},
      {"/grids/0/kind", "checkerboard", "/grids/0/kind"},
      {"/grids/0/columns", 1, "/grids/0/columns"},
      {"/grids/0/rows", 101, "/grids/0/rows"},
      {"/grids/0/spacing_m", 0, "/grids/0/spacing_m"},
      {"/grids/0/circle_diameter_m", 0.01, "/grids/0/circle_diameter_m"},
      {"/grids/1/circle_diameter_m", 0.015, "/grids/1/circle_diameter_m"},
      {"/grids/1", {{"kind", "chessboard"}, {"columns", 6}, {"rows", 9}, {"spacing_m", 0.02}}, "/grids/1"},
  };
  const test::TemporaryFolder folder;
  for (const Fault& fault : faults) {
    SCOPED_TRACE(fault.pointer + " = " + fault.value.dump());
    write_file(folder / "set.json", edited(fault.pointer, fault.value));
    if (fault.complaint.empty()) {
      EXPECT_NO_THROW(TargetSet::load(folder / "set.json"));
      continue;
    }
    const Error e = test::expect_error([&] { TargetSet::load(folder / "set.json"); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_EQ(e.subject(), (folder / "set.json").string());
    EXPECT_THAT(e.message(), HasSubstr("at " + fault.complaint + ": expected "));
  }
}

TEST(TargetSet, FilesThatAreNone) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(test::expect_error([&] { TargetSet::load(folder / "set.json"); }).code(), ErrorCode::not_found);
  for (const std::string text :
       {"", "{", "[]", "null", "\"lumihull-targets\"", "{\"format\": \"lumihull-targets\", \"version\": 1}"}) {
    write_file(folder / "set.json", text);
    EXPECT_EQ(test::expect_error([&] { TargetSet::load(folder / "set.json"); }).code(), ErrorCode::bad_input) << text;
  }
}

TEST(TargetSet, SavesNothingThatItWouldNotRead) {
  const test::TemporaryFolder folder;
  TargetSet set = example();
  set.boards[1].targets[0].id = 4000;
  const Error e = test::expect_error([&] { set.save(folder / "set.json"); });
  EXPECT_EQ(e.code(), ErrorCode::invalid_argument);
  EXPECT_EQ(e.subject(), "/boards/1/targets/0/id");
  EXPECT_FALSE(std::filesystem::exists(folder / "set.json"));

  set = example();
  set.boards[0].name = "\xff";
  EXPECT_EQ(test::expect_error([&] { set.save(folder / "set.json"); }).code(), ErrorCode::bad_input);
  for (double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1.0}) {
    set = example();
    set.designs[0].size_m = bad;
    EXPECT_EQ(test::expect_error([&] { set.validate(); }).subject(), "/designs/0/size_m");
    set = example();
    set.boards[0].targets[0].board_from_target.translation.y() = bad * 1e300;
    EXPECT_EQ(test::expect_error([&] { set.validate(); }).subject(), "/boards/0/targets/0/board_from_target/t");
  }
  EXPECT_THROW(TargetSet{}.validate(), Error);
}

TEST(TargetSet, TargetsMayTouchAndStandBackToBack) {
  TargetSet set;
  TargetDesign tag;
  tag.family = TargetFamily::by_name("apriltag:36h11");
  tag.size_m = 0.05;
  set.designs = {tag};
  const Eigen::Quaterniond back(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond aside(Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitZ()));
  set.boards = {{"card",
                 {{0, 0, {}},
                  {0, 1, {Eigen::Quaterniond::Identity(), {0.05, 0, 0}}},
                  {0, 2, {back, {0, 0, 0}}},
                  {0, 3, {aside, {-0.0604, 0, 0}}}}}};
  EXPECT_NO_THROW(set.validate());
  set.boards[0].targets[3].board_from_target.translation.x() =
      -0.0603;  // corner over a side: 0.025 (1 + sqrt 2) = 0.06036
  EXPECT_EQ(test::expect_error([&] { set.validate(); }).subject(), "/boards/0/targets/3/board_from_target");
}

TEST(TargetDesign, FeaturesStandAboutTheMiddle) {
  TargetDesign design;
  design.size_m = 0.02;
  design.scale_x = 1.01;
  EXPECT_EQ(design.features(), 25);
  EXPECT_TRUE(design.feature(0).isApprox(Eigen::Vector2d(-0.0404, -0.04)));
  EXPECT_TRUE(design.feature(4).isApprox(Eigen::Vector2d(0.0404, -0.04)));
  EXPECT_TRUE(design.feature(12).isZero());
  EXPECT_TRUE(design.feature(20).isApprox(Eigen::Vector2d(-0.0404, 0.04)));
  design.family = TargetFamily::by_name("matrix6x6");
  EXPECT_TRUE(design.feature(0).isApprox(Eigen::Vector2d(-0.0505, -0.05)));
  design.family = TargetFamily::by_name("aruco:4x4_50");
  design.scale_x = 1;
  EXPECT_EQ(design.features(), 4);
  const Eigen::Vector2d corners[] = {{-0.01, -0.01}, {0.01, -0.01}, {0.01, 0.01}, {-0.01, 0.01}};
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(design.feature(i).isApprox(corners[i])) << i;
  EXPECT_THROW(design.feature(4), Error);
  EXPECT_THROW(design.feature(-1), Error);
}

}  // namespace
}  // namespace lumihull::calib
