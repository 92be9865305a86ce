#include <lumihull/base/files.h>
#include <lumihull/capture/mechanism.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "mechanism_support.h"
#include "support.h"

namespace lumihull::capture {
namespace {

using testing::HasSubstr;
using Json = nlohmann::ordered_json;

TEST(MechanismFile, ComesBackAsItWas) {
  const test::TemporaryFolder folder;
  test::Random random(1);
  for (int cables = 3; cables <= 12; ++cables) {
    Mechanism made = test::random_mechanism(random, cables);
    made.name = "gréement";
    made.cables[1].stiffness_N = 12345.678901234567;
    made.cables[2].density_kg_m = 0.005;
    made.limits.jerk_m_s3 = 1.0 / 3;
    made.cam_from_platform = {random.rotation(3), random.vector(0.2)};
    write_mechanism(made, folder / "mechanism.json");
    const std::string once = read_file(folder / "mechanism.json");
    const Mechanism read = read_mechanism(folder / "mechanism.json");
    write_mechanism(read, folder / "mechanism.json");
    EXPECT_EQ(read_file(folder / "mechanism.json"), once);
    ASSERT_EQ(read.cables.size(), made.cables.size());
    EXPECT_EQ(read.name, made.name);
    EXPECT_EQ(read.cables[1].departure, made.cables[1].departure);
    EXPECT_EQ(read.cables[1].stiffness_N, made.cables[1].stiffness_N);
    EXPECT_EQ(read.cables[2].density_kg_m, made.cables[2].density_kg_m);
    EXPECT_EQ(read.limits.jerk_m_s3, made.limits.jerk_m_s3);
    EXPECT_EQ(read.center_of_mass, made.center_of_mass);
    EXPECT_EQ(read.room.max(), made.room.max());
    EXPECT_EQ(read.cam_from_platform.translation, made.cam_from_platform.translation);
  }
}

TEST(MechanismFile, HostileOnesAreRefused) {
  const test::TemporaryFolder folder;
  write_mechanism(paper_mechanism(), folder / "good.json");
  const Json good = Json::parse(read_file(folder / "good.json"));
  const auto refused = [&](const std::string& text, const std::string& what) {
    SCOPED_TRACE(what);
    write_file(folder / "bad.json", text);
    const Error error = test::expect_error([&] { read_mechanism(folder / "bad.json"); });
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    EXPECT_EQ(error.subject(), (folder / "bad.json").string());
    EXPECT_THAT(error.message(), HasSubstr(what));
  };
  const auto spoilt = [&](const char* pointer, const Json& value) {
    Json copy = good;
    copy[Json::json_pointer(pointer)] = value;
    return copy.dump();
  };
  refused("", "JSON");
  refused("[1]", "an object");
  refused(spoilt("/format", "lumihull-plan"), "/format");
  refused(spoilt("/version", 2), "/version");
  refused(spoilt("/cables", Json::array()), "/cables: expected 3 to 12");
  refused(spoilt("/cables", Json::array({1, 2, 3})), "/cables/0");
  Json many = good;
  for (int i = 0; i < 1000; ++i) many["cables"].push_back(good["cables"][0]);
  refused(many.dump(), "/cables: expected at most 12");
  refused(spoilt("/cables/3/name", "1"), "/cables/3/name: expected a name that no other cable has");
  refused(spoilt("/cables/3/name", ""), "/cables/3/name");
  refused(spoilt("/cables/3/departure", Json::array({1, 2})), "/cables/3/departure: expected three numbers");
  refused(spoilt("/cables/3/departure/0", nullptr), "/cables/3/departure/0");
  refused(spoilt("/cables/3/departure/0", 5.01), "/cables/3/departure: expected a point in the room");
  refused(spoilt("/cables/3/attachment/2", 1e300), "/cables/3/attachment");
  refused(spoilt("/cables/3/min_length_m", -1), "/cables/3/min_length_m");
  refused(spoilt("/cables/3/max_length_m", 0.05), "/cables/3/max_length_m: expected more than min_length_m");
  refused(spoilt("/cables/3/max_tension_N", 1), "/cables/3/max_tension_N: expected more than min_tension_N");
  refused(spoilt("/cables/3/stiffness_N", -1), "/cables/3/stiffness_N");
  refused(spoilt("/cables/3/density_kg_m", "5 g"), "/cables/3/density_kg_m");
  refused(spoilt("/mass_kg", 0), "/mass_kg");
  refused(spoilt("/gravity_m_s2", -9.81), "/gravity_m_s2");
  refused(spoilt("/platform_radius_m", -1), "/platform_radius_m");
  refused(spoilt("/room/max/2", -2), "/room/max");
  refused(spoilt("/limits/jerk_m_s3", 0), "/limits/jerk_m_s3");
  refused(spoilt("/cam_from_platform/q/0", 2), "/cam_from_platform/q");
  Json lacking = good;
  lacking["cables"][4].erase("stiffness_N");
  refused(lacking.dump(), "at /cables/4: expected a field \"stiffness_N\"");
  EXPECT_EQ(test::expect_error([&] { read_mechanism(folder / "none.json"); }).code(), ErrorCode::not_found);
}

TEST(MechanismFile, NothingIsWrittenThatCouldNotBeRead) {
  const test::TemporaryFolder folder;
  const auto refused = [&](const char* what, void (*spoil)(Mechanism&)) {
    SCOPED_TRACE(what);
    Mechanism mechanism = paper_mechanism();
    spoil(mechanism);
    EXPECT_THAT(test::expect_error([&] { write_mechanism(mechanism, folder / "m.json"); }).message(), HasSubstr(what));
    EXPECT_THAT(test::expect_error([&] { check(mechanism, "here"); }).what(), HasSubstr("here: at "));
    EXPECT_FALSE(std::filesystem::exists(folder / "m.json"));
  };
  refused("/cables/0/departure", [](Mechanism& m) { m.cables[0].departure.x() = std::nan(""); });
  refused("/cables/5/attachment", [](Mechanism& m) { m.cables[5].attachment.z() = -INFINITY; });
  refused("/cables/5/min_tension_N", [](Mechanism& m) { m.cables[5].min_tension_N = std::nan(""); });
  refused("/cables", [](Mechanism& m) { m.cables.clear(); });
  refused("/cables", [](Mechanism& m) { m.cables.resize(1000, m.cables[0]); });
  refused("/center_of_mass", [](Mechanism& m) { m.center_of_mass.y() = INFINITY; });
  refused("/room/min", [](Mechanism& m) { m.room.setEmpty(); });
  refused("/limits/speed_m_s", [](Mechanism& m) { m.limits.speed_m_s = std::nan(""); });
  refused("/cam_from_platform/q", [](Mechanism& m) { m.cam_from_platform.rotation.coeffs().setZero(); });
}

TEST(PaperMechanism, CameraSeesTheObjectWithinFifteenDegrees) {
  const Mechanism mechanism = paper_mechanism();
  check(mechanism);
  for (int theta = 0; theta < 360; theta += 20)
    for (int phi = 0; phi <= 90; phi += 10) {
      const double t = theta * std::numbers::pi / 180, f = phi * std::numbers::pi / 180;
      const Pose cam_from_world = cam_from_platform(mechanism, t) * test::pose_on_hemisphere(t, f).inverse();
      const Eigen::Vector3d object = cam_from_world * Eigen::Vector3d::Zero();
      EXPECT_NEAR(std::atan2(object.x(), object.z()) * 180 / std::numbers::pi, 15 - phi / 3.0, 1e-9);
      EXPECT_NEAR(object.y(), 0, 1e-12);
      // Portrait: the picture's rows run down the world.
      EXPECT_LT((cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitX()).z(), 0.0);
    }
}

}  // namespace
}  // namespace lumihull::capture
