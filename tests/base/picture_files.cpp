#include "picture_files.h"

#include <png.h>

#include <stdexcept>

namespace lumihull::test {

std::string ExifBuilder::tiff() const {
  const auto folder_size = [](std::size_t entries) { return 2 + 12 * entries + 4; };
  const std::size_t main_at = 8, main_count = main_.size() + 1, exif_at = main_at + folder_size(main_count),
                    data_at = exif_at + folder_size(exif_.size());
  std::string head = "II" + number(42, 2) + number(std::uint32_t(main_at), 4), data;
  const auto print = [&](const std::vector<Entry>& entries, bool link) {
    head += number(std::uint32_t(entries.size() + (link ? 1 : 0)), 2);
    for (const Entry& e : entries) {
      head += number(std::uint32_t(e.tag), 2) + number(std::uint32_t(e.type), 2) + number(e.count, 4);
      if (e.value.size() <= 4) {
        head += e.value + std::string(4 - e.value.size(), '\0');
      } else {
        head += number(std::uint32_t(data_at + data.size()), 4);
        data += e.value;
      }
    }
    if (link) head += number(0x8769, 2) + number(4, 2) + number(1, 4) + number(std::uint32_t(exif_at), 4);
    head += number(0, 4);
  };
  print(main_, true);
  print(exif_, false);
  return head + data;
}

std::string jpeg_with_exif(const std::string& jpeg, const std::string& tiff) {
  const std::string body = std::string("Exif\0\0", 6) + tiff;
  const std::size_t length = body.size() + 2;
  return jpeg.substr(0, 2) + "\xff\xe1" + char(length >> 8) + char(length & 255) + body + jpeg.substr(2);
}

std::string write_variant(const PngVariant& v) {
  std::string out;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &out,
      [](png_structp p, png_bytep bytes, png_size_t count) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<char*>(bytes), count);
      },
      [](png_structp) {});
  png_set_IHDR(png, info, png_uint_32(v.width), png_uint_32(v.height), v.depth, v.colour,
               v.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  if (!v.palette.empty())
    png_set_PLTE(png, info, reinterpret_cast<png_const_colorp>(v.palette.data()), int(v.palette.size() / 3));
  if (!v.transparency.empty()) png_set_tRNS(png, info, v.transparency.data(), int(v.transparency.size()), nullptr);
  png_write_info(png, info);
  std::vector<png_bytep> rows;
  for (const std::string& row : v.rows) rows.push_back(reinterpret_cast<png_bytep>(const_cast<char*>(row.data())));
  png_write_image(png, rows.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

}  // namespace lumihull::test
