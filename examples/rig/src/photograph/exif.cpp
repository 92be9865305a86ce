// Exif 2.3 (CIPA DC-008-2012): an APP1 segment that holds a little-endian TIFF of two directories.

#include <lumihull/base/error.h>
#include <lumihull/rig/exif.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace lumihull::rig {

namespace {

void put16(std::string& out, std::uint32_t x) { out += char(x & 0xff), out += char(x >> 8 & 0xff); }
void put32(std::string& out, std::uint32_t x) { put16(out, x & 0xffff), put16(out, x >> 16); }

/// One TIFF directory: fields in ascending order of tag, values that do not fit four bytes behind it.
class Directory {
 public:
  void ascii(std::uint16_t tag, const std::string& text) {
    if (!text.empty()) fields_.push_back({tag, 2, std::uint32_t(text.size() + 1), text + '\0'});
  }
  void bytes(std::uint16_t tag, const std::string& value) {
    fields_.push_back({tag, 7, std::uint32_t(value.size()), value});
  }
  void number16(std::uint16_t tag, int value) {
    std::string s;
    put16(s, std::uint32_t(value));
    fields_.push_back({tag, 3, 1, s});
  }
  void number32(std::uint16_t tag, std::uint32_t value) {
    std::string s;
    put32(s, value);
    fields_.push_back({tag, 4, 1, s});
  }
  void rational(std::uint16_t tag, double value, std::uint32_t denominator) {
    std::string s;
    put32(s, std::uint32_t(std::llround(value * denominator)));
    put32(s, denominator);
    fields_.push_back({tag, 5, 1, s});
  }

  std::size_t size() const {
    std::size_t n = 2 + 12 * fields_.size() + 4;
    for (const Field& f : fields_)
      if (f.value.size() > 4) n += (f.value.size() + 1) / 2 * 2;
    return n;
  }
  /// The directory as it stands `offset` bytes behind the TIFF header's start.
  std::string encoded(std::size_t offset) const {
    std::string out, behind;
    put16(out, std::uint32_t(fields_.size()));
    const std::size_t values = offset + 2 + 12 * fields_.size() + 4;
    for (const Field& f : fields_) {
      put16(out, f.tag), put16(out, f.type), put32(out, f.count);
      if (f.value.size() <= 4) {
        out += f.value + std::string(4 - f.value.size(), '\0');
      } else {
        put32(out, std::uint32_t(values + behind.size()));
        behind += f.value;
        if (behind.size() % 2) behind += '\0';
      }
    }
    put32(out, 0);  // no next directory
    return out + behind;
  }

 private:
  struct Field {
    std::uint16_t tag, type;
    std::uint32_t count;
    std::string value;
  };
  std::vector<Field> fields_;
};

}  // namespace

int exif_orientation(const Eigen::Vector3d& up) {
  constexpr double kLeast = .3;  // sine of the angle between sight and plumb line below which nothing is told
  const double across = up.x(), down = up.y();
  if (std::hypot(across, down) < kLeast * up.norm()) return 1;
  if (std::fabs(across) > std::fabs(down)) return across < 0 ? 6 : 8;
  return down < 0 ? 1 : 3;
}

std::string with_exif(std::string_view jpeg, const ExifTags& tags) {
  if (!jpeg.starts_with("\xff\xd8\xff")) throw Error(ErrorCode::invalid_argument, "not a JPEG", "exif");
  Directory photo;
  photo.rational(0x829a, tags.exposure_s, 100000);
  photo.rational(0x829d, tags.f_number, 10);
  photo.number16(0x8827, tags.iso);
  photo.bytes(0x9000, "0230");
  photo.ascii(0x9003, tags.time);  // DateTimeOriginal
  photo.rational(0x920a, tags.focal_length_mm, 1000);
  photo.bytes(0xa000, "0100");
  photo.number16(0xa001, 1);  // sRGB
  photo.number32(0xa002, std::uint32_t(tags.width));
  photo.number32(0xa003, std::uint32_t(tags.height));
  const double per_cm = tags.sensor_width_mm > 0 ? tags.width / tags.sensor_width_mm * 10 : 0;
  photo.rational(0xa20e, per_cm, 1000);
  photo.rational(0xa20f, per_cm, 1000);
  photo.number16(0xa210, 3);  // … pixels per centimetre
  // 36 mm is the width of the full format that this is relative to.
  if (tags.sensor_width_mm > 0)
    photo.number16(0xa405, int(std::lround(tags.focal_length_mm * 36 / tags.sensor_width_mm)));
  photo.ascii(0xa434, tags.lens);

  // The first directory's length does not depend on where the second one stands.
  std::string first;
  for (std::uint32_t photo_offset = 0, pass = 0; pass < 2; ++pass) {
    Directory picture;
    picture.ascii(0x010f, tags.make);
    picture.ascii(0x0110, tags.model);
    picture.number16(0x0112, tags.orientation);
    picture.ascii(0x0132, tags.time);
    picture.number32(0x8769, photo_offset);
    photo_offset = std::uint32_t(8 + picture.size());
    first = picture.encoded(8);
  }
  std::string tiff = "II";
  put16(tiff, 42);
  put32(tiff, 8);
  tiff += first;
  tiff += photo.encoded(tiff.size());

  const std::string body = std::string("Exif\0\0", 6) + tiff;
  const std::size_t length = body.size() + 2;
  if (length > 0xffff) throw Error(ErrorCode::invalid_argument, "texts are too long for one segment", "exif");
  std::string out = "\xff\xd8\xff\xe1";
  out += char(length >> 8);
  out += char(length & 0xff);
  out += body;
  out += jpeg.substr(2);
  return out;
}

}  // namespace lumihull::rig
