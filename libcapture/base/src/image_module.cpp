// Finds and calls the module that reads TIFF, camera RAW, OpenEXR and other formats through OpenImageIO.

#include "image_module.h"

#include <dlfcn.h>

#include <array>
#include <cmath>
#include <memory>

#include "image_codecs.h"

namespace lumihull::internal {
namespace {

struct Loaded {
  const lumihull_image_module* module = nullptr;
  std::string problem;
};

Loaded load() {
  Loaded loaded;
  Dl_info here{};
  static const char kAnchor = 0;
  if (!dladdr(&kAnchor, &here) || !here.dli_fname) {
    loaded.problem = "the library's own folder is unknown";
    return loaded;
  }
  std::error_code ignored;
  const auto library = std::filesystem::canonical(here.dli_fname, ignored);
  const auto file = library.parent_path() / "lumihull" / kImageModuleFile;
  if (!std::filesystem::exists(file, ignored)) {
    loaded.problem = file.string() + " does not exist (this build has no OpenImageIO)";
    return loaded;
  }
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    const char* reason = dlerror();
    loaded.problem = reason ? reason : "dlopen failed";
    return loaded;
  }
  using Entry = const lumihull_image_module* (*)();
  const Entry entry = reinterpret_cast<Entry>(dlsym(handle, kImageModuleEntry));
  loaded.module = entry ? entry() : nullptr;
  if (!loaded.module || loaded.module->version != kImageModuleVersion) {
    loaded.module = nullptr;
    loaded.problem = file.string() + " belongs to another version of Lumihull";
  }
  return loaded;
}

/// The module stays loaded until the process ends: OpenImageIO does not bear being unloaded.
const lumihull_image_module& module_for(const std::string& name) {
  static const Loaded loaded = load();
  if (!loaded.module)
    throw Error(ErrorCode::unsupported,
                "neither JPEG nor PNG, and the module for other formats can't be loaded: " + loaded.problem, name);
  return *loaded.module;
}

std::string one_line(const char* text) {
  std::string line(text);
  line.erase(line.find_last_not_of(" \n\r\t") + 1);
  for (char& c : line)
    if (c == '\n' || c == '\r') c = ' ';
  return line.empty() ? "no reason given" : line;
}

/// An open file of the module's.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : name_(file.string()), module_(module_for(name_)) {
    std::array<char, 512> error{};
    handle_ = module_.open(file.c_str(), &header, error.data(), int(error.size()));
    if (!handle_) throw Error(ErrorCode::bad_input, "not readable as a picture: " + one_line(error.data()), name_);
    try {
      if (header.width < 1 || header.height < 1) throw Error(ErrorCode::bad_input, "a picture without pixels", name_);
      check_size(std::uint64_t(header.width), std::uint64_t(header.height), name_);
      if ((header.channels != 1 && header.channels != 3 && header.channels != 4) ||
          (header.type != 1 && header.type != 2 && header.type != 4))
        throw Error(ErrorCode::unsupported, "a picture of " + std::to_string(header.channels) + " channels", name_);
    } catch (...) {
      module_.close(handle_);
      throw;
    }
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { module_.close(handle_); }

  PixelType type() const {
    return header.type == 1 ? PixelType::u8 : header.type == 2 ? PixelType::u16 : PixelType::f32;
  }

  Image pixels() {
    // Zeroed: a decoder that skips pixels must not show what the memory held before.
    Image image(header.width, header.height, header.channels, type());
    std::array<char, 512> error{};
    if (module_.read(handle_, image.data(), error.data(), int(error.size())) != 0)
      throw Error(ErrorCode::bad_input, "damaged or truncated picture: " + one_line(error.data()), name_);
    return image;
  }

  lumihull_image_header header{};

 private:
  std::string name_;
  const lumihull_image_module& module_;
  void* handle_ = nullptr;
};

/// Linear light to sRGB, alpha as it is. Only float pictures are linear.
void encode_srgb(Image& image) {
  const int channels = image.channels();
  for (int y = 0; y < image.height(); ++y) {
    float* row = image.row<float>(y);
    for (int i = 0; i < image.width() * channels; ++i)
      if (channels != 4 || i % 4 != 3) row[i] = srgb_from_linear(row[i]);
  }
}

}  // namespace

Image read_by_module(const std::filesystem::path& file, const ReadOptions& options) {
  Reader reader(file);
  Image image = reader.pixels();
  if (reader.header.linear && image.type() == PixelType::f32) encode_srgb(image);
  if (options.channels != 0) image = converted(image, image.type(), options.channels);
  const int orientation = reader.header.orientation;
  if (options.apply_orientation && orientation > 1 && orientation <= 8) image = oriented(image, orientation);
  return image;
}

ImageInfo info_by_module(const std::filesystem::path& file) {
  const Reader reader(file);
  const lumihull_image_header& h = reader.header;
  ImageInfo info;
  info.width = h.width;
  info.height = h.height;
  info.channels = h.channels;
  info.type = reader.type();
  if (h.orientation >= 1 && h.orientation <= 8) info.orientation = h.orientation;
  if (std::isfinite(h.focal_length_mm) && h.focal_length_mm > 0) info.focal_length_mm = h.focal_length_mm;
  if (std::isfinite(h.focal_length_35mm_mm) && h.focal_length_35mm_mm > 0)
    info.focal_length_35mm_mm = h.focal_length_35mm_mm;
  info.time = iso_time({h.time, sizeof h.time});
  info.time_fraction_s = second_fraction({h.time_fraction, sizeof h.time_fraction});
  info.time_offset_min = utc_offset({h.time_offset, sizeof h.time_offset});
  info.make = clean_text({h.make, sizeof h.make});
  info.model = clean_text({h.model, sizeof h.model});
  info.lens = clean_text({h.lens, sizeof h.lens});
  return info;
}

}  // namespace lumihull::internal
