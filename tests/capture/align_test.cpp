// Pictures to shots: invented captures of which the truth is known.

#include <lumihull/capture/ingest.h>

#include <set>

#include "card_history.h"
#include "support.h"

namespace lumihull::capture {
namespace {

using test::any_history;
using test::History;
using test::HistoryOptions;
using test::make_history;

struct Count {
  std::size_t of_shots = 0, right = 0, wrong = 0, open = 0, lost = 0;
};

/// Compares with the truth; checks that every shot and picture is told of once.
Count compare(const History& h, const Alignment& a) {
  Count c;
  std::multiset<std::size_t> pictures(a.extra.begin(), a.extra.end()), shots(a.missing.begin(), a.missing.end());
  shots.insert(a.not_made.begin(), a.not_made.end());
  for (const PictureOfShot& m : a.matches) {
    (h.shot_of[m.picture] == std::ptrdiff_t(m.shot) ? c.right : c.wrong)++;
    pictures.insert(m.picture);
    shots.insert(m.shot);
  }
  for (const Ambiguity& g : a.ambiguous) {
    pictures.insert(g.pictures.begin(), g.pictures.end());
    shots.insert(g.shots.begin(), g.shots.end());
    EXPECT_FALSE(g.why.empty());
    for (const std::size_t p : g.pictures) c.open += h.shot_of[p] >= 0;
  }
  for (const std::size_t p : a.extra) c.lost += h.shot_of[p] >= 0;
  for (std::size_t p = 0; p < h.pictures.size(); ++p) {
    EXPECT_EQ(pictures.count(p), 1u) << "picture " << p;
    c.of_shots += h.shot_of[p] >= 0;
  }
  for (std::size_t s = 0; s < h.shots.size(); ++s)
    EXPECT_EQ(shots.count(s), h.shots[s].state == ShotState::refused ? 0u : 1u) << "shot " << s;
  return c;
}

class Align : public ::testing::Test {
 protected:
  Alignment align(const History& h, const AlignOptions& options = {}) {
    return align_pictures(h.shots, h.pictures, options, job);
  }
  Job job;
};

TEST_F(Align, NoPictureIsEverGivenToTheWrongShot) {
  Count irregular, regular;
  for (std::uint64_t seed = 0; seed < 2500; ++seed) {
    SCOPED_TRACE(seed);
    const HistoryOptions o = any_history(seed, 120);
    const History h = make_history(o, seed);
    const Count c = compare(h, align(h));
    ASSERT_EQ(c.wrong, 0u);
    Count& sum = o.rhythm == 1 ? regular : irregular;
    sum.of_shots += c.of_shots;
    sum.right += c.right;
    sum.open += c.open;
    sum.lost += c.lost;
  }
  // To say nothing would be easy: most are found. Shots that follow each other like clockwork are another matter, for
  // there a missing first picture and a missing last one look the same.
  EXPECT_GT(double(irregular.right), 0.9 * double(irregular.of_shots));
  EXPECT_GT(double(regular.right), 0.4 * double(regular.of_shots));
  EXPECT_LT(double(irregular.lost), 0.005 * double(irregular.of_shots));
}

TEST_F(Align, ASoundCardIsMatchedWhole) {
  for (int rhythm : {0, 1, 2}) {
    const History h = make_history({.shots = 600, .rhythm = rhythm, .offset_s = -7.5e6, .drift_ppm = 60}, 5);
    const Alignment a = align(h);
    EXPECT_EQ(compare(h, a).right, 600u) << rhythm;
    ASSERT_EQ(a.clocks.size(), 1u);
    EXPECT_NEAR(a.clocks[0].offset_s, -7.5e6 + 0.2, 0.3);  // and the shutter's lag
    EXPECT_LT(a.residual_s, 0.45);
  }
}

TEST_F(Align, DriftIsFound) {
  const History h = make_history({.shots = 800, .missing = 0.02, .extra = 0.02, .drift_ppm = 200}, 6);
  const Alignment a = align(h);
  EXPECT_EQ(compare(h, a).wrong, 0u);
  EXPECT_NEAR(a.drift_ppm, 200, 10);
}

TEST_F(Align, AMissingAndAnExtraPictureAreNamedAndShiftNothing) {
  History h = make_history({.shots = 200}, 7);
  h.pictures.erase(h.pictures.begin() + 60);
  h.shot_of.erase(h.shot_of.begin() + 60);
  CardPicture extra = h.pictures[120];
  extra.counter = 9000;
  *extra.clock_s += 4;
  h.pictures.insert(h.pictures.begin() + 121, extra);
  h.shot_of.insert(h.shot_of.begin() + 121, -1);
  const Alignment a = align(h);
  EXPECT_EQ(a.missing, std::vector<std::size_t>{60});
  EXPECT_EQ(a.extra, std::vector<std::size_t>{121});
  EXPECT_EQ(compare(h, a).right, 199u);
}

TEST_F(Align, ShotsInDoubtAreResolved) {
  const History h = make_history({.shots = 300, .unknown = 0.3}, 8);
  const Alignment a = align(h);
  EXPECT_EQ(compare(h, a).right, h.pictures.size());
  EXPECT_TRUE(a.missing.empty());
  const std::set<std::ptrdiff_t> made(h.shot_of.begin(), h.shot_of.end());
  EXPECT_EQ(a.not_made.size(), 300 - h.pictures.size());
  for (const std::size_t s : a.not_made) EXPECT_FALSE(made.count(std::ptrdiff_t(s)));
}

TEST_F(Align, ARefusedShotHasNoPicture) {
  History h = make_history({.shots = 50}, 9);
  h.shots[20].state = ShotState::refused;
  h.pictures.erase(h.pictures.begin() + 20);
  h.shot_of.erase(h.shot_of.begin() + 20);
  const Alignment a = align(h);
  EXPECT_EQ(compare(h, a).right, 49u);
  EXPECT_TRUE(a.missing.empty());
}

TEST_F(Align, AClockThatIsSetSplitsIntoSpans) {
  for (const double jump : {3600.0, -3600.0, 12345.6}) {
    const History h = make_history({.shots = 300, .missing = 0.02, .zone_jump_s = jump}, 10);
    const Alignment a = align(h);
    EXPECT_EQ(compare(h, a).right, compare(h, a).of_shots) << jump;
    ASSERT_EQ(a.clocks.size(), 2u) << jump;
    EXPECT_NEAR(a.clocks[1].offset_s - a.clocks[0].offset_s, jump, 0.5);
  }
}

TEST_F(Align, ACounterThatWasResetIsReadByTime) {
  History h = make_history({.shots = 120, .missing = 0.05, .fractions = true}, 11);
  // The second half stands before the first one, as a new folder with a lower number would.
  const auto half = std::ptrdiff_t(h.pictures.size() / 2);
  std::rotate(h.pictures.begin(), h.pictures.begin() + half, h.pictures.end());
  std::rotate(h.shot_of.begin(), h.shot_of.begin() + half, h.shot_of.end());
  const Count c = compare(h, align(h));
  EXPECT_EQ(c.right, c.of_shots);
}

TEST_F(Align, ClockworkIsAmbiguousUntilTheClockIsKnown) {
  History h = make_history({.shots = 40, .rhythm = 1, .offset_s = 7200}, 12);
  h.pictures.erase(h.pictures.begin());
  h.shot_of.erase(h.shot_of.begin());
  const Alignment open = align(h);
  EXPECT_TRUE(open.matches.empty());
  EXPECT_FALSE(open.ambiguous.empty());
  const Alignment known = align(h, {.clock_offset_s = 7201, .clock_tolerance_s = 5});
  EXPECT_EQ(compare(h, known).right, 39u);
  EXPECT_EQ(known.missing, std::vector<std::size_t>{0});
}

TEST_F(Align, WithoutTimesTheOrderDecidesOnlyWhereItLeavesOneWay) {
  History h = make_history({.shots = 60, .untimed_pictures = 1}, 13);
  Alignment a = align(h);
  EXPECT_EQ(compare(h, a).right, 60u);
  for (const PictureOfShot& m : a.matches) EXPECT_TRUE(m.by_order);
  // One missing: nothing tells which.
  h.pictures.erase(h.pictures.begin() + 30);
  h.shot_of.erase(h.shot_of.begin() + 30);
  a = align(h);
  EXPECT_TRUE(a.matches.empty());
  ASSERT_EQ(a.ambiguous.size(), 1u);
  EXPECT_THAT(a.ambiguous[0].why, testing::HasSubstr("60 shots and 59 pictures"));
  // As many pictures as shots, but the counter has a hole: one is missing, and a stranger's makes up for it.
  h.pictures.push_back(h.pictures.back());
  h.pictures.back().counter += 1;
  h.shot_of.push_back(-1);
  EXPECT_TRUE(align(h).matches.empty());
}

TEST_F(Align, TheOrderFillsWhatTimesLeave) {
  std::size_t by_order = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    const History h = make_history({.shots = 150, .untimed_pictures = 0.1, .untimed_shots = 0.1}, seed);
    const Alignment a = align(h);
    EXPECT_EQ(compare(h, a).wrong, 0u);
    for (const PictureOfShot& m : a.matches) by_order += m.by_order;
  }
  EXPECT_GT(by_order, 200u * 150 * 15 / 100);
}

TEST_F(Align, NothingAndNonsense) {
  History h = make_history({.shots = 3}, 14);
  EXPECT_EQ(align_pictures({}, h.pictures, {}, job).extra.size(), 3u);
  EXPECT_EQ(align_pictures(h.shots, {}, {}, job).missing.size(), 3u);
  EXPECT_TRUE(align_pictures({}, {}, {}, job).matches.empty());
  h.shots[1].time_unix_s = std::nan("");
  EXPECT_EQ(test::expect_error([&] { align(h); }).code(), ErrorCode::invalid_argument);
  h.shots[1].time_unix_s = 1;
  h.pictures[1].clock_s = 1e300;
  EXPECT_EQ(test::expect_error([&] { align(h); }).code(), ErrorCode::invalid_argument);
  h.pictures[1].clock_s = 1;
  EXPECT_EQ(test::expect_error([&] { align(h, {.clock_offset_s = 0, .clock_tolerance_s = 0}); }).code(), ErrorCode::invalid_argument);
  job.cancel();
  EXPECT_EQ(test::expect_error([&] { align(h); }).code(), ErrorCode::cancelled);
}

}  // namespace
}  // namespace lumihull::capture
