// targets.json and detections/NAME.json: what is written is read, and what is wrong is named.
#include <capture/calibration_report.h>
#include <capture/detections_file.h>
#include <capture/target_model_json.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/calibrate_capture.h>
#include <lumihull/internal/json.h>

#include "made_up_model.h"
#include "support.h"

namespace lumihull::calib {
namespace {

using lumihull::internal::Json;
using testing::AllOf;
using testing::HasSubstr;

TEST(TargetModel, ReadsWhatItWrote) {
  const test::TemporaryFolder folder;
  TargetModel model = test::made_up_model();
  // A photograph of a smaller part: its pose is in that part's frame.
  model.calibration.photos[2].part = 1;
  model.calibration.photos[2].cam_from_part = Pose{Eigen::Quaterniond::Identity(), {0.25, -0.5, 1}};
  ASSERT_FALSE(model.calibration.bodies[3].placed);
  model.calibration.bodies[3].part = 1;
  model.calibration.bodies[3].part_from_body = Pose{Eigen::Quaterniond(0, 1, 0, 0), {0.5, 0.25, 2}};
  model.save(folder / "targets.json");
  const TargetModel again = TargetModel::load(folder / "targets.json");
  EXPECT_EQ(internal::print_target_model(again, "again"), read_file(folder / "targets.json"));
  const Calibration &a = model.calibration, &b = again.calibration;
  ASSERT_EQ(b.bodies.size(), a.bodies.size());
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    EXPECT_EQ(b.bodies[i].placed, a.bodies[i].placed);
    EXPECT_EQ(b.bodies[i].points, a.bodies[i].points);
    EXPECT_EQ(b.bodies[i].point_covariances, a.bodies[i].point_covariances);
    EXPECT_EQ(b.bodies[i].body.bend, a.bodies[i].body.bend);
    EXPECT_EQ(b.bodies[i].body.model, a.bodies[i].body.model);
    EXPECT_EQ(b.bodies[i].features.back().feature, 24);
  }
  ASSERT_TRUE(b.photos[2].cam_from_part.has_value());
  EXPECT_EQ(b.photos[2].cam_from_part->translation, Eigen::Vector3d(0.25, -0.5, 1));
  EXPECT_FALSE(b.photos[2].cam_from_world.has_value());
  EXPECT_EQ(b.bodies[0].part, 0);
  EXPECT_EQ(b.bodies[0].part_from_body->translation, a.bodies[0].body.world_from_body.translation);
  EXPECT_EQ(b.bodies[3].part, 1);
  ASSERT_TRUE(b.bodies[3].part_from_body.has_value());
  EXPECT_EQ(b.bodies[3].part_from_body->translation, Eigen::Vector3d(0.5, 0.25, 2));
  EXPECT_EQ(b.bodies[3].part_from_body->rotation.coeffs(), Eigen::Quaterniond(0, 1, 0, 0).coeffs());
  ASSERT_EQ(b.removed.size(), 3u);
  EXPECT_EQ(b.removed[0].photo, 1);
  EXPECT_EQ(b.removed[0].feature, 7);
  EXPECT_EQ(b.removed[1].why, Removed::Why::wrong_id);
  EXPECT_EQ(b.removed[2].kind, Removed::Kind::photo);
  EXPECT_EQ(b.cross_validation_sigma, 1.1);
  EXPECT_EQ(b.print_scale, a.print_scale);
  EXPECT_EQ(b.verdict, a.verdict);
  EXPECT_EQ(again.photos[3].camera, 1);
  EXPECT_EQ(again.starts[0].camera->k1, -0.05);
  EXPECT_EQ(again.starts[1].focal_px, 1700);
}

TEST(TargetModel, WrongFieldsAreNamedByPointer) {
  const Json good = Json::parse(internal::print_target_model(test::made_up_model(), "good"));
  const auto complaint = [&](const char* pointer, const Json& value) {
    Json wrong = good;
    wrong[Json::json_pointer(pointer)] = value;
    const Error e = test::expect_error([&] { internal::parse_target_model(wrong.dump(), "targets.json"); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input) << pointer;
    EXPECT_EQ(e.subject(), "targets.json");
    EXPECT_THAT(e.message(), HasSubstr(pointer)) << pointer;
  };
  complaint("/version", 2);
  complaint("/rms_px", -1);
  complaint("/share", 1.5);
  complaint("/print_scale", {1});
  complaint("/set/designs/0/size_m", -1);
  complaint("/photos/1/name", "p0");
  complaint("/photos/1/camera", 2);
  complaint("/bodies/0/design", 1);
  complaint("/bodies/0/model", "soft");
  complaint("/bodies/0/points/3/feature", 25);
  complaint("/bodies/0/points/3/id", 999'999);
  complaint("/bodies/0/points/3/normal", {0, 0, 2});
  complaint("/bodies/0/points/3/covariance", {1, 2, 0, 1, 0, 1});
  complaint("/bodies/0/points/3/covariance", {1, 0, 0, 1, 0});
  complaint("/bodies/0/world_from_body/q", {1, 1, 0, 0});
  complaint("/bodies/0/part", 1);
  complaint("/bodies/3/part", 0);
  complaint("/bodies/3/part", -2);
  complaint("/removed/0/photo", "p9");
  complaint("/removed/0/body", 4);
  complaint("/removed/0/why", "because");
  complaint("/removed/0/off_px", "far");
  complaint("/cross_validation/sigma", nullptr);
  for (const auto& item : good.items()) {  // a field left out
    if (item.key() == "cross_validation") continue;
    Json wrong = good;
    wrong.erase(item.key());
    EXPECT_EQ(test::expect_error([&] { internal::parse_target_model(wrong.dump(), "t"); }).code(), ErrorCode::bad_input)
        << item.key();
  }
}

TEST(TargetModel, FilesFromBeforeBodiesHadPartsAreRead) {
  Json old = Json::parse(internal::print_target_model(test::made_up_model(), "old"));
  for (auto& body : old["bodies"]) body.erase("part");
  const TargetModel model = internal::parse_target_model(old.dump(), "old");
  EXPECT_EQ(model.calibration.bodies[0].part, 0);
  EXPECT_TRUE(model.calibration.bodies[0].part_from_body.has_value());
  EXPECT_EQ(model.calibration.bodies[3].part, -1);
  EXPECT_FALSE(model.calibration.bodies[3].part_from_body.has_value());
}

TEST(TargetModel, WhatCouldNotBeReadAgainIsNotWritten) {
  const test::TemporaryFolder folder;
  TargetModel model = test::made_up_model();
  model.save(folder / "targets.json");
  const std::string before = read_file(folder / "targets.json");
  model.calibration.sigma0 = std::nan("");
  EXPECT_EQ(test::expect_error([&] { model.save(folder / "targets.json"); }).code(), ErrorCode::bad_input);
  EXPECT_EQ(read_file(folder / "targets.json"), before);
}

TEST(TargetModel, SummaryHasTheFigures) {
  const Json json = Json::parse(calibration_json(test::made_up_model()));
  EXPECT_EQ(json["photos"], 8);
  EXPECT_EQ(json["photos_placed"], 7);
  EXPECT_EQ(json["targets"], 3);
  EXPECT_EQ(json["cross_validation"]["distance_m"], 2.1e-5);
  EXPECT_EQ(json["intrinsics"][0]["standard_deviations"]["f"], 0.2);
  EXPECT_EQ(json["removed"][1]["target"], "matrix5x5 200");
  EXPECT_EQ(json["removed"][1]["photo"], "p3");
}

TEST(TargetModel, StoringChecksThatItIsThisCaptures) {
  const test::TemporaryFolder folder;
  Capture capture = Capture::create(folder / "c");
  EXPECT_EQ(test::expect_error([&] { store_calibration(capture, test::made_up_model()); }).code(),
            ErrorCode::invalid_argument);
}

TEST(DetectionsFile, ReadsWhatItWroteAndNamesWhatIsWrong) {
  const TargetSet set = TargetSet::from_word("matrix5x5:18mm,aruco:6x6_250:35mm");
  internal::KeptDetections kept{"key", {"a \"photo\"", 640, 480, {}}};
  Detection circles, square;
  circles.id = 3, circles.rms_px = 0.1;
  for (int i : {0, 7, 24}) {
    Feature f;
    f.index = i, f.pixel = {1.0 / 3 + i, 2}, f.covariance << 0.01, 0.001, 0.001, 0.02;
    f.dual_conic << 4, 1, 3, 1, 5, 2, 3, 2, 1;
    circles.features.push_back(f);
  }
  square.design = 1, square.id = 77, square.corrected = 1;
  square.features = {circles.features[0]};
  square.features[0].dual_conic.setZero();
  kept.detections.found.targets = {circles, square};
  kept.detections.found.refused.resize(2);
  const std::string text = internal::print_detections(set, kept);
  const internal::KeptDetections again = internal::parse_detections(text, "d", set);
  EXPECT_EQ(again.key, "key");
  EXPECT_EQ(again.detections.photo, "a \"photo\"");
  ASSERT_EQ(again.detections.found.targets.size(), 2u);
  EXPECT_EQ(again.detections.found.targets[0].features[2].dual_conic, circles.features[2].dual_conic);
  EXPECT_EQ(again.detections.found.targets[0].features[1].pixel, circles.features[1].pixel);
  EXPECT_TRUE(again.detections.found.targets[1].features[0].dual_conic.isZero(0));

  const Json good = Json::parse(text);
  EXPECT_EQ(good["detections"]["refused"]["no_code"], 2);
  for (const auto& [pointer, value] :
       std::vector<std::pair<const char*, Json>>{{"/version", 3},
                                                 {"/detections/width", 0},
                                                 {"/detections/targets/0/design", 2},
                                                 {"/detections/targets/0/family", "matrix6x6"},
                                                 {"/detections/targets/1/id", 250},
                                                 {"/detections/targets/0/features/1/index", 0},
                                                 {"/detections/targets/0/features/2/index", 25},
                                                 {"/detections/targets/0/features/0/pixel", {1, "2"}},
                                                 {"/detections/targets/0/features/0/covariance", {1, 2, 1}},
                                                 {"/detections/targets/0/features/0/dual_conic", {1, 2}},
                                                 {"/detections/targets/0/pixel_from_target", {1, 2}}}) {
    Json wrong = good;
    wrong[Json::json_pointer(pointer)] = value;
    const Error e = test::expect_error([&] { internal::parse_detections(wrong.dump(), "d", set); });
    EXPECT_THAT(e.message(), HasSubstr(pointer));
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
  }
}

}  // namespace
}  // namespace lumihull::calib
