// `lumihull ingest`: a journal with shots that are done, in doubt and missing, and the card that goes with it.

#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/session.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "../base/picture_files.h"
#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using capture::EventKind;

/// The journal's own time, 7 s later, as EXIF has it.
std::pair<std::string, std::string> camera_time(const std::string& utc) {
  const int seconds = std::stoi(utc.substr(14, 2)) * 60 + std::stoi(utc.substr(17, 2)) + 7;  // of the hour
  const int hour = std::stoi(utc.substr(11, 2)) + seconds / 3600;
  char text[32];
  std::snprintf(text, sizeof text, "%s:%s:%s %02d:%02d:%02d", utc.substr(0, 4).c_str(), utc.substr(5, 2).c_str(),
                utc.substr(8, 2).c_str(), hour % 24, seconds / 60 % 60, seconds % 60);
  return {text, utc.substr(20, 2)};
}

TEST(IngestVerb, LandsWhatIsOnTheCard) {
  const test::TemporaryFolder folder;
  const fs::path capture_folder = folder / "capture", card = folder / "card";
  fs::create_directories(capture_folder);
  fs::create_directories(card / "DCIM/100LUMIX");
  constexpr int kShots = 14, kMissing = 4, kUnknownMade = 7, kUnknownNot = 9;

  capture::Plan plan;
  plan.robot = "hand";
  plan.cameras = {"main"};
  capture::JournalHead head{"", "{stop}-{camera}", {}, {"main"}, {}};
  for (int i = 0; i < kShots; ++i) {
    capture::PlannedStop stop;
    stop.name = "s" + std::to_string(i);
    plan.stops.push_back(stop);
    head.stops.push_back(stop.name);
  }
  capture::write_plan(plan, capture::plan_path(capture_folder));
  head.plan_sha256 = sha256_of_file(capture::plan_path(capture_folder));
  std::vector<std::string> pictures(kShots);
  {
    capture::Journal journal = capture::Journal::create(capture::journal_path(capture_folder), head);
    journal.append({.kind = EventKind::session, .text = "a test"});
    for (int i = 0; i < kShots; ++i) {
      const auto id = capture::ShotId(i + 1);
      const std::string& stop = head.stops[std::size_t(i)];
      journal.append({.kind = EventKind::moving, .stop = stop});
      journal.append({.kind = EventKind::arrived, .stop = stop});
      journal.append({.kind = EventKind::firing, .stop = stop, .camera = "main", .shot = id});
      const std::string time = journal.state().shots[std::size_t(i)].take.time;
      if (i == kUnknownMade || i == kUnknownNot)
        journal.append({.kind = EventKind::unknown, .shot = id, .text = "lost"});
      else
        journal.append({.kind = EventKind::done, .shot = id});
      test::ExifBuilder exif;
      exif.ascii(true, 0x9003, camera_time(time).first);
      exif.ascii(true, 0x9291, camera_time(time).second);
      Image image(16, 8, 3);
      image.row<std::uint8_t>(0)[0] = std::uint8_t(i * 16);
      pictures[std::size_t(i)] = test::jpeg_with_exif(encode_jpeg(image), exif.tiff()) + std::to_string(i);
      char name[32];
      std::snprintf(name, sizeof name, "P100%04d.JPG", i + 1);
      if (i != kMissing && i != kUnknownNot) write_file(card / "DCIM/100LUMIX" / name, pictures[std::size_t(i)]);
      if (i == 2) write_file(card / "DCIM/100LUMIX/P1000003.RW2", "raw");
      std::this_thread::sleep_for(std::chrono::milliseconds(1500 + (i * 7919) % 1000));
    }
  }

  const auto landed = [&] {
    const auto state = capture::read_journal(capture::journal_path(capture_folder));
    return state.count(capture::ShotStep::landed);
  };
  test::Outcome run = test::lumihull({"ingest", capture_folder, card, "--dry-run"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(landed(), 0u);
  EXPECT_FALSE(fs::exists(capture_folder / "photos"));

  run = test::lumihull({"ingest", capture_folder, card, "--again", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json["landed"], kShots - 2);
  EXPECT_EQ(json["missing"][0]["stop"], "s" + std::to_string(kMissing));
  EXPECT_EQ(json["not_made"][0]["stop"], "s" + std::to_string(kUnknownNot));
  EXPECT_NEAR(json["clocks"][0]["offset_s"].get<double>(), 7, 0.5);
  for (int i = 0; i < kShots; ++i) {
    const fs::path file = capture_folder / "photos" / ("s" + std::to_string(i) + "-main.JPG");
    ASSERT_EQ(fs::exists(file), i != kMissing && i != kUnknownNot) << i;
    if (fs::exists(file)) {
      EXPECT_EQ(read_file(file), pictures[std::size_t(i)]);
    }
  }
  EXPECT_EQ(read_file(capture_folder / "photos/s2-main.RW2"), "raw");
  const auto state = capture::read_journal(capture::journal_path(capture_folder));
  EXPECT_EQ(state.shots[kMissing].step, capture::ShotStep::waiting);
  EXPECT_EQ(state.shots[kUnknownNot].step, capture::ShotStep::waiting);
  EXPECT_EQ(Capture::open(capture_folder).shots.size(), std::size_t(kShots - 2));

  run = test::lumihull({"ingest", capture_folder, card});  // again: nothing is left to do
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(landed(), std::size_t(kShots - 2));

  run = test::lumihull({"ingest", capture_folder, folder / "nowhere"});
  EXPECT_EQ(run.status, 1);
  EXPECT_NE(run.err.find("no such folder"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace lumihull
