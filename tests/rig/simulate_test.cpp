// A whole session of the virtual rig, from plan to poses, against its truth.
#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/calibrate_capture.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/capture/session.h>
#include <lumihull/rig/simulate.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/SVD>
#include <cmath>
#include <csignal>
#include <thread>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

namespace fs = std::filesystem;

SimulateOptions small() {
  SimulateOptions o;
  o.object = "box";
  o.size_m = .3;
  o.photos = 10;
  o.width = 900;
  o.circle_px = 6.5, o.density = .06;
  o.empty_photos = 2, o.lens_photos = 2;
  o.light = test::coarse_light();
  o.photo.reduce = 3, o.photo.blur_px = .6;
  return o;
}

/// The rigid motion that takes calibrated places to true ones (Kabsch), and how well the poses then agree.
struct Agreement {
  double position_rms_m = 0, rotation_rms_rad = 0;
};
Agreement compare(const Capture& capture, const std::vector<std::optional<ExposureRecord>>& truth) {
  const std::size_t n = capture.shots.size();
  Eigen::Vector3d from(0, 0, 0), to(0, 0, 0);
  for (std::size_t i = 0; i < n; ++i)
    from += capture.shots[i].cam_from_world->center() / double(n), to += truth[i]->cam_from_world.center() / double(n);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < n; ++i)
    sum += (truth[i]->cam_from_world.center() - to) * (capture.shots[i].cam_from_world->center() - from).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
  if (turn.determinant() < 0) turn = svd.matrixU() * Eigen::Vector3d(1, 1, -1).asDiagonal() * svd.matrixV().transpose();
  const Pose truth_from_capture = Pose::from_matrix(turn, to - turn * from);
  Agreement out;
  for (std::size_t i = 0; i < n; ++i) {
    const Pose measured = *capture.shots[i].cam_from_world * truth_from_capture.inverse();
    const Pose& exact = truth[i]->cam_from_world;
    out.position_rms_m += (measured.center() - exact.center()).squaredNorm() / double(n);
    const double angle = measured.rotation.angularDistance(exact.rotation);
    out.rotation_rms_rad += angle * angle / double(n);
  }
  out.position_rms_m = std::sqrt(out.position_rms_m), out.rotation_rms_rad = std::sqrt(out.rotation_rms_rad);
  return out;
}

std::vector<std::optional<ExposureRecord>> truth_of(const fs::path& folder, const Capture& capture) {
  std::vector<std::optional<ExposureRecord>> truth;
  for (const Shot& shot : capture.shots) truth.push_back(read_exposure(folder / "truth", shot.commanded->id));
  return truth;
}

TEST(Simulate, MakesACaptureThatCalibrates) {
  const test::TemporaryFolder folder;
  Job job;
  const Simulated made = simulate(folder / "c", small(), job);
  EXPECT_EQ(made.photographs, 10u);
  EXPECT_EQ(made.taken, 10u);
  EXPECT_EQ(made.carrier, "cables");
  EXPECT_GE(made.least_targets, 5);

  Capture capture = Capture::open(folder / "c");
  ASSERT_EQ(capture.shots.size(), 10u);
  EXPECT_EQ(capture.enclosure.size(), 2u);
  EXPECT_EQ(capture.unit, Unit::unknown);
  const auto truth = truth_of(folder / "c", capture);
  const calib::TargetDetector detector(calib::TargetSet::load(folder / "c" / "sheets.json"));
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    SCOPED_TRACE(capture.shots[i].name);
    ASSERT_TRUE(truth[i].has_value());
    EXPECT_FALSE(capture.shots[i].cam_from_world) << "nobody told";
    // Commanded and true differ as a robot's do.
    const double off = (truth[i]->cam_from_world.center() - capture.shots[i].commanded->cam_from_world.center()).norm();
    EXPECT_GT(off, 1e-4);
    EXPECT_LT(off, .2);
    EXPECT_EQ(capture.shots[i].commanded->settle_s, 7);
    EXPECT_LT(truth[i]->sway_px, 1) << "it was waited for";
    const Eigen::Vector3d up = truth[i]->cam_from_world.rotation * Eigen::Vector3d::UnitZ();
    if (std::fabs(up.z()) < .8) {
      EXPECT_EQ(capture.shots[i].orientation, up.x() < 0 ? 6 : 8) << "portrait";
    }
    EXPECT_TRUE(fs::exists(folder / "c" / "truth" / "masks" / (capture.shots[i].name + ".png")));
    EXPECT_GE(detector.detect(capture.read_photo(i), job).targets.size(), 5u);  // paper, 3.1
  }
  EXPECT_TRUE(fs::exists(folder / "c" / "lens" / "board.json"));
  EXPECT_TRUE(fs::exists(folder / "c" / "truth" / "cameras.json"));

  calib::CalibrateCaptureOptions options;
  options.targets = (folder / "c" / "sheets.json").string();
  calib::calibrate_capture(capture, options, job);
  for (const Shot& shot : capture.shots) ASSERT_TRUE(shot.cam_from_world) << shot.name;
  const Agreement agreement = compare(capture, truth);
  RecordProperty("position_um", int(1e6 * agreement.position_rms_m));
  // A quarter of the paper's pixels a side, nine photographs, circles of 7 px at most.
  EXPECT_LT(agreement.position_rms_m, .0015);
  EXPECT_LT(agreement.rotation_rms_rad, .001);
  EXPECT_NEAR(capture.cameras[0].f, sensor_camera(900, 18).f, .003 * capture.cameras[0].f);

  // The same command again has nothing to do; with other options it is refused.
  EXPECT_EQ(simulate(folder / "c", small(), job).taken, 0u);
  SimulateOptions other = small();
  other.seed = 2;
  EXPECT_EQ(test::expect_error([&] { simulate(folder / "c", other, job); }).code(), ErrorCode::invalid_argument);
}

/// A session in a process of its own that is killed after a while; whether it was.
bool killed(const fs::path& folder, const SimulateOptions& options, int after_ms) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      Job job({}, 1);
      simulate(folder, options, job);
    } catch (...) {
      _exit(1);
    }
    _exit(0);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
  ::kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0);
  return WIFSIGNALED(status);
}

TEST(Simulate, GoesOnAfterAKillWithTheSamePhotographs) {
  const test::TemporaryFolder folder;
  SimulateOptions o = small();
  o.photos = 6, o.width = 240, o.circle_px = 4, o.least_targets = 0, o.empty_photos = 1, o.lens_photos = 1;
  Job job;
  simulate(folder / "whole", o, job);
  int kills = 0;
  for (int i = 0; i < 12; ++i) kills += killed(folder / "killed", o, 40 + 60 * i);
  EXPECT_GT(kills, 1);
  simulate(folder / "killed", o, job);
  const Capture whole = Capture::open(folder / "whole"), again = Capture::open(folder / "killed");
  ASSERT_EQ(whole.shots.size(), 6u);
  ASSERT_EQ(again.shots.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(whole.shots[i].name, again.shots[i].name);
    // To the byte: the same pixels, taken at the same time by the rig's clock.
    EXPECT_EQ(sha256_of_file(whole.folder() / whole.shots[i].file),
              sha256_of_file(again.folder() / again.shots[i].file))
        << whole.shots[i].name << ' ' << whole.shots[i].time << ' ' << again.shots[i].time;
  }
  for (const char* file :
       {"sheets.json", "truth/cameras.json", "truth/targets.json", "lens/board_0001.jpg", "enclosure/empty_0001.jpg"})
    EXPECT_EQ(sha256_of_file(folder / "whole" / file), sha256_of_file(folder / "killed" / file)) << file;
  for (const Shot& shot : whole.shots) {
    const std::string mask = "truth/masks/" + shot.name + ".png";
    EXPECT_EQ(sha256_of_file(folder / "whole" / mask), sha256_of_file(folder / "killed" / mask)) << shot.name;
  }
}

TEST(Simulate, EveryViewOfThePlanDecodesFiveTargets) {
  for (const double density : {.01, .1}) {
    SimulateOptions o = small();
    o.object = "bust", o.size_m = .7;
    o.photos = 40, o.width = 1536, o.circle_px = 0, o.density = density;
    Job job;
    const RigSession session = plan_session(o, std::nullopt, job);
    const TargetSights sights(session.scene);
    const RigRobot robot(session.plan, {session.errors, {}, false});
    RoomTargets before = scatter_targets(session.scene, session.lens.camera, session.radius_m,
                                         {.circle_px = 9, .density = density, .seed = 1});
    int photographs = 0, poor_before = 0;
    for (const capture::PlannedStop& stop : session.plan.stops) {
      if (!stop.photograph) continue;
      ++photographs;
      for (const Pose& pose : {stop.cam_from_world, robot.foreseen(stop).cam_from_world}) {
        const View view{session.lens.camera, pose * session.world_from_plan.inverse()};
        EXPECT_GE(sights.decodable(view, session.targets).size(), 5u) << stop.name << " at density " << density;
        poor_before += sights.decodable(view, before).size() < 5;
      }
    }
    EXPECT_EQ(photographs, 40);
    EXPECT_GE(session.least_targets, 5);
    if (density < .05) {
      EXPECT_GT(poor_before, 0) << "the sheets that were added were not needed";
    }
  }
}

TEST(Simulate, ToldCamerasAreTheTrueOnes) {
  const test::TemporaryFolder folder;
  SimulateOptions o = small();
  o.photos = 4, o.width = 120, o.sheets = false, o.known_cameras = true, o.carrier = Carrier::hand;
  o.empty_photos = 0, o.lens_photos = 0, o.test_views = 2, o.depth = true, o.photo.reduce = 1;
  Job job;
  const Simulated made = simulate(folder / "c", o, job);
  EXPECT_EQ(made.carrier, "hand");
  const Capture capture = Capture::open(folder / "c");
  EXPECT_EQ(capture.unit, Unit::metres);
  const auto truth = truth_of(folder / "c", capture);
  ASSERT_EQ(capture.shots.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT((capture.shots[i].cam_from_world->matrix() - truth[i]->cam_from_world.matrix()).norm(), 1e-12);
    EXPECT_EQ(fs::file_size(folder / "c" / "truth" / "depth" / (capture.shots[i].name + ".depth")), 120u * 80 * 4);
  }
  EXPECT_FALSE(fs::exists(folder / "c" / "sheets.json"));
  EXPECT_TRUE(fs::exists(folder / "c" / "truth" / "test_views" / "test_0002.png"));
  EXPECT_TRUE(fs::exists(folder / "c" / "truth" / "test_views.json"));
}

TEST(Simulate, OptionsAreChecked) {
  const test::TemporaryFolder folder;
  Job job;
  for (const auto& spoil :
       {+[](SimulateOptions& o) { o.photos = 0; }, +[](SimulateOptions& o) { o.width = 3; },
        +[](SimulateOptions& o) { o.size_m = NAN; }, +[](SimulateOptions& o) { o.jpeg_quality = 0; },
        +[](SimulateOptions& o) { o.object = "nothing"; }, +[](SimulateOptions& o) { o.density = 1; },
        +[](SimulateOptions& o) { o.focal_mm = 0; }, +[](SimulateOptions& o) { o.errors.winch_m = -1; },
        +[](SimulateOptions& o) { o.photo.exposure = 0; }, +[](SimulateOptions& o) { o.photo.f_number = -1; },
        +[](SimulateOptions& o) { o.circle_px = 900, o.least_targets = 0; },
        +[](SimulateOptions& o) { o.radius_m = 2.99, o.room_radius_m = 2; },
        +[](SimulateOptions& o) { o.radius_m = 4, o.carrier = Carrier::cables; }}) {
    SimulateOptions o = small();
    spoil(o);
    EXPECT_EQ(test::expect_error([&] { simulate(folder / "x", o, job); }).code(), ErrorCode::invalid_argument);
    EXPECT_FALSE(fs::exists(folder / "x")) << "nothing is made of what can't be";
  }
  write_file(folder / "something", "");
  EXPECT_EQ(test::expect_error([&] { simulate(folder / ".", small(), job); }).code(), ErrorCode::invalid_argument);
  // A file in the folder's place, and in the way to it.
  EXPECT_EQ(test::expect_error([&] { simulate(folder / "something", small(), job); }).code(),
            ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { simulate(folder / "something" / "x", small(), job); }).code(), ErrorCode::io);
}

}  // namespace
}  // namespace lumihull::rig
