// The module around OpenImageIO: everything that is neither JPEG nor PNG. No exception leaves it.

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "image_module.h"

namespace {

struct Opened {
  std::unique_ptr<OIIO::ImageInput> input;
  lumihull_image_header header;
  bool grey_alpha = false;     // stored as two channels: handed out as four
  bool premultiplied = false;  // colours are stored times alpha: divided again
};

void set_text(char* to, std::size_t size, const std::string& text) {
  std::strncpy(to, text.c_str(), size - 1);
  to[size - 1] = '\0';
}

void describe(Opened& opened) {
  const OIIO::ImageSpec& spec = opened.input->spec();
  lumihull_image_header& h = opened.header;
  std::memset(&h, 0, sizeof h);
  h.width = spec.width;
  h.height = spec.height;
  opened.grey_alpha = spec.nchannels == 2 && spec.alpha_channel == 1;
  // Further channels (depth, layers) are left unread.
  const bool alpha = spec.alpha_channel == 3;
  h.channels = opened.grey_alpha ? 4 : spec.nchannels < 3 ? 1 : alpha ? 4 : 3;
  const auto base = OIIO::TypeDesc::BASETYPE(spec.format.basetype);
  h.type = base == OIIO::TypeDesc::UINT8 || base == OIIO::TypeDesc::INT8     ? 1
           : base == OIIO::TypeDesc::UINT16 || base == OIIO::TypeDesc::INT16 ? 2
                                                                             : 4;
  const std::string space(spec.get_string_attribute("oiio:ColorSpace"));
  h.linear = h.type == 4 && (space == "Linear" || space == "linear" || space == "scene_linear");
  opened.premultiplied = h.channels == 4 && !spec.get_int_attribute("oiio:UnassociatedAlpha", 0);
  h.orientation = spec.get_int_attribute("Orientation", 1);
  h.focal_length_mm = spec.get_float_attribute("Exif:FocalLength", 0);
  h.focal_length_35mm_mm = spec.get_int_attribute("Exif:FocalLengthIn35mmFilm", 0);
  set_text(h.time, sizeof h.time, std::string(spec.get_string_attribute("Exif:DateTimeOriginal")));
  set_text(h.time_fraction, sizeof h.time_fraction, std::string(spec.get_string_attribute("Exif:SubsecTimeOriginal")));
  set_text(h.time_offset, sizeof h.time_offset, std::string(spec.get_string_attribute("Exif:OffsetTimeOriginal")));
  set_text(h.make, sizeof h.make, std::string(spec.get_string_attribute("Make")));
  set_text(h.model, sizeof h.model, std::string(spec.get_string_attribute("Model")));
  set_text(h.lens, sizeof h.lens, std::string(spec.get_string_attribute("Exif:LensModel")));
}

/// EXIF orientation of a camera RAW file. With "raw:user_flip" the turn that LibRaw would make is no longer told, so
/// the header is read a second time. LibRaw counts: 1 mirrors columns, 2 mirrors rows, 4 exchanges both before.
int raw_orientation(const char* file) {
  constexpr int kExif[8] = {1, 2, 4, 3, 5, 8, 6, 7};
  const auto input = OIIO::ImageInput::open(file);
  const int flip = input ? input->spec().get_int_attribute("raw:flip", 0) : 0;
  return flip >= 0 && flip < 8 ? kExif[flip] : 1;
}

void* open(const char* file, lumihull_image_header* header, char* error, std::int32_t error_size) {
  try {
    OIIO::ImageSpec hints;
    hints["oiio:UnassociatedAlpha"] = 1;  // don't multiply colours by alpha
    hints["raw:ColorSpace"] = "sRGB";
    hints["raw:user_flip"] = 0;  // the sensor's own rows and columns
    auto opened = std::make_unique<Opened>();
    opened->input = OIIO::ImageInput::open(file, &hints);
    if (!opened->input) {
      set_text(error, std::size_t(error_size), OIIO::geterror());
      return nullptr;
    }
    const OIIO::ImageSpec& spec = opened->input->spec();
    if (spec.deep || spec.depth > 1 || spec.nchannels < 1) {
      set_text(error, std::size_t(error_size), "a deep or volume picture");
      return nullptr;
    }
    describe(*opened);
    if (std::strcmp(opened->input->format_name(), "raw") == 0) opened->header.orientation = raw_orientation(file);
    *header = opened->header;
    return opened.release();
  } catch (const std::exception& e) {
    set_text(error, std::size_t(error_size), e.what());
  } catch (...) {
    set_text(error, std::size_t(error_size), "unknown exception");
  }
  return nullptr;
}

template <class T>
void from_grey_alpha(T* pixels, std::size_t count) {
  for (std::size_t i = count; i-- > 0;) {
    const T grey = pixels[4 * i], alpha = pixels[4 * i + 1];
    pixels[4 * i] = pixels[4 * i + 1] = pixels[4 * i + 2] = grey;
    pixels[4 * i + 3] = alpha;
  }
}

template <class T>
void divide_by_alpha(T* pixels, std::size_t count, double full) {
  for (std::size_t i = 0; i < count; ++i, pixels += 4) {
    const double alpha = double(pixels[3]) / full;
    if (!(alpha > 0) || alpha >= 1) continue;
    for (int c = 0; c < 3; ++c) {
      const double value = double(pixels[c]) / alpha;
      pixels[c] = full > 1 ? T(std::min(value + 0.5, full)) : T(value);
    }
  }
}

template <class T>
void finish(const Opened& opened, void* pixels, double full) {
  const std::size_t count = std::size_t(opened.header.width) * std::size_t(opened.header.height);
  T* values = static_cast<T*>(pixels);
  if (opened.grey_alpha) from_grey_alpha(values, count);
  if (opened.premultiplied) divide_by_alpha(values, count, full);
}

std::int32_t read(void* handle, void* pixels, char* error, std::int32_t error_size) {
  try {
    Opened& opened = *static_cast<Opened*>(handle);
    const lumihull_image_header& h = opened.header;
    const OIIO::TypeDesc type = h.type == 1   ? OIIO::TypeDesc::UINT8
                                : h.type == 2 ? OIIO::TypeDesc::UINT16
                                              : OIIO::TypeDesc::FLOAT;
    const OIIO::stride_t pixel_bytes = OIIO::stride_t(h.channels) * h.type;
    const int stored = opened.grey_alpha ? 2 : h.channels;
    if (!opened.input->read_image(0, 0, 0, stored, type, pixels, pixel_bytes)) {
      set_text(error, std::size_t(error_size), opened.input->geterror());
      return 1;
    }
    if (h.type == 1) finish<std::uint8_t>(opened, pixels, 255);
    if (h.type == 2) finish<std::uint16_t>(opened, pixels, 65535);
    if (h.type == 4) finish<float>(opened, pixels, 1);
    return 0;
  } catch (const std::exception& e) {
    set_text(error, std::size_t(error_size), e.what());
  } catch (...) {
    set_text(error, std::size_t(error_size), "unknown exception");
  }
  return 1;
}

void close(void* handle) { delete static_cast<Opened*>(handle); }

}  // namespace

extern "C" __attribute__((visibility("default"))) const lumihull_image_module* lumihull_image_module_entry() {
  static const lumihull_image_module module{lumihull::internal::kImageModuleVersion, open, read, close};
  return &module;
}
