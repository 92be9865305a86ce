// Fuzz target: picture files from memory. The first byte chooses the options, the rest is the file.

#include <lumihull/base/error.h>
#include <lumihull/base/image.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lumihull;
  if (size < 1) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  constexpr int kChannels[4] = {0, 1, 3, 4};
  ReadOptions options;
  options.channels = kChannels[data[0] & 3];
  options.apply_orientation = data[0] & 4;
  try {
    const ImageInfo info = decode_image_info(bytes, "fuzz");
    if (info.width < 1 || info.height < 1 || info.orientation < 1 || info.orientation > 8) std::abort();
  } catch (const Error& e) {
    if (e.code() == ErrorCode::internal) std::abort();
  }
  try {
    const Image image = decode_image(bytes, "fuzz", options);
    if (image.empty() || (options.channels != 0 && image.channels() != options.channels)) std::abort();
  } catch (const Error& e) {
    if (e.code() == ErrorCode::internal) std::abort();
  }
  return 0;
}
