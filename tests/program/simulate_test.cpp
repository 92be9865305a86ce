// lumihull simulate as its users run it; animated PNGs.
#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>

#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "apng.h"
#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

using test::lumihull;
using testing::HasSubstr;

TEST(SimulateVerb, MakesACaptureAndGoesOnAfterAStop) {
  const test::TemporaryFolder folder;
  const std::string out = (folder / "c").string();
  const std::vector<std::string> words{
      "simulate", out,       "--object", "box",           "--photos", "4",      "--width",     "120", "--empty",
      "1",        "--robot", "ideal",    "--lens-photos", "1",        "--fast", "--target-px", "3",   "--least-targets",
      "0",        "--quiet", "--json"};
  std::size_t kills = 0;
  test::Outcome run;
  for (int i = 0; i < 30; ++i) {
    run = lumihull(words, {.kill_after_s = .2 + .6 * i});
    if (run.status == 0) break;
    ASSERT_EQ(run.status, 128 + 9) << run.err;
    ++kills;
  }
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_GT(kills, 0u);
  EXPECT_EQ(nlohmann::json::parse(run.out)["photographs"], 4);
  EXPECT_EQ(nlohmann::json::parse(run.out)["carrier"], "an ideal robot");
  const Capture capture = Capture::open(out);
  EXPECT_EQ(capture.shots.size(), 4u);
  EXPECT_EQ(capture.enclosure.size(), 1u);
  EXPECT_EQ(read_image_info(capture.photo_path(capture.shots[0])).focal_length_mm.value_or(0), 18);
  for (const char* file : {"sheets.json", "lens/board.json", "truth/cameras.json", "contact.html", "simulate.json"})
    EXPECT_TRUE(std::filesystem::exists(folder / "c" / file)) << file;

  const auto again = lumihull(words);
  EXPECT_EQ(nlohmann::json::parse(again.out)["taken"], 0);
  auto other = words;
  other[5] = "5";
  const auto refused = lumihull(other);
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, HasSubstr("other options"));
  EXPECT_EQ(lumihull({"simulate", out, "--robot", "levitation"}).status, 2);
}

TEST(AnimatedPng, HoldsItsFrames) {
  std::vector<Image> pictures;
  std::vector<std::string> frames;
  for (int i = 0; i < 3; ++i) {
    Image picture(37, 23, 3);
    for (int y = 0; y < 23; ++y)
      for (int x = 0; x < 3 * 37; ++x) picture.row<std::uint8_t>(y)[x] = std::uint8_t(x * (i + 1) + y * 7);
    frames.push_back(encode_png(picture));
    pictures.push_back(std::move(picture));
  }
  const std::string film = program::animated_png(frames, 40);
  const auto as_bytes = [](const std::string& s) {
    return std::span(reinterpret_cast<const std::byte*>(s.data()), s.size());
  };
  const auto same = [](const Image& a, const Image& b) {
    return a.bytes() == b.bytes() && std::memcmp(a.data(), b.data(), a.bytes()) == 0;
  };
  // Who knows no animation sees the first frame; the reader checks every chunk's sum that it knows.
  EXPECT_TRUE(same(decode_image(as_bytes(film), "film"), pictures[0]));
  // The others: their data without the numbers, as a PNG of one frame.
  const auto number = [&](std::size_t at) {
    return std::uint32_t(std::uint8_t(film[at])) << 24 | std::uint32_t(std::uint8_t(film[at + 1])) << 16 |
           std::uint32_t(std::uint8_t(film[at + 2])) << 8 | std::uint8_t(film[at + 3]);
  };
  std::vector<std::string> data(3);
  std::uint32_t sequence = 0;
  int frame = -1;
  bool frames_told = false;
  for (std::size_t at = 8; at + 12 <= film.size(); at += 12 + number(at)) {
    const std::string name = film.substr(at + 4, 4);
    if (name == "acTL") frames_told = number(at + 8) == 3;
    if (name == "fcTL") {
      ++frame;
      EXPECT_EQ(number(at + 8), sequence++);
      EXPECT_EQ(number(at + 12), 37u);
    }
    if (name == "fdAT") {
      ASSERT_GE(frame, 0);
      EXPECT_EQ(number(at + 8), sequence++);
      data[std::size_t(frame)] += film.substr(at + 12, number(at) - 4);
    }
    if (name == "IDAT") data[0] += film.substr(at + 8, number(at));
  }
  EXPECT_TRUE(frames_told);
  ASSERT_EQ(frame, 2);
  for (int i = 0; i < 3; ++i) {
    const std::size_t at = frames[std::size_t(i)].find("IDAT");
    EXPECT_EQ(frames[std::size_t(i)].substr(at + 4, data[std::size_t(i)].size()), data[std::size_t(i)]) << i;
  }
  frames.push_back("not a picture");
  EXPECT_EQ(test::expect_error([&] { program::animated_png(frames, 40); }).code(), ErrorCode::bad_input);
  frames.back() = encode_png(Image(5, 5, 3));
  EXPECT_EQ(test::expect_error([&] { program::animated_png(frames, 40); }).code(), ErrorCode::bad_input);
  EXPECT_EQ(test::expect_error([&] { program::animated_png({}, 40); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull
