#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lumihull/base/error.h>

#include <filesystem>
#include <functional>
#include <string>

namespace lumihull::test {

/// Folder of the real photographs: $LUMIHULL_TEST_DATA, or shared/data beside the project. Empty where absent.
std::filesystem::path real_data();

/// A new empty folder that is removed with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder();
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Runs `body` and returns the lumihull::Error that it throws; a test failure where it throws none.
Error expect_error(const std::function<void()>& body);

}  // namespace lumihull::test

/// At the top of a test that needs real photographs.
#define LUMIHULL_NEED_REAL_DATA(variable, folder)                                \
  const std::filesystem::path variable = lumihull::test::real_data() / folder;   \
  if (lumihull::test::real_data().empty() || !std::filesystem::exists(variable)) \
  GTEST_SKIP() << "needs the real photographs '" << folder << "': set LUMIHULL_TEST_DATA to their folder"
