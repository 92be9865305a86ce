// Options of stages: what is taken, what is stored.

#include <lumihull/slf/pipeline.h>

#include <filesystem>

#include "support.h"

namespace lumihull::slf {
namespace {

using test::expect_error;

template <class T>
T stored(const Capture& capture, const char* stage, const char* name) {
  return std::get<T>(capture.options.at(stage).at(name));
}

TEST(Options, PathsAreStoredAbsoluteAndWordsAsTheyAre) {
  const test::TemporaryFolder folder;
  Capture capture = Capture::create(folder / "c");
  const std::filesystem::path here = std::filesystem::current_path();
  set_option_text(capture, "key", "background", "keys/../green.json");
  EXPECT_EQ(stored<std::string>(capture, "key", "background"), (here / "green.json").string());
  set_option_text(capture, "key", "background", "/other/key.json");
  EXPECT_EQ(stored<std::string>(capture, "key", "background"), "/other/key.json");
  for (const char* word : {"auto", "enclosure", "photos", "regions"}) {
    set_option_text(capture, "key", "background", word);
    EXPECT_EQ(stored<std::string>(capture, "key", "background"), word);
  }
  set_option_text(capture, "evaluate", "reference_masks", "masks");
  EXPECT_EQ(stored<std::string>(capture, "evaluate", "reference_masks"), (here / "masks").string());
  set_option(capture, "evaluate", "reference_masks", std::string());
  EXPECT_EQ(stored<std::string>(capture, "evaluate", "reference_masks"), "");
}

TEST(Options, AWordForTargetsIsKeptAndAFileMadeAbsolute) {
  const test::TemporaryFolder folder;
  Capture capture = Capture::create(folder / "c");
  set_option_text(capture, "calibrate", "targets", "aruco:6x6_250:35mm,matrix5x5:18mm");
  EXPECT_EQ(stored<std::string>(capture, "calibrate", "targets"), "aruco:6x6_250:35mm,matrix5x5:18mm");
  set_option_text(capture, "calibrate", "targets", "sheets.json");
  EXPECT_EQ(stored<std::string>(capture, "calibrate", "targets"),
            (std::filesystem::current_path() / "sheets.json").string());
  set_option_text(capture, "calibrate", "intrinsics", "lens.json");
  EXPECT_EQ(stored<std::string>(capture, "calibrate", "intrinsics"),
            (std::filesystem::current_path() / "lens.json").string());
  set_option_text(capture, "calibrate", "intrinsics", "fixed");
  EXPECT_EQ(stored<std::string>(capture, "calibrate", "intrinsics"), "fixed");
}

TEST(Options, WhatDoesNotFitIsRefusedWithWhatWould) {
  const test::TemporaryFolder folder;
  Capture capture = Capture::create(folder / "c");
  for (const auto& [name, text, wanted] : {std::tuple{"edges", "woolly", "one of hard, soft, matte"},
                                           {"max_samples", "99", "an integer from 100 to 1000000"},
                                           {"k", "1.5", "an integer"},
                                           {"clean", "maybe", "true or false"}}) {
    const Error error = expect_error([&, name = name, text = text] { set_option_text(capture, "key", name, text); });
    EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
    EXPECT_EQ(error.subject(), name);
    EXPECT_THAT(error.message(), testing::HasSubstr(wanted));
  }
  EXPECT_TRUE(capture.options.find("key") == capture.options.end() || capture.options.at("key").empty());
}

}  // namespace
}  // namespace lumihull::slf
