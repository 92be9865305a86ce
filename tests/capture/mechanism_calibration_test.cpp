#include <lumihull/capture/mechanism_calibration.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "design/length_model.h"
#include "simulated_observations.h"
#include "support.h"

namespace lumihull::capture {
namespace {

using test::expect_error;
using test::length_error_m;
using test::simulated_mechanism;
using test::simulated_observations;
using test::SimulatedOptions;

SimulatedOptions without_noise(std::uint64_t seed) {
  SimulatedOptions options;
  options.seed = seed;
  options.position_noise_m = options.rotation_noise_rad = 0;
  return options;
}

double departure_error_m(const Mechanism& a, const Mechanism& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.cables.size(); ++i)
    worst = std::max(worst, (a.cables[i].departure - b.cables[i].departure).norm());
  return worst;
}

TEST(MechanismCalibration, DerivativesAgreeWithFiniteDifferences) {
  const SimulatedOptions options = without_noise(3);
  const auto mechanism = simulated_mechanism(options);
  design::LengthLayout layout;
  layout.cables = 6, layout.points = 3, layout.groups = options.groups, layout.gains = true;
  layout.point_of_cable = {0, 0, 1, 1, 2, 2};
  design::LengthParameters x;
  for (const Cable& cable : mechanism.truth.cables) x.departures.push_back(cable.departure);
  for (std::size_t p = 0; p < 3; ++p) x.attachments.push_back(mechanism.truth.cables[2 * p].attachment);
  x.offsets = mechanism.offsets_m, x.gains = {1.01, 0.99, 1.02, 0.98, 1, 1.001};
  x.cam_from_platform = mechanism.guess.cam_from_platform;
  x.cam_from_platform.translation = {0.1, -0.2, 0.05};
  x.bearings = mechanism.bearings_rad;
  for (const MechanismObservation& o : simulated_observations(mechanism, options, 1)) {
    design::LengthObservation observation{
        o.cam_from_world,
        o.bearing_group,
        Eigen::Map<const Eigen::VectorXd>(o.commanded_m.data(), Eigen::Index(o.commanded_m.size())),
        {}};
    Eigen::MatrixXd jacobian, pose_jacobian;
    design::length_residuals(layout, x, observation, &jacobian, &pose_jacobian);
    constexpr double kStep = 1e-6;
    for (int p = 0; p < layout.size(); ++p) {
      const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(layout.size(), p);
      const Eigen::VectorXd slope =
          (design::length_residuals(layout, x.moved(layout, step), observation, nullptr, nullptr) -
           design::length_residuals(layout, x.moved(layout, -step), observation, nullptr, nullptr)) /
          (2 * kStep);
      EXPECT_LT((slope - jacobian.col(p)).cwiseAbs().maxCoeff(), 1e-8)
          << layout.names(mechanism.truth, std::vector<int>(24))[std::size_t(p)];
    }
    for (int p = 0; p < 6; ++p) {
      const auto moved = [&](double by) {
        design::LengthObservation m = observation;
        Eigen::Matrix<double, 6, 1> s = by * Eigen::Matrix<double, 6, 1>::Unit(p);
        m.cam_from_world = Pose{design::rotation_by(s.head<3>()), s.tail<3>()} * m.cam_from_world;
        return design::length_residuals(layout, x, m, nullptr, nullptr);
      };
      EXPECT_LT(((moved(kStep) - moved(-kStep)) / (2 * kStep) - pose_jacobian.col(p)).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

TEST(MechanismCalibration, FindsTheTruthWithoutNoise) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    SimulatedOptions options = without_noise(seed);
    options.all_over_the_room = seed % 2 == 0;
    options.largest_gain_error = seed > 2 ? 0.005 : 0;
    const auto mechanism = simulated_mechanism(options);
    MechanismCalibrationOptions how;
    how.gains = seed > 2;
    const auto found = calibrate_mechanism(mechanism.guess, simulated_observations(mechanism, options, 1), how);
    EXPECT_LT(found.length_rms_m, 1e-8);
    EXPECT_TRUE(found.rejected.empty());
    EXPECT_TRUE(found.unobservable.empty()) << found.unobservable.front();
    EXPECT_LT(departure_error_m(found.mechanism, mechanism.truth), 1e-5);
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(found.offsets_m[i], mechanism.offsets_m[i], 1e-5);
      EXPECT_NEAR(found.gains[i], mechanism.gains[i], 1e-6);
    }
    EXPECT_LT(length_error_m(found, simulated_observations(mechanism, options, 2)), 1e-7);
  }
}

TEST(MechanismCalibration, TheGuessDoesNotMatter) {
  SimulatedOptions options;
  const auto mechanism = simulated_mechanism(options);
  const auto observations = simulated_observations(mechanism, options, 1);
  const auto found = calibrate_mechanism(mechanism.guess, observations);
  // Guesses that keep the attachments, whose fit is what the platform's frame is.
  Mechanism other = mechanism.guess;
  for (std::size_t i = 0; i < 6; ++i)
    other.cables[i].departure =
        mechanism.truth.cables[i].departure + Eigen::Vector3d(i % 2 ? 0.06 : -0.04, 0.03, -0.05);
  other.room.extend(Eigen::Vector3d(-6, -7, -2)), other.room.extend(Eigen::Vector3d(6, 7, 7));
  other.cam_from_platform =
      Pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.08, Eigen::Vector3d(1, 2, -1).normalized())), {0.03, -0.05, 0.02}} *
      other.cam_from_platform;
  const auto again = calibrate_mechanism(other, observations);
  EXPECT_EQ(again.rejected, found.rejected);
  EXPECT_LT(departure_error_m(again.mechanism, found.mechanism), 1e-6);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT((again.mechanism.cables[i].attachment - found.mechanism.cables[i].attachment).norm(), 1e-7);
  EXPECT_LT((again.mechanism.cam_from_platform.translation - found.mechanism.cam_from_platform.translation).norm(),
            1e-7);
}

TEST(MechanismCalibration, NewPosesAreMetAndTheCovarianceTellsHowWell) {
  double squares = 0, count = 0, hemisphere = 0, room = 0;
  constexpr int kSeeds = 6;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedOptions options;
    options.seed = seed;
    options.all_over_the_room = seed % 2 == 0;
    const auto mechanism = simulated_mechanism(options);
    const auto found = calibrate_mechanism(mechanism.guess, simulated_observations(mechanism, options, seed));
    EXPECT_NEAR(found.sigma0, 1, 0.15);
    SimulatedOptions clean = options;
    clean.position_noise_m = clean.rotation_noise_rad = 0;
    (options.all_over_the_room ? room : hemisphere) +=
        length_error_m(found, simulated_observations(mechanism, clean, 100 + seed)) / (kSeeds / 2);
    for (std::size_t i = 0; i < 6; ++i)
      for (int k = 0; k < 3; ++k) {
        const std::string name = "departure " + found.mechanism.cables[i].name + (k == 0 ? " x" : k == 1 ? " y" : " z");
        const auto at = std::find(found.parameters.begin(), found.parameters.end(), name) - found.parameters.begin();
        ASSERT_LT(at, found.covariance.rows());
        const double d = found.mechanism.cables[i].departure[k] - mechanism.truth.cables[i].departure[k];
        squares += d * d / found.covariance(at, at), ++count;
      }
  }
  EXPECT_LT(room, 0.1e-3);
  EXPECT_LT(hemisphere, 0.2e-3);
  EXPECT_NEAR(std::sqrt(squares / count), 1, 0.35);
  RecordProperty("room_um", int(1e6 * room));
  RecordProperty("hemisphere_um", int(1e6 * hemisphere));
}

TEST(MechanismCalibration, WrongPosesStayOut) {
  SimulatedOptions options;
  const auto mechanism = simulated_mechanism(options);
  auto observations = simulated_observations(mechanism, options, 1);
  std::vector<std::size_t> wrong;
  for (std::size_t k = 7; k < observations.size(); k += 16) {
    observations[k].cam_from_world.translation += Eigen::Vector3d(0.02, k % 3 ? 0.3 : -0.1, 0.01 * double(k % 5));
    wrong.push_back(k);
  }
  const auto found = calibrate_mechanism(mechanism.guess, observations);
  EXPECT_EQ(found.rejected, wrong);
  SimulatedOptions clean = without_noise(1);
  EXPECT_LT(length_error_m(found, simulated_observations(mechanism, clean, 5)), 0.25e-3);
}

TEST(MechanismCalibration, SaysWhatOneBearingDoesNotTell) {
  SimulatedOptions options = without_noise(1);
  options.groups = 1;
  options.all_over_the_room = true;
  const auto mechanism = simulated_mechanism(options);
  const auto found = calibrate_mechanism(mechanism.guess, simulated_observations(mechanism, options, 1));
  EXPECT_EQ(found.unobservable.size(), 4u);  // where the bearing's axis is: two angles, two shifts
  for (const std::string& words : found.unobservable)
    EXPECT_TRUE(words.find("camera's") != std::string::npos || words.find("attachment") != std::string::npos) << words;
  EXPECT_LT(found.length_rms_m, 1e-8);
  EXPECT_LT(departure_error_m(found.mechanism, mechanism.truth), 1e-5);
  EXPECT_LT(length_error_m(found, simulated_observations(mechanism, options, 2)), 1e-7);
}

TEST(MechanismCalibration, CovariancesWeigh) {
  // As many poses three times as noisy: by least squares the error is sqrt(5 / 1.8) = 1.67 times as large without
  // weights.
  double weighted = 0, plain = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SimulatedOptions options;
    options.seed = seed;
    const auto mechanism = simulated_mechanism(options);
    auto observations = simulated_observations(mechanism, options, 10 + seed);
    SimulatedOptions rough = options;
    rough.position_noise_m *= 3, rough.rotation_noise_rad *= 3;
    for (auto& o : simulated_observations(mechanism, rough, 20 + seed)) observations.push_back(o);
    const auto held_out = simulated_observations(mechanism, without_noise(seed), 30 + seed);
    plain += length_error_m(calibrate_mechanism(mechanism.guess, observations), held_out);
    for (std::size_t k = 0; k < observations.size(); ++k) {
      Eigen::Matrix<double, 6, 6> c = Eigen::Matrix<double, 6, 6>::Zero();
      c.diagonal() << Eigen::Vector3d::Constant(9e-8), Eigen::Vector3d::Constant(25e-8);
      observations[k].covariance = (k < observations.size() / 2 ? 1 : 9) * c;
    }
    const auto found = calibrate_mechanism(mechanism.guess, observations);
    EXPECT_NEAR(found.sigma0, 1, 0.1);
    weighted += length_error_m(found, held_out);
  }
  EXPECT_LT(weighted, 0.85 * plain);
}

TEST(MechanismCalibration, Faults) {
  SimulatedOptions options;
  const auto mechanism = simulated_mechanism(options);
  const auto good = simulated_observations(mechanism, options, 1);
  const auto failing = [&](const std::vector<MechanismObservation>& o) {
    return expect_error([&] { calibrate_mechanism(mechanism.guess, o); });
  };
  EXPECT_EQ(failing({}).code(), ErrorCode::degenerate);
  const Error few = failing({good.begin(), good.begin() + 6});
  EXPECT_EQ(few.code(), ErrorCode::degenerate);
  EXPECT_NE(few.message().find("expected at least"), std::string::npos) << few.what();

  const Error same = failing(std::vector<MechanismObservation>(40, good[0]));
  EXPECT_EQ(same.code(), ErrorCode::degenerate);
  EXPECT_NE(same.message().find("of each other"), std::string::npos) << same.what();

  auto strangers = good;  // lengths of another mechanism: in another order of cables
  for (auto& o : strangers) std::rotate(o.commanded_m.begin(), o.commanded_m.begin() + 1, o.commanded_m.end());
  const Error other = failing(strangers);
  EXPECT_EQ(other.code(), ErrorCode::degenerate);
  EXPECT_NE(other.message().find("do not belong together"), std::string::npos) << other.what();

  auto feet = good;
  for (auto& o : feet)
    for (double& m : o.commanded_m) m /= 0.3048;
  EXPECT_EQ(failing(feet).code(), ErrorCode::degenerate);

  auto broken = good;
  broken[17].commanded_m[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(failing(broken).code(), ErrorCode::bad_input);
  EXPECT_EQ(failing(broken).subject(), "observation p17");
  broken = good, broken[3].cam_from_world.translation.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(failing(broken).subject(), "observation p3");
  broken = good, broken[4].commanded_m.pop_back();
  EXPECT_EQ(failing(broken).subject(), "observation p4");
  broken = good, broken[5].covariance = -Eigen::Matrix<double, 6, 6>::Identity();
  EXPECT_EQ(failing(broken).subject(), "observation p5");

  Mechanism point = mechanism.guess;
  for (Cable& cable : point.cables) cable.attachment.setZero();
  EXPECT_EQ(expect_error([&] { calibrate_mechanism(point, good); }).code(), ErrorCode::invalid_argument);
  MechanismCalibrationOptions wrong;
  wrong.length_sigma_m = 0;
  EXPECT_EQ(expect_error([&] { calibrate_mechanism(mechanism.guess, good, wrong); }).code(),
            ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::capture
