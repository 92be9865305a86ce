#include <lumihull/base/files.h>
#include <lumihull/capture/journal.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <random>

#include "session_scene.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

JournalHead head() {
  return {std::string(64, '0'), "{stop}-{camera}", {"s0", "s1", "via", "s2"}, {"left", "right"}, {"via"}};
}

/// What two states have in common, as far as a reader can see.
void expect_same(const JournalState& a, const JournalState& b) {
  ASSERT_EQ(a.shots.size(), b.shots.size());
  EXPECT_EQ(a.events, b.events);
  EXPECT_EQ(a.sessions, b.sessions);
  EXPECT_EQ(a.at_stop, b.at_stop);
  EXPECT_EQ(a.arrived_at, b.arrived_at);
  EXPECT_EQ(a.moving, b.moving);
  EXPECT_EQ(a.last_id, b.last_id);
  EXPECT_EQ(a.files, b.files);
  for (std::size_t i = 0; i < a.shots.size(); ++i) {
    EXPECT_EQ(a.shots[i].step, b.shots[i].step);
    EXPECT_EQ(a.shots[i].detail, b.shots[i].detail);
    EXPECT_EQ(a.shots[i].take.shot, b.shots[i].take.shot);
    EXPECT_EQ(a.shots[i].take.attempts, b.shots[i].take.attempts);
    EXPECT_EQ(a.shots[i].take.time, b.shots[i].take.time);
    EXPECT_EQ(a.shots[i].take.lengths_m, b.shots[i].take.lengths_m);
    EXPECT_EQ(a.shots[i].take.settle_s, b.shots[i].take.settle_s);
    ASSERT_EQ(a.shots[i].landed.size(), b.shots[i].landed.size());
    for (std::size_t k = 0; k < a.shots[i].landed.size(); ++k) {
      EXPECT_EQ(a.shots[i].landed[k].file, b.shots[i].landed[k].file);
      EXPECT_EQ(a.shots[i].landed[k].sha256, b.shots[i].landed[k].sha256);
      EXPECT_EQ(a.shots[i].landed[k].size, b.shots[i].landed[k].size);
    }
  }
}

/// An event that may or may not follow.
JournalEvent any_event(std::mt19937& random) {
  const auto pick = [&](unsigned n) { return unsigned(random() % n); };
  JournalEvent e;
  e.kind = EventKind(1 + pick(16));
  e.stop = std::vector<std::string>{"s0", "s1", "via", "s2", "nowhere"}[pick(5)];
  e.camera = pick(2) ? "left" : "right";
  e.shot = pick(20);
  e.settle_s = pick(100) / 7.0;
  e.exposure_s = pick(100) / 3.0;
  if (pick(2)) e.lengths_m = {pick(1000) / 999.0, 1.0 / 3};
  e.file = "p" + std::to_string(pick(30)) + ".jpg";
  e.sha256 = std::string(64, "0123456789abcdef"[pick(16)]);
  e.size = random();
  e.answer = pick(2) ? "again" : "taken";
  e.text = std::vector<std::string>{"", "a \"word\"", "two\nlines", "Ω", std::string("nul\0in", 6)}[pick(5)];
  return e;
}

/// A journal of `n` events that could follow, of many that were tried.
std::vector<JournalState> random_journal(const fs::path& file, std::uint32_t seed, std::size_t n) {
  std::mt19937 random(seed);
  Journal journal = Journal::create(file, head());
  std::vector<JournalState> states{journal.state()};
  while (states.size() <= n) {
    try {
      journal.append(any_event(random));
      states.push_back(journal.state());
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::internal);
      expect_same(journal.state(), states.back());  // what can't follow changes nothing
    }
  }
  return states;
}

TEST(Journal, WhatIsReadIsWhatWasAppended) {
  const test::TemporaryFolder folder;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const fs::path file = folder / ("j" + std::to_string(seed));
    const auto states = random_journal(file, seed, 60);
    expect_same(read_journal(file), states.back());
    Journal again = Journal::open(file);
    expect_same(again.state(), states.back());
    again.append({.kind = EventKind::session, .text = "goes on"});
    EXPECT_EQ(read_journal(file).events, states.back().events + 1);
  }
}

TEST(Journal, ATornLastLineIsDroppedAtAnyByte) {
  const test::TemporaryFolder folder;
  const auto states = random_journal(folder / "whole", 7, 25);
  const std::string whole = read_file(folder / "whole");
  std::size_t lines = 0;
  for (std::size_t length = 0; length < whole.size(); ++length) {
    if (length && whole[length - 1] == '\n') ++lines;
    if (lines == 0) continue;
    std::ofstream(folder / "torn", std::ios::binary) << whole.substr(0, length);
    expect_same(read_journal(folder / "torn"), states[lines - 1]);
  }
  // What never reached the disk reads as NUL, whether or not the line's end did.
  const std::size_t start = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t from = start; from < whole.size() - 1; from += 7) {
    std::string text = whole;
    text.replace(from, 5, std::string(std::min<std::size_t>(5, text.size() - 1 - from), '\0'));
    std::ofstream(folder / "torn", std::ios::binary) << text;
    expect_same(read_journal(folder / "torn"), states[states.size() - 2]);
  }
  // Opening takes it off, and what is appended then stands behind a whole line.
  std::ofstream(folder / "torn", std::ios::binary) << whole << "{\"n\":27,\"tim";
  Journal::open(folder / "torn").append({.kind = EventKind::session});
  EXPECT_EQ(read_journal(folder / "torn").events, states.back().events + 1);
}

TEST(Journal, EveryFlippedBitIsSeen) {
  const test::TemporaryFolder folder;
  random_journal(folder / "whole", 3, 12);
  const std::string whole = read_file(folder / "whole");
  std::size_t seen = 0;
  for (std::size_t i = 0; i + 1 < whole.size(); ++i)
    for (const int bit : {0, 3, 7}) {
      std::string text = whole;
      text[i] = char(text[i] ^ (1 << bit));
      std::ofstream(folder / "damaged", std::ios::binary) << text;
      try {
        const JournalState state = read_journal(folder / "damaged");
        // Only a NUL in the last line looks like a page that never reached the disk.
        EXPECT_EQ(text[i], '\0') << i;
        EXPECT_LT(state.events, 13u);
      } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::bad_input);
        EXPECT_THAT(e.subject(), HasSubstr("damaged line "));
        ++seen;
      }
    }
  EXPECT_GT(seen, 3 * (whole.size() - 2) - 50);
}

TEST(Journal, LinesLostDoubledOrMovedAreSeen) {
  const test::TemporaryFolder folder;
  random_journal(folder / "whole", 5, 10);
  std::vector<std::string> lines;
  std::istringstream in(read_file(folder / "whole"));
  for (std::string line; std::getline(in, line);) lines.push_back(line + "\n");
  const auto read = [&](const std::vector<std::string>& changed) {
    std::ofstream out(folder / "changed", std::ios::binary);
    for (const std::string& line : changed) out << line;
    out.close();
    return test::expect_error([&] { read_journal(folder / "changed"); });
  };
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    auto lost = lines, doubled = lines, moved = lines;
    lost.erase(lost.begin() + std::ptrdiff_t(i));
    doubled.insert(doubled.begin() + std::ptrdiff_t(i), lines[i]);
    std::swap(moved[i], moved[i + 1]);
    for (const auto& changed : {lost, doubled, moved}) EXPECT_EQ(read(changed).code(), ErrorCode::bad_input) << i;
  }
}

TEST(Journal, TheFilesFaultsAreNamed) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(test::expect_error([&] { read_journal(folder / "none"); }).code(), ErrorCode::not_found);
  EXPECT_EQ(test::expect_error([&] { Journal::open(folder / "none"); }).code(), ErrorCode::not_found);
  EXPECT_EQ(test::expect_error([&] { Journal::create(folder / "no" / "where", head()); }).code(), ErrorCode::not_found);
  std::ofstream(folder / "empty");
  EXPECT_EQ(test::expect_error([&] { read_journal(folder / "empty"); }).code(), ErrorCode::not_found);
  Journal::create(folder / "j", head());
  EXPECT_EQ(test::expect_error([&] { Journal::create(folder / "j", head()); }).code(), ErrorCode::invalid_argument);
  JournalHead twice = head();
  twice.stops.push_back("s0");
  EXPECT_EQ(test::expect_error([&] { Journal::create(folder / "k", twice); }).code(), ErrorCode::invalid_argument);
}

TEST(Journal, AFullDiskLeavesItAsItWas) {
  const test::TemporaryFolder folder;
  Journal journal = Journal::create(folder / "j", head());
  journal.append({.kind = EventKind::session, .text = "before"});
  const JournalState before = journal.state();
  const auto size = fs::file_size(folder / "j");
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const rlimit tight{size + 20, old.rlim_max};
  setrlimit(RLIMIT_FSIZE, &tight);
  const Error e = test::expect_error([&] { journal.append({.kind = EventKind::moving, .stop = "s1"}); });
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(e.code(), ErrorCode::io);
  expect_same(journal.state(), before);
  EXPECT_EQ(fs::file_size(folder / "j"), size);
  journal.append({.kind = EventKind::moving, .stop = "s1"});  // there is room again
  expect_same(read_journal(folder / "j"), journal.state());
  EXPECT_EQ(journal.state().at_stop, 1u);
}

}  // namespace
}  // namespace lumihull::capture
