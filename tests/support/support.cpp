#include "support.h"

#include <cstdlib>
#include <vector>

namespace lumihull::test {

namespace fs = std::filesystem;

fs::path real_data() {
  if (const char* folder = std::getenv("LUMIHULL_TEST_DATA")) return fs::exists(folder) ? fs::path(folder) : fs::path();
  const fs::path beside = fs::path(LUMIHULL_SOURCE_DIR) / ".." / "shared" / "data";
  return fs::exists(beside) ? fs::canonical(beside) : fs::path();
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "lumihull-test-XXXXXX").string();
  std::vector<char> buffer(pattern.begin(), pattern.end());
  buffer.push_back('\0');
  if (!mkdtemp(buffer.data())) throw std::runtime_error("no temporary folder");
  path_ = buffer.data();
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

Error expect_error(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    return e;
  }
  ADD_FAILURE() << "no lumihull::Error was thrown";
  return Error(ErrorCode::internal, "no error");
}

}  // namespace lumihull::test
