// Cameras through libgphoto2, against a responder on loopback: what is captured, and every way of failing.

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/camera_devices.h>
#include <lumihull/internal/child_process.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

#include "ptpip_responder.h"
#include "support.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using test::PtpIpResponder;
using Fault = PtpIpResponder::Fault;
using Clock = std::chrono::steady_clock;

std::string some_jpeg() {
  Image image(640, 480, 3);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640 * 3; ++x) image.row<std::uint8_t>(y)[x] = std::uint8_t(x * y);
  return encode_jpeg(image, 95);
}

/// Children of this process that still are there, ended or not.
int children() {
  int count = 0;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    std::string line;
    if (!std::getline(stat, line)) continue;
    const auto behind = line.rfind(')');
    if (behind == std::string::npos) continue;
    count += std::atoi(line.c_str() + behind + 4) == ::getpid();
  }
  return count;
}

class GphotoCamera : public ::testing::Test {
 protected:
  void SetUp() override {
    std::error_code error;
    if (!fs::exists(LUMIHULL_GPHOTO_HELPER, error)) GTEST_SKIP() << "needs libgphoto2 (package libgphoto2-dev)";
  }
  void TearDown() override { EXPECT_EQ(children(), 0); }

  GphotoOptions options() const {
    GphotoOptions o;
    o.port = camera.gphoto_port();
    o.model = "PTP/IP Camera";
    o.event_timeout_s = 2;
    o.download_timeout_s = 3;
    return o;
  }
  /// One shot with a fault, then one without: the first ends in bounded time, the second one as if nothing had been.
  ShotOutcome with_fault(Fault fault) {
    const auto device = open_gphoto_camera(options(), job);
    camera.set_fault(fault);
    const auto start = Clock::now();
    const ShotOutcome outcome = device->shoot(1, 0, folder.path(), job);
    EXPECT_LT(Clock::now() - start, std::chrono::seconds(60));  // bounded, not fast
    const int before = camera.exposures();
    EXPECT_EQ(device->recall(1).state, outcome.state);
    if (outcome.state != ShotState::refused) {
      EXPECT_EQ(device->shoot(1, 0, folder.path(), job).state, outcome.state);
      EXPECT_EQ(camera.exposures(), before) << "exposed again";
    }
    camera.set_fault(Fault::none);
    const ShotOutcome next = device->shoot(2, 0, folder.path(), job);
    EXPECT_EQ(next.state, ShotState::done) << next.detail;
    EXPECT_EQ(camera.exposures(), before + 1);
    EXPECT_EQ(next.file, folder / "shot-000002.jpg");
    EXPECT_EQ(content(next.file), taken(before + 1));
    return outcome;
  }

  /// Digests: a picture is no good text for a failure.
  static std::string content(const fs::path& file) { return fs::exists(file) ? sha256_of_file(file) : "no such file"; }
  std::string taken(int exposure) const { return sha256(camera.picture(exposure)); }

  PtpIpResponder camera{some_jpeg()};
  test::TemporaryFolder folder;
  Job job;
};

TEST_F(GphotoCamera, StockGphoto2CapturesFromTheResponder) {
  std::string said;
  const int status = internal::run_child(
      {"env", "HOME=" + folder.path().string(), "gphoto2", "--port", camera.gphoto_port(), "--camera", "PTP/IP Camera",
       "--filename", (folder / "peer.jpg").string(), "--capture-image-and-download"},
      job, [&](const std::string& line) { said += line + "\n"; });
  if (status == 127) GTEST_SKIP() << "needs the program gphoto2";
  EXPECT_EQ(status, 0) << said;
  EXPECT_EQ(camera.exposures(), 1);
  EXPECT_EQ(content(folder / "peer.jpg"), taken(1));
  EXPECT_EQ(camera.objects_left(), 0u);  // it deletes what it has
}

TEST_F(GphotoCamera, CapturesByteForByte) {
  const auto device = open_gphoto_camera(options(), job);
  EXPECT_TRUE(device->delivers_files());
  for (ShotId id = 1; id <= 5; ++id) {
    const ShotOutcome outcome = device->shoot(id, 0.1, folder.path(), job);
    ASSERT_EQ(outcome.state, ShotState::done) << outcome.detail;
    ASSERT_EQ(outcome.file, folder / ("shot-00000" + std::to_string(id) + ".jpg")) << outcome.detail;
    EXPECT_EQ(content(outcome.file), taken(int(id)));
  }
  EXPECT_EQ(camera.exposures(), 5);
  EXPECT_EQ(camera.sessions(), 1);
  EXPECT_EQ(camera.objects_left(), 5u);
  EXPECT_EQ(device->recall(9).state, ShotState::unknown);
}

TEST_F(GphotoCamera, NeverReplacesAFileAndDeletesOnlyWhenTold) {
  write_file(folder / "shot-000001.jpg", "somebody's");
  GphotoOptions o = options();
  o.delete_after_download = true;
  const ShotOutcome outcome = open_gphoto_camera(o, job)->shoot(1, 0, folder.path(), job);
  EXPECT_EQ(outcome.file, folder / "shot-000001-2.jpg") << outcome.detail;
  EXPECT_EQ(read_file(folder / "shot-000001.jpg"), "somebody's");
  EXPECT_EQ(camera.objects_left(), 0u);
}

TEST_F(GphotoCamera, NoWayToWriteKeepsThePictureOnTheCamera) {
  GphotoOptions o = options();
  o.delete_after_download = true;
  const ShotOutcome outcome = open_gphoto_camera(o, job)->shoot(1, 0, folder / "nowhere", job);
  EXPECT_EQ(outcome.state, ShotState::done);
  EXPECT_TRUE(outcome.file.empty());
  EXPECT_THAT(outcome.detail, testing::HasSubstr("stays on the camera"));
  EXPECT_EQ(camera.objects_left(), 1u);
}

TEST_F(GphotoCamera, LostAnnouncementOfThePicture) {
  const ShotOutcome outcome = with_fault(Fault::lose_object_added);
  EXPECT_EQ(outcome.state, ShotState::done);  // the camera said that the exposure is over
  EXPECT_TRUE(outcome.file.empty());
  EXPECT_THAT(outcome.detail, testing::HasSubstr("announced no picture"));
}

TEST_F(GphotoCamera, LostEndOfTheExposure) {
  const ShotOutcome outcome = with_fault(Fault::lose_complete);
  EXPECT_EQ(outcome.state, ShotState::done);
  EXPECT_EQ(content(outcome.file), taken(1));
}

TEST_F(GphotoCamera, SilenceAfterTheRelease) {
  const ShotOutcome outcome = with_fault(Fault::lose_both);
  EXPECT_EQ(outcome.state, ShotState::unknown);
  EXPECT_THAT(outcome.detail, testing::HasSubstr("neither a picture"));
}

TEST_F(GphotoCamera, ALatePictureIsNotTheNextShots) {
  const auto device = open_gphoto_camera(options(), job);
  camera.set_fault(Fault::late_object_added);
  EXPECT_EQ(device->shoot(1, 0, folder.path(), job).state, ShotState::unknown);
  camera.set_fault(Fault::none);
  // The first one's announcement comes with the second one's: which is which can't be told.
  const ShotOutcome outcome = device->shoot(2, 0, folder.path(), job);
  EXPECT_EQ(outcome.state, ShotState::done);
  EXPECT_TRUE(outcome.file.empty());
  EXPECT_THAT(outcome.detail, testing::HasSubstr("can't be told"));
  EXPECT_EQ(device->shoot(3, 0, folder.path(), job).file, folder / "shot-000003.jpg");
}

TEST_F(GphotoCamera, RefusalsMakeNoExposure) {
  for (const Fault fault : {Fault::refuse, Fault::store_full}) {
    const auto device = open_gphoto_camera(options(), job);
    const int before = camera.exposures();
    camera.set_fault(fault);
    const ShotOutcome outcome = device->shoot(1, 0, folder.path(), job);
    EXPECT_EQ(outcome.state, ShotState::refused) << outcome.detail;
    EXPECT_EQ(camera.exposures(), before);
    camera.set_fault(Fault::none);
    EXPECT_EQ(device->shoot(1, 0, folder.path(), job).state, ShotState::done);  // the same number may be tried again
    EXPECT_EQ(camera.exposures(), before + 1);
  }
}

TEST_F(GphotoCamera, AnErrorAfterTheShutterIsClearedByThePicture) {
  const ShotOutcome outcome = with_fault(Fault::fail_after);
  EXPECT_EQ(outcome.state, ShotState::done) << outcome.detail;
  EXPECT_EQ(content(outcome.file), taken(1));
}

TEST_F(GphotoCamera, AnErrorWithoutAPictureIsUnknown) { EXPECT_EQ(with_fault(Fault::fail).state, ShotState::unknown); }

TEST_F(GphotoCamera, HangsAndDiesAndAnswersNoise) {
  for (const Fault fault : {Fault::hang_in_capture, Fault::die_in_capture, Fault::garbage}) {
    SCOPED_TRACE(int(fault));
    const test::TemporaryFolder clean;
    const ShotOutcome outcome = with_fault(fault);
    EXPECT_EQ(outcome.state, ShotState::unknown);
    EXPECT_FALSE(outcome.detail.empty());
    fs::remove(folder / "shot-000002.jpg");
  }
}

TEST_F(GphotoCamera, BrokenDownloadsLeaveNothingHalf) {
  for (const Fault fault : {Fault::hang_in_object, Fault::die_in_object, Fault::short_object, Fault::damaged_jpeg}) {
    SCOPED_TRACE(int(fault));
    const ShotOutcome outcome = with_fault(fault);
    EXPECT_EQ(outcome.state, ShotState::done);
    EXPECT_TRUE(outcome.file.empty());
    EXPECT_THAT(outcome.detail, testing::HasSubstr("stays on the camera"));
    fs::remove(folder / "shot-000002.jpg");
    EXPECT_TRUE(fs::is_empty(folder.path()));
  }
}

TEST_F(GphotoCamera, TwoPicturesForOneReleaseAreNotGuessedAt) {
  const ShotOutcome outcome = with_fault(Fault::two_pictures);
  EXPECT_EQ(outcome.state, ShotState::done);
  EXPECT_TRUE(outcome.file.empty());
  EXPECT_EQ(camera.objects_left(), 3u);
}

TEST_F(GphotoCamera, RawAndJpegAreOnePicture) {
  const ShotOutcome outcome = with_fault(Fault::raw_and_jpeg);
  EXPECT_EQ(outcome.file, folder / "shot-000001.jpg") << outcome.detail;
  EXPECT_EQ(content(folder / "shot-000001.rw2"), sha256("raw " + camera.picture(1))) << outcome.detail;
}

TEST_F(GphotoCamera, NamesFromTheCameraGoNowhere) {
  const ShotOutcome outcome = with_fault(Fault::hostile_name);
  EXPECT_EQ(outcome.state, ShotState::done);
  for (const auto& entry : fs::recursive_directory_iterator(folder.path()))
    EXPECT_THAT(entry.path().filename().string(), testing::StartsWith("shot-00000"));
}

TEST_F(GphotoCamera, ALostCameraRefusesUntilItIsBack) {
  const auto device = open_gphoto_camera(options(), job);
  camera.set_fault(Fault::die_in_capture);
  EXPECT_EQ(device->shoot(1, 0, folder.path(), job).state, ShotState::unknown);
  camera.refuse_connections(true);
  for (int i = 0; i < 4; ++i) {
    const ShotOutcome outcome = device->shoot(2, 0, folder.path(), job);
    EXPECT_EQ(outcome.state, ShotState::refused);
    EXPECT_THAT(outcome.detail, testing::HasSubstr(camera.gphoto_port()));
    EXPECT_EQ(device->recall(2).state, ShotState::refused);
  }
  camera.refuse_connections(false);
  camera.set_fault(Fault::none);
  EXPECT_EQ(device->shoot(2, 0, folder.path(), job).state, ShotState::done);
}

TEST_F(GphotoCamera, OpeningTellsWhatIsWrong) {
  GphotoOptions o = options();
  o.port = "ptpip:127.0.0.1:1";
  EXPECT_EQ(test::expect_error([&] { open_gphoto_camera(o, job); }).code(), ErrorCode::io);
  o = options();
  o.model = "No such camera\nand more";
  EXPECT_THAT(test::expect_error([&] { open_gphoto_camera(o, job); }).what(), testing::HasSubstr("can't be opened"));
  o = options();
  o.helper = folder / "no-helper";
  EXPECT_EQ(test::expect_error([&] { open_gphoto_camera(o, job); }).code(), ErrorCode::not_found);
  o = options();
  o.event_timeout_s = 0;
  EXPECT_EQ(test::expect_error([&] { open_gphoto_camera(o, job); }).code(), ErrorCode::invalid_argument);
  Job stopped;
  stopped.cancel();
  EXPECT_EQ(test::expect_error([&] { open_gphoto_camera(options(), stopped); }).code(), ErrorCode::cancelled);
}

TEST_F(GphotoCamera, MadeSafeItComesBack) {
  const auto device = open_gphoto_camera(options(), job);
  device->make_safe();
  EXPECT_EQ(children(), 0);
  EXPECT_EQ(device->shoot(1, 0, folder.path(), job).state, ShotState::done);
}

TEST_F(GphotoCamera, CamerasOnUsbAreLookedFor) { EXPECT_NO_THROW(find_gphoto_cameras(job)); }

/// A helper program that misbehaves in ways that libgphoto2 did not show here.
TEST_F(GphotoCamera, EveryFalseHelperIsEnded) {
  const std::vector<std::string> scripts{
      "exit 0",
      "sleep 600",
      "echo hello 2; sleep 600",
      "echo hello 1; sleep 600",
      "echo hello 1; while read l; do echo %zz; done",
      "echo hello 1; while read l; do head -c 100000 /dev/zero; done",
      "echo hello 1; while :; do echo ok x; done",
      "trap '' TERM; echo hello 1; read l; echo error no; sleep 600",
  };
  for (const std::string& script : scripts) {
    SCOPED_TRACE(script);
    const fs::path program = folder / "helper";
    write_file(program, "#!/bin/sh\n" + script + "\n");
    fs::permissions(program, fs::perms::owner_all);
    GphotoOptions o = options();
    o.helper = program;
    o.open_timeout_s = o.event_timeout_s = o.download_timeout_s = 0.5;
    try {
      const auto device = open_gphoto_camera(o, job);
      for (ShotId id = 1; id < 4; ++id) {
        const ShotOutcome outcome = device->shoot(id, 0, folder.path(), job);
        EXPECT_TRUE(outcome.file.empty());
      }
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::io) << e.what();
    }
    EXPECT_EQ(children(), 0);
  }
}

TEST_F(GphotoCamera, AKilledParentLeavesNoHelper) {
  // A hanging camera, and a parent that is killed in the middle of it.
  camera.set_fault(Fault::hang_in_capture);
  const test::TemporaryFolder out;
  const pid_t parent = ::fork();
  if (parent == 0) {
    ::setenv("LUMIHULL_TEST_ORPHAN", "1", 1);
    Job own;
    try {
      open_gphoto_camera(options(), own)->shoot(1, 60, out.path(), own);
    } catch (...) {
    }
    ::_exit(0);
  }
  while (camera.exposures() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const auto helpers = [&] {
    int count = 0;
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::ifstream line(entry.path() / "cmdline"), environment(entry.path() / "environ");
      std::string command, all;
      std::getline(line, command, '\0');
      std::getline(environment, all);
      count += command.find("lumihull-gphoto2") != std::string::npos &&
               all.find("LUMIHULL_TEST_ORPHAN=1") != std::string::npos;
    }
    return count;
  };
  EXPECT_EQ(helpers(), 1);
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  for (int i = 0; i < 200 && helpers() > 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(helpers(), 0);
}

}  // namespace
}  // namespace lumihull::capture
