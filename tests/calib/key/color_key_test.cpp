// The key against brute force over the list of samples, its file, and its independence of order and threads.
#include <lumihull/base/files.h>
#include <lumihull/calib/background.h>
#include <lumihull/calib/color_key.h>

#include <algorithm>
#include <random>
#include <vector>

#include "support.h"

namespace lumihull::calib {
namespace {

using test::expect_error;

std::vector<ColorCount> expand(std::span<const Rgb> list) { return count_colors(list); }

/// An uneven green enclosure: `spread` small makes many repeated colours and ties.
std::vector<Rgb> enclosure_samples(std::size_t n, double spread, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Rgb> out(n);
  for (Rgb& c : out) {
    const double light = 0.4 + 0.6 * double(random() % 1000) / 1000;
    const double base[3] = {60, 170, 80};
    for (std::size_t i = 0; i < 3; ++i) {
      const double noise = (double(random() % 1000) + double(random() % 1000) - 1000) / 1000 * spread;
      c[i] = std::uint8_t(std::clamp(base[i] * light + noise, 0.0, 255.0));
    }
  }
  return out;
}

/// How many of the k nearest samples are foreground, by sorting all of them by (squared distance, index); background
/// samples have the lower indices.
int brute_force(const std::vector<Rgb>& background, const std::vector<Rgb>& foreground, int k, Rgb q) {
  // At each distance the background comes first: twice the distance, plus one for foreground, is that order.
  static thread_local std::vector<int> keys;
  keys.clear();
  for (const auto* side : {&background, &foreground})
    for (const Rgb& s : *side) {
      const int x = s[0] - q[0], y = s[1] - q[1], z = s[2] - q[2];
      keys.push_back(2 * (x * x + y * y + z * z) + (side == &foreground));
    }
  std::nth_element(keys.begin(), keys.begin() + (k - 1), keys.end());
  return int(std::count_if(keys.begin(), keys.begin() + k, [](int v) { return v & 1; }));
}

/// Literally the definition: a sorted list. Slow; shows that brute_force counts rightly.
int by_sorting(const std::vector<Rgb>& background, const std::vector<Rgb>& foreground, int k, Rgb q) {
  std::vector<std::array<int, 3>> order;
  int index = 0;
  for (const auto* side : {&background, &foreground})
    for (const Rgb& s : *side) {
      const int x = s[0] - q[0], y = s[1] - q[1], z = s[2] - q[2];
      order.push_back({x * x + y * y + z * z, index++, side == &foreground});
    }
  std::sort(order.begin(), order.end());
  int object = 0;
  for (int i = 0; i < k; ++i) object += order[std::size_t(i)][2];
  return object;
}

std::vector<Rgb> uniform_samples(std::size_t n, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Rgb> out(n);
  for (Rgb& c : out)
    for (std::uint8_t& v : c) v = std::uint8_t(random());
  return out;
}

/// Colours all over the cube, and around the background's, where decisions change.
std::vector<Rgb> questions(const std::vector<Rgb>& background, std::size_t n, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Rgb> out = uniform_samples(n, seed + 1);
  for (std::size_t i = 0; i < n; i += 2) {
    out[i] = background[random() % background.size()];
    for (std::uint8_t& v : out[i]) v = std::uint8_t(std::clamp(int(v) + int(random() % 41) - 20, 0, 255));
  }
  return out;
}

struct Case {
  int k;
  std::size_t background, foreground;
  double spread;
};

class BruteForce : public testing::TestWithParam<Case> {};

TEST_P(BruteForce, AgreesOnEveryColourTried) {
  const Case c = GetParam();
  const std::vector<Rgb> background = enclosure_samples(c.background, c.spread, 1);
  std::vector<Rgb> foreground = uniform_samples(c.foreground, 2);
  // Some foreground stands on background colours, and some colours come many times.
  for (std::size_t i = 0; i < foreground.size(); i += 5) foreground[i] = background[i % background.size()];
  for (std::size_t i = 1; i < foreground.size(); i += 7) foreground[i] = foreground[0];
  Job job;
  const ColorKey key = ColorKey::train(expand(background), expand(foreground), c.k, job);
  int objects = 0;
  const std::vector<Rgb> asked = questions(background, 8000, 3);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const int expected = brute_force(background, foreground, c.k, asked[i]);
    if (i < 20) {
      ASSERT_EQ(expected, by_sorting(background, foreground, c.k, asked[i]));
    }
    ASSERT_EQ(key.is_object(asked[i]), 2 * expected > c.k) << "colour " << i;
    ASSERT_EQ(key.foreground_neighbours(asked[i]), expected) << "colour " << i;
    ASSERT_DOUBLE_EQ(key.probability(asked[i]), double(expected) / c.k);
    objects += 2 * expected > c.k;
  }
  EXPECT_GT(objects, 100);
  EXPECT_LT(objects, 7900);
}

INSTANTIATE_TEST_SUITE_P(ColorKey, BruteForce,
                         testing::Values(Case{1, 2000, 400, 12}, Case{3, 2000, 400, 4}, Case{7, 5000, 1000, 3},
                                         Case{15, 3000, 600, 8}, Case{2, 500, 500, 10}, Case{8, 900, 100, 20},
                                         Case{7, 4, 5, 10}, Case{40, 300, 60, 5}));

TEST(ColorKey, EveryColourOfTheCubeAgreesWithTheSamples) {
  // The samples' own search is another path than the table; together they cover 100,000 colours, ties included.
  const std::vector<Rgb> background = enclosure_samples(20000, 5, 9);
  Job job;
  const ColorKey key = ColorKey::train(background, {7, 0.2, 4}, job);
  for (const Rgb& q : questions(background, 100000, 5))
    ASSERT_EQ(key.is_object(q), key.foreground_neighbours(q) > 3) << int(q[0]) << ' ' << int(q[1]) << ' ' << int(q[2]);
}

TEST(ColorKey, BackgroundWinsTies) {
  Job job;
  const std::vector<ColorCount> background{{{100, 100, 100}, 1}}, foreground{{{102, 100, 100}, 1}};
  const ColorKey key = ColorKey::train(background, foreground, 1, job);
  EXPECT_FALSE(key.is_object({101, 100, 100}));
  EXPECT_TRUE(key.is_object({102, 100, 100}));
  EXPECT_FALSE(key.is_object({101, 255, 0}));
  EXPECT_TRUE(key.is_object({255, 7, 0}));
}

TEST(ColorKey, OnlyOneKindNearEnoughDecides) {
  // Fewer foreground samples than a majority of k: nothing can be object; and the reverse.
  Job job;
  const std::vector<ColorCount> many{{{10, 20, 30}, 50}}, few{{{200, 20, 30}, 3}};
  const ColorKey none = ColorKey::train(many, few, 7, job), all = ColorKey::train(few, many, 7, job);
  for (const Rgb& q : uniform_samples(1000, 8)) {
    EXPECT_FALSE(none.is_object(q));
    EXPECT_TRUE(all.is_object(q));
  }
}

TEST(ColorKey, DoesNotDependOnOrderOrThreads) {
  std::vector<Rgb> background = enclosure_samples(5000, 6, 3);
  Job one({}, 1), two({}, 2);
  const ColorKey a = ColorKey::train(background, {}, one);
  std::shuffle(background.begin(), background.end(), std::mt19937(5));
  const ColorKey b = ColorKey::train(background, {}, two);
  EXPECT_TRUE(std::ranges::equal(a.table(), b.table()));
  const ColorKey other_seed = ColorKey::train(background, {7, 0.2, 77}, two);
  EXPECT_FALSE(std::ranges::equal(a.table(), other_seed.table()));
}

TEST(ColorKey, DecidesRowsAsSingleColours) {
  const std::vector<Rgb> background = enclosure_samples(3000, 6, 3);
  Job job;
  const ColorKey key = ColorKey::train(background, {}, job);
  for (const std::size_t n : {1u, 7u, 63u, 64u, 65u, 66u, 129u, 1000u}) {
    const std::vector<Rgb> pixels = questions(background, n, std::uint32_t(n));
    std::vector<std::uint64_t> bits((n + 63) / 64, ~std::uint64_t(0));
    key.decide(pixels[0].data(), n, bits.data());
    for (std::size_t i = 0; i < bits.size() * 64; ++i)
      ASSERT_EQ(bits[i >> 6] >> (i & 63) & 1, i < n && key.is_object(pixels[i])) << n << " pixels, pixel " << i;
  }
}

TEST(ColorKey, RefusesOptionsOutOfRange) {
  Job job;
  const std::vector<Rgb> background(10, Rgb{1, 2, 3});
  for (const int k : {0, -3, 256})
    EXPECT_EQ(expect_error([&] { ColorKey::train(background, {k, 0.2, 1}, job); }).code(), ErrorCode::invalid_argument);
  for (const double share : {0.0, -1.0, std::nan(""), 1e9})
    EXPECT_EQ(expect_error([&] {
                ColorKey::train(background, {7, share, 1}, job);
              }).code(),
              ErrorCode::invalid_argument);
  EXPECT_EQ(expect_error([&] { ColorKey::train(std::span<const Rgb>(), {}, job); }).code(),
            ErrorCode::invalid_argument);
  const std::vector<ColorCount> one{{{1, 2, 3}, 1}}, huge{{{1, 2, 3}, 4'000'000'000u}};
  EXPECT_THAT(expect_error([&] { ColorKey::train(one, one, 7, job); }).message(), testing::HasSubstr("k = 7"));
  EXPECT_EQ(expect_error([&] { ColorKey::train(huge, one, 7, job); }).code(), ErrorCode::invalid_argument);
}

TEST(KeyFile, ComesBackTheSame) {
  test::TemporaryFolder folder;
  Job job;
  const ColorKey key = ColorKey::train(enclosure_samples(2000, 6, 1), {5, 0.3, 2}, job);
  key.save(folder / "key.json");
  const ColorKey back = ColorKey::load(folder / "key.json", job);
  EXPECT_EQ(back.k(), 5);
  EXPECT_TRUE(std::ranges::equal(key.table(), back.table()));
  back.save(folder / "again.json");
  EXPECT_EQ(read_file(folder / "key.json"), read_file(folder / "again.json"));
}

TEST(KeyFile, SaysWhatIsWrongAndWhere) {
  test::TemporaryFolder folder;
  Job job;
  const std::string head = R"({"format":"lumihull-color-key","version":1,)";
  const std::string good_b = R"("background":{"colors":[1,2],"counts":[3,4]},)",
                    good_f = R"("foreground":{"colors":[99],"counts":[5]}})";
  const auto complaint = [&](const std::string& text) {
    write_file(folder / "bad.json", text);
    const Error e = expect_error([&] { ColorKey::load(folder / "bad.json", job); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_THAT(e.subject(), testing::HasSubstr("bad.json"));
    return e.message();
  };
  write_file(folder / "bad.json", head + R"("k":7,)" + good_b + good_f);
  EXPECT_EQ(ColorKey::load(folder / "bad.json", job).k(), 7);
  using testing::HasSubstr;
  EXPECT_THAT(complaint(""), HasSubstr("JSON"));
  EXPECT_THAT(complaint(head + R"("k":7,)" + good_b), HasSubstr("JSON"));
  EXPECT_THAT(complaint(R"({"format":"other","version":1})"), HasSubstr("/format"));
  EXPECT_THAT(complaint(head + R"("k":0,)" + good_b + good_f), HasSubstr("/k"));
  EXPECT_THAT(complaint(head + R"("k":13,)" + good_b + good_f), HasSubstr("/k"));
  EXPECT_THAT(complaint(head + R"("k":7,"background":{"colors":[2,1],"counts":[3,4]},)" + good_f),
              HasSubstr("/background/colors/1"));
  EXPECT_THAT(complaint(head + R"("k":7,"background":{"colors":[2,2],"counts":[3,4]},)" + good_f),
              HasSubstr("/background/colors/1"));
  EXPECT_THAT(complaint(head + R"("k":7,"background":{"colors":[1,16777216],"counts":[3,4]},)" + good_f),
              HasSubstr("/background/colors/1"));
  EXPECT_THAT(complaint(head + R"("k":7,"background":{"colors":[1,-2],"counts":[3,4]},)" + good_f),
              HasSubstr("/background/colors/1"));
  EXPECT_THAT(complaint(head + R"("k":7,"background":{"colors":[1,2],"counts":[3]},)" + good_f),
              HasSubstr("/background/counts"));
  EXPECT_THAT(complaint(head + R"("k":7,"background":{"colors":[],"counts":[]},)" + good_f),
              HasSubstr("/background/colors"));
  EXPECT_THAT(complaint(head + R"("k":7,"background":{"colors":[1,2],"counts":[9000000,9000000]},)" + good_f),
              HasSubstr("/background/counts/1"));
  EXPECT_THAT(complaint(head + R"("k":7,"background":{"colors":[1,2],"counts":[1e300,0]},)" + good_f),
              HasSubstr("/background/counts/0"));
  EXPECT_THAT(complaint(head + R"("k":7,)" + good_b + R"("foreground":[]})"), HasSubstr("/foreground"));
  EXPECT_EQ(expect_error([&] { ColorKey::load(folder / "none.json", job); }).code(), ErrorCode::not_found);
}

TEST(Background, SubsampleKeepsSharesWhateverTheOrder) {
  std::vector<ColorCount> population;
  for (int i = 0; i < 1000; ++i)
    population.push_back({{std::uint8_t(i % 256), std::uint8_t(i / 256), 7}, std::uint32_t(i + 1)});
  std::vector<ColorCount> reversed(population.rbegin(), population.rend());
  const auto a = subsample(population, 10000), b = subsample(reversed, 10000);
  ASSERT_EQ(a.size(), b.size());
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].color, b[i].color);
    EXPECT_EQ(a[i].count, b[i].count);
    total += a[i].count;
    const double share = double(int(a[i].color[0]) + 256 * int(a[i].color[1]) + 1) * 10000 / 500500;
    EXPECT_NEAR(a[i].count, share, 1.0);
  }
  EXPECT_EQ(total, 10000u);
  EXPECT_EQ(subsample(population, 1'000'000).size(), 1000u);
}

TEST(Background, RegionsAreParsedOrQuoted) {
  const auto regions = parse_regions("a:b:1,2,30,40;c:0,0,1,1");
  ASSERT_EQ(regions.size(), 2u);
  EXPECT_EQ(regions[0].photo, "a:b");
  EXPECT_EQ(regions[0].height, 40);
  for (const char* bad :
       {"", "a", "a:1,2,3", "a:1,2,3,0", "a:-1,2,3,4", "a:1,2,3,4x", ":1,2,3,4", "a:1,2,3,99999999999"})
    EXPECT_EQ(expect_error([&] { parse_regions(bad); }).code(), ErrorCode::invalid_argument) << bad;
}

TEST(Background, FindsAScansFrameButNotADarkEnclosure) {
  Image photo(200, 150, 3);
  const auto paint = [&](int x0, int y0, int x1, int y1, std::uint8_t v) {
    for (int y = y0; y < y1; ++y)
      std::fill(photo.row<std::uint8_t>(y) + 3 * x0, photo.row<std::uint8_t>(y) + 3 * x1, v);
  };
  paint(0, 0, 200, 150, 18);
  paint(0, 3, 188, 150, 140);
  const Frame f = find_frame(photo);
  EXPECT_EQ(f.x0, 0);
  EXPECT_EQ(f.y0, 5);
  EXPECT_EQ(f.x1, 186);
  EXPECT_EQ(f.y1, 150);
  paint(0, 0, 200, 150, 6);
  paint(60, 40, 140, 110, 150);
  const Frame dark = find_frame(photo);
  EXPECT_EQ(dark.x1 - dark.x0, 200);
  EXPECT_EQ(dark.y1 - dark.y0, 150);
}

}  // namespace
}  // namespace lumihull::calib
