#pragma once

// What passes between the library and the module around OpenImageIO: plain C, so that the two need not even be built by
// one compiler. The module is a shared object of its own, for loading OpenImageIO costs half a second.

#include <cstdint>

extern "C" {

struct lumihull_image_header {
  std::int32_t width, height;
  std::int32_t channels;                         ///< 1, 3 or 4
  std::int32_t type;                             ///< bytes of one channel: 1 and 2 unsigned, 4 float
  std::int32_t linear;                           ///< 1: values are linear light (EXR), 0: sRGB
  std::int32_t orientation;                      ///< EXIF 1 … 8
  double focal_length_mm, focal_length_35mm_mm;  ///< 0: not known
  char time[32];                                 ///< as EXIF writes it
  char time_fraction[16], time_offset[16];       ///< SubSecTimeOriginal, OffsetTimeOriginal
  char make[128], model[128], lens[128];
};

struct lumihull_image_module {
  std::int32_t version;  ///< kImageModuleVersion
  /// Opens a file and fills in its header; null on failure, with one line in `error`.
  void* (*open)(const char* file, lumihull_image_header* header, char* error, std::int32_t error_size);
  /// Reads all pixels, rows without gaps; nonzero on failure.
  std::int32_t (*read)(void* handle, void* pixels, char* error, std::int32_t error_size);
  void (*close)(void* handle);
};

}  // extern "C"

namespace lumihull::internal {
inline constexpr std::int32_t kImageModuleVersion = 2;
inline constexpr char kImageModuleFile[] = "lumihull_image_oiio.so";
inline constexpr char kImageModuleEntry[] = "lumihull_image_module_entry";  ///< const lumihull_image_module*(void)
}  // namespace lumihull::internal
