// Families of targets: their codes' distances by exhaustion, what decoding promises, and the square families against
// the pictures that their own libraries draw.
#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <gmock/gmock.h>
#include <lumihull/base/error.h>
#include <lumihull/calib/target_family.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <opencv2/aruco/dictionary.hpp>
#include <random>
#include <set>

#include "support.h"

namespace lumihull::calib {
namespace {

const std::vector<std::string> kCircles{"paper4x4", "matrix5x5", "matrix6x6"};

std::vector<Cell> turned(const std::vector<Cell>& cells, int grid, int quarters) {
  std::vector<Cell> out = cells;
  for (; quarters > 0; --quarters) {
    const std::vector<Cell> before = out;
    for (int row = 0; row < grid; ++row)
      for (int column = 0; column < grid; ++column)  // clockwise: the top row becomes the right column
        out[std::size_t(column * grid + grid - 1 - row)] = before[std::size_t(row * grid + column)];
  }
  return out;
}

/// Light cells as bits; square families without their border, which looks the same on all sides.
std::uint64_t packed(const std::vector<Cell>& cells, int grid, bool border) {
  std::uint64_t bits = 0;
  int i = 0;
  for (int row = border; row < grid - border; ++row)
    for (int column = border; column < grid - border; ++column, ++i)
      bits |= std::uint64_t(cells[std::size_t(row * grid + column)] == Cell::light) << i;
  return bits;
}

struct Distances {
  int upright = 99;  ///< between two ids
  int turned = 99;   ///< between an id and another one or itself, turned by 1 … 3 quarters
};

/// All pairs in all rotations.
Distances distances(const TargetFamily& family) {
  const bool border = family.kind() == TargetKind::square;
  std::array<std::vector<std::uint64_t>, 4> words;
  for (const int id : family.ids())
    for (int q = 0; q < 4; ++q)
      words[std::size_t(q)].push_back(packed(turned(family.cells(id), family.grid(), q), family.grid(), border));
  Distances d;
  const std::size_t n = words[0].size();
  for (std::size_t q = 0; q < 4; ++q)
    for (std::size_t i = 0; i < n; ++i) {
      int least = 99;
      for (std::size_t j = 0; j < n; ++j)
        if (q != 0 || i != j) least = std::min(least, std::popcount(words[q][i] ^ words[0][j]));
      int& of = q == 0 ? d.upright : d.turned;
      of = std::min(of, least);
    }
  return d;
}

TEST(TargetFamily, CirclesKeepTheirDistanceUprightAndTurned) {
  const auto paper = TargetFamily::by_name("paper4x4"), five = TargetFamily::by_name("matrix5x5"),
             six = TargetFamily::by_name("matrix6x6");
  EXPECT_EQ(paper.ids().size(), 400u);
  EXPECT_EQ(five.ids().size(), 256u);
  EXPECT_EQ(six.ids().size(), 4096u);

  const Distances d4 = distances(paper), d5 = distances(five), d6 = distances(six);
  EXPECT_EQ(d4.upright, 1);
  EXPECT_EQ(d5.upright, 6);
  EXPECT_EQ(d6.upright, 8);
  EXPECT_EQ(d4.turned, 2);
  EXPECT_EQ(d5.turned, 4);
  EXPECT_EQ(d6.turned, 6);
  EXPECT_EQ(paper.minimum_distance(), 1);
  EXPECT_EQ(five.minimum_distance(), 4);
  EXPECT_EQ(six.minimum_distance(), 6);
}

TEST(TargetFamily, TheLIsDarkAndOnlyMatrixFiveMayHaveASecondOne) {
  for (const std::string& name : kCircles) {
    SCOPED_TRACE(name);
    const auto family = TargetFamily::by_name(name);
    const int n = family.grid();
    int second = 0;
    for (const int id : family.ids())
      for (int q = 0; q < 4; ++q) {
        const auto cells = turned(family.cells(id), n, q);
        bool dark = true;
        for (int i = 0; i < n; ++i)
          dark &= cells[std::size_t(i * n)] == Cell::dark && cells[std::size_t((n - 1) * n + i)] == Cell::dark;
        if (q == 0)
          ASSERT_TRUE(dark) << id;
        else
          second += dark;
      }
    EXPECT_EQ(second, n == 5 ? 34 : 0);
  }
}

TEST(TargetFamily, PaperShowsTheValueInRowMajorBits) {
  const auto family = TargetFamily::by_name("paper4x4");
  const Cell o = Cell::dark, x = Cell::light;
  EXPECT_THAT(family.cells(46), testing::ElementsAre(o, o, x, x,  //
                                                     o, x, o, x,  //
                                                     o, o, o, o,  //
                                                     o, o, o, o));
}

TEST(TargetFamily, PaperLeavesOutExactlyTheValuesWithASecondL) {
  // By the geometry alone: a value is out where, turned, its left column and bottom row are dark.
  const auto family = TargetFamily::by_name("paper4x4");
  for (int value = 0; value < 512; ++value) {
    std::vector<Cell> cells(16, Cell::dark);
    for (int i = 0; i < 9; ++i)
      if (value >> i & 1) cells[std::size_t(i / 3 * 4 + i % 3 + 1)] = Cell::light;
    bool second = false;
    for (int q = 1; q < 4; ++q) {
      const auto t = turned(cells, 4, q);
      bool dark = true;
      for (const std::size_t i : {0u, 4u, 8u, 12u, 13u, 14u, 15u}) dark &= t[i] == Cell::dark;
      second |= dark;
    }
    EXPECT_EQ(family.has(value), !second) << value;
    if (!second) {
      EXPECT_EQ(family.cells(value), cells);
    }
  }
}

TEST(TargetFamily, MatrixSixHasItsLightCircleOppositeOfTheCorner) {
  const auto family = TargetFamily::by_name("matrix6x6");
  for (const int id : family.ids()) ASSERT_EQ(family.cells(id)[5], Cell::light) << id;
}

TEST(TargetFamily, AFieldOfLikeCirclesIsNoTarget) {
  for (const std::string name : {"matrix5x5", "matrix6x6"}) {
    const auto family = TargetFamily::by_name(name);
    const std::size_t n = std::size_t(family.grid() * family.grid());
    int least = 99;
    for (const int id : family.ids()) {
      const auto cells = family.cells(id);
      least = std::min(least, int(std::count(cells.begin(), cells.end(), Cell::light)));
    }
    EXPECT_GE(least, family.grid() == 5 ? 4 : 5);
    EXPECT_FALSE(family.decode(std::vector<Cell>(n, Cell::dark)));
    EXPECT_FALSE(family.decode(std::vector<Cell>(n, Cell::light)));
    EXPECT_FALSE(family.decode(std::vector<Cell>(n, Cell::unknown)));
  }
}

TEST(TargetFamily, DecodesEveryIdInEveryRotation) {
  for (const std::string& name : kCircles) {
    SCOPED_TRACE(name);
    const auto family = TargetFamily::by_name(name);
    for (const int id : family.ids())
      for (int q = 0; q < 4; ++q) {
        const auto read = family.decode(turned(family.cells(id), family.grid(), q));
        ASSERT_TRUE(read) << id;
        EXPECT_EQ(read->id, id);
        EXPECT_EQ(read->quarter_turns, (4 - q) % 4) << id;
        EXPECT_EQ(read->corrected, 0);
        EXPECT_EQ(read->erased, 0);
      }
  }
}

/// Cells with `wrong` of them inverted and `erased` others unknown.
std::vector<Cell> damaged(std::vector<Cell> cells, int wrong, int erased, std::mt19937& random) {
  std::vector<std::size_t> places(cells.size());
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = i;
  std::shuffle(places.begin(), places.end(), random);
  for (int i = 0; i < wrong + erased; ++i) {
    Cell& cell = cells[places[std::size_t(i)]];
    cell = i >= wrong ? Cell::unknown : cell == Cell::dark ? Cell::light : Cell::dark;
  }
  return cells;
}

TEST(TargetFamily, NeverMistakesWhatTheTurnedDistanceCovers) {
  std::mt19937 random(1);
  for (const std::string name : {"matrix5x5", "matrix6x6"}) {
    const auto family = TargetFamily::by_name(name);
    for (int k = 0; k < 4000; ++k) {
      const int id = family.ids()[random() % family.ids().size()], q = int(random() % 4);
      const int distance = family.minimum_distance();
      const int erased = int(random() % unsigned(distance)),
                wrong = int(random() % unsigned((distance - erased + 1) / 2));
      const auto read = family.decode(turned(damaged(family.cells(id), wrong, erased, random), family.grid(), q));
      // Within half of the least distance in any rotation no other id comes as near; but within the code's own, larger
      // power there may be one, and then nothing is said.
      if (!read) continue;
      EXPECT_EQ(read->id, id);
      EXPECT_EQ(read->quarter_turns, (4 - q) % 4);
      EXPECT_EQ(read->corrected, wrong);
      EXPECT_EQ(read->erased, erased);
    }
  }
}

/// How many of some damaged ids are read, and how many of those wrongly.
struct Tally {
  int read = 0, mistaken = 0, tried = 0;
};
Tally tally(const TargetFamily& family, int wrong, int erased, int trials) {
  std::mt19937 random(7);
  Tally t;
  for (; t.tried < trials; ++t.tried) {
    const int id = family.ids()[random() % family.ids().size()], q = int(random() % 4);
    const auto read = family.decode(turned(damaged(family.cells(id), wrong, erased, random), family.grid(), q));
    t.read += bool(read);
    t.mistaken += read && (read->id != id || read->quarter_turns != (4 - q) % 4);
  }
  return t;
}

TEST(TargetFamily, CorrectsTwoAndThreeWrongCells) {
  // What has as many differences from a turned word is ambiguous and refused: it happens at the code's last step only.
  const auto five = TargetFamily::by_name("matrix5x5"), six = TargetFamily::by_name("matrix6x6");
  for (int wrong = 0; wrong <= 2; ++wrong) {
    const Tally t = tally(five, wrong, 0, 3000);
    EXPECT_EQ(t.mistaken, 0) << wrong;
    EXPECT_GE(t.read, wrong < 2 ? t.tried : t.tried * 86 / 100) << wrong;
  }
  for (int wrong = 0; wrong <= 3; ++wrong) {
    const Tally t = tally(six, wrong, 0, 3000);
    EXPECT_EQ(t.mistaken, 0) << wrong;
    EXPECT_GE(t.read, wrong < 3 ? t.tried : t.tried * 99 / 100) << wrong;
  }
  for (int erased = 0; erased <= 5; ++erased) {
    const Tally t = tally(five, 0, erased, 3000);
    EXPECT_EQ(t.mistaken, 0) << erased;
    EXPECT_GE(t.read, t.tried * 97 / 100) << erased;
  }
}

TEST(TargetFamily, StrengthSaysHowManyWrongCellsAreAccepted) {
  const auto family = TargetFamily::by_name("matrix6x6");
  auto cells = family.cells(1234);
  for (int wrong = 0; wrong <= 4; ++wrong) {
    for (const auto& [strength, accepted] : {std::pair(0.0, 0), {0.4, 1}, {0.7, 2}, {1.0, 3}})
      EXPECT_EQ(bool(family.decode(cells, strength)), wrong <= accepted) << wrong << " " << strength;
    Cell& next = cells[std::size_t(7 + wrong)];
    next = next == Cell::dark ? Cell::light : Cell::dark;
  }
}

TEST(TargetFamily, PaperAcceptsNothingButTheWord) {
  const auto family = TargetFamily::by_name("paper4x4");
  auto cells = family.cells(46);
  cells[5] = Cell::unknown;
  EXPECT_FALSE(family.decode(cells));
  cells = family.cells(46);
  cells[0] = Cell::light;
  EXPECT_FALSE(family.decode(cells));
  EXPECT_FALSE(family.decode(std::vector<Cell>(16, Cell::dark)));
}

/// The library does not export its own function for that.
void release(image_u8_t* picture) {
  std::free(picture->buf);
  std::free(picture);
}

TEST(TargetFamily, AprilTagsAreAsTheirLibraryDrawsThem) {
  struct Known {
    const char* name;
    apriltag_family_t* (*create)();
    void (*destroy)(apriltag_family_t*);
    std::size_t ids;
    int distance;
  };
  for (const Known& known : {Known{"apriltag:36h11", tag36h11_create, tag36h11_destroy, 587, 11},
                             Known{"apriltag:36h10", tag36h10_create, tag36h10_destroy, 2320, 10},
                             Known{"apriltag:25h9", tag25h9_create, tag25h9_destroy, 35, 9},
                             Known{"apriltag:16h5", tag16h5_create, tag16h5_destroy, 30, 5}}) {
    SCOPED_TRACE(known.name);
    const auto family = TargetFamily::by_name(known.name);
    EXPECT_EQ(family.kind(), TargetKind::square);
    EXPECT_EQ(family.ids().size(), known.ids);
    EXPECT_EQ(family.minimum_distance(), known.distance);
    const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> tags(known.create(), known.destroy);
    EXPECT_EQ(family.grid(), tags->width_at_border);
    for (const int id : family.ids()) {
      const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> picture(apriltag_to_image(tags.get(), std::uint32_t(id)),
                                                                       release);
      ASSERT_EQ(picture->width, family.grid() + 2);
      const auto cells = family.cells(id);
      for (int i = 0; i < family.grid() * family.grid(); ++i)
        ASSERT_EQ(cells[std::size_t(i)] == Cell::light,
                  picture->buf[(i / family.grid() + 1) * picture->stride + i % family.grid() + 1] > 127)
            << id << " cell " << i;
    }
  }
}

TEST(TargetFamily, ArucoMarkersAreAsTheirLibraryDrawsThem) {
  const std::pair<const char*, int> dictionaries[] = {
      {"4x4_50", cv::aruco::DICT_4X4_50},     {"4x4_1000", cv::aruco::DICT_4X4_1000},
      {"5x5_100", cv::aruco::DICT_5X5_100},   {"6x6_250", cv::aruco::DICT_6X6_250},
      {"7x7_1000", cv::aruco::DICT_7X7_1000}, {"original", cv::aruco::DICT_ARUCO_ORIGINAL}};
  for (const auto& [name, number] : dictionaries) {
    SCOPED_TRACE(name);
    const auto family = TargetFamily::by_name(std::string("aruco:") + name);
    const auto dictionary = cv::aruco::getPredefinedDictionary(number);
    ASSERT_EQ(family.grid(), dictionary->markerSize + 2);
    // One marker of the original dictionary looks the same when it is turned by half.
    EXPECT_EQ(family.ids().size(), std::size_t(dictionary->bytesList.rows - (family.name() == "aruco:original")));
    EXPECT_GE(family.minimum_distance(), 1);
    for (const int id : family.ids()) {
      cv::Mat picture;
      dictionary->drawMarker(id, family.grid() * 2, picture);
      const auto cells = family.cells(id);
      for (int i = 0; i < family.grid() * family.grid(); ++i)
        ASSERT_EQ(cells[std::size_t(i)] == Cell::light,
                  picture.at<unsigned char>(i / family.grid() * 2, i % family.grid() * 2) > 127)
            << id << " cell " << i;
    }
  }
}

TEST(TargetFamily, EveryNameIsAFamily) {
  const auto names = TargetFamily::names();
  EXPECT_THAT(names, testing::SizeIs(3 + 4 + 17));
  EXPECT_EQ(names.front(), "paper4x4");
  for (const std::string& name : names) {
    const auto family = TargetFamily::by_name(name);
    EXPECT_EQ(family.name(), name);
    EXPECT_TRUE(family == TargetFamily::by_name(name));
    EXPECT_FALSE(family.ids().empty());
    EXPECT_TRUE(std::is_sorted(family.ids().begin(), family.ids().end()));
    for (const int id : family.ids()) ASSERT_TRUE(family.has(id));
    EXPECT_FALSE(family.has(-1));
    EXPECT_FALSE(family.has(family.ids().back() + 1));
  }
}

ErrorCode refusal(const std::function<void()>& call) { return test::expect_error(call).code(); }

TEST(TargetFamily, RefusesWhatItDoesNotHave) {
  for (const std::string name : {"", "matrix7x7", "apriltag:", "aruco:", "apriltag:36h12", "aruco:8x8_50", "Matrix5x5"})
    EXPECT_EQ(refusal([&] { TargetFamily::by_name(name); }), ErrorCode::invalid_argument) << name;
  for (const std::string name : {"apriltag:Standard41h12", "apriltag:Circle21h7"})
    EXPECT_EQ(refusal([&] { TargetFamily::by_name(name); }), ErrorCode::unsupported) << name;
  const auto family = TargetFamily::by_name("matrix5x5"), paper = TargetFamily::by_name("paper4x4"),
             tag = TargetFamily::by_name("apriltag:16h5");
  EXPECT_EQ(refusal([&] { family.cells(256); }), ErrorCode::invalid_argument);
  EXPECT_EQ(refusal([&] { paper.cells(0); }), ErrorCode::invalid_argument);
  EXPECT_EQ(refusal([&] { family.decode(std::vector<Cell>(24, Cell::dark)); }), ErrorCode::invalid_argument);
  EXPECT_EQ(refusal([&] { family.decode(family.cells(0), NAN); }), ErrorCode::invalid_argument);
  EXPECT_EQ(refusal([&] { tag.decode(tag.cells(0)); }), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::calib
