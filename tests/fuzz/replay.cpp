// Runs a fuzz target over its corpus, by an ordinary compiler: what was found once is never lost again.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

TEST(Replay, EveryFileOfTheCorpusAndEveryHalfOfIt) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(LUMIHULL_CORPUS)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  ASSERT_GE(files.size(), 5u);
  for (const auto& file : files) {
    SCOPED_TRACE(file.filename().string());
    std::ifstream in(file, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    ASSERT_FALSE(bytes.empty());
    // A copy of the exact length, so that the address sanitizer sees a read beyond the end.
    for (const std::size_t length : {bytes.size(), bytes.size() / 2, bytes.size() - 1}) {
      const std::vector<std::uint8_t> input(bytes.begin(), bytes.begin() + std::ptrdiff_t(length));
      EXPECT_EQ(LLVMFuzzerTestOneInput(input.data(), input.size()), 0);
    }
  }
}
