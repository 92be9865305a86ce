// COLMAP's model files. Models and parameter orders: COLMAP's documentation, "Camera Models".

#include "colmap_model.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <span>

#include "import_common.h"

namespace lumihull::internal {

namespace {

struct ModelKind {
  std::string_view name;
  int id;
  int parameters;
};
constexpr std::array<ModelKind, 9> kModels = {{{"SIMPLE_PINHOLE", 0, 3},
                                               {"PINHOLE", 1, 4},
                                               {"SIMPLE_RADIAL", 2, 4},
                                               {"RADIAL", 3, 5},
                                               {"OPENCV", 4, 8},
                                               {"OPENCV_FISHEYE", 5, 8},
                                               {"FULL_OPENCV", 6, 12},
                                               {"SIMPLE_RADIAL_FISHEYE", 8, 4},
                                               {"RADIAL_FISHEYE", 9, 5}}};
constexpr std::uint64_t kMaxImages = 1'000'000;

std::string known_models() {
  std::string text;
  for (const ModelKind& model : kModels) text += (text.empty() ? "" : ", ") + std::string(model.name);
  return text;
}

/// Throws a text that says what is wrong; the caller adds where.
ForwardCamera camera_of(const ModelKind& kind, double width, double height, std::span<const double> p) {
  ForwardCamera c;
  if (!(width >= 1) || !(height >= 1) || width > kMaxImageSide || height > kMaxImageSide ||
      width != std::floor(width) || height != std::floor(height))
    throw std::string("a camera's width and height must be whole numbers from 1 to 65500");
  c.width = int(width);
  c.height = int(height);
  for (const double value : p)
    if (!std::isfinite(value)) throw std::string("a camera parameter is not a finite number");
  const bool one_f = kind.id == 0 || kind.id == 2 || kind.id == 3 || kind.id == 8 || kind.id == 9;
  std::size_t next = 0;
  c.fx = p[next++];
  c.fy = one_f ? c.fx : p[next++];
  c.cx = p[next++];
  c.cy = p[next++];
  if (!(c.fx > 0) || !(c.fy > 0)) throw std::string("a camera's focal length must be positive");
  using Lens = ForwardCamera::Lens;
  const bool fisheye = kind.id == 5 || kind.id == 8 || kind.id == 9;
  c.lens = kind.id < 2 ? Lens::none : fisheye ? Lens::fisheye : Lens::opencv;
  if (kind.id == 4 || kind.id == 6) {  // k1 k2 p1 p2 [k3 k4 k5 k6]
    c.k[0] = p[4];
    c.k[1] = p[5];
    c.p1 = p[6];
    c.p2 = p[7];
    for (std::size_t i = 8; i < p.size(); ++i) c.k[i - 6] = p[i];
  } else {
    for (std::size_t i = next; i < p.size(); ++i) c.k[i - next] = p[i];
  }
  const bool straight = std::all_of(std::begin(c.k), std::end(c.k), [](double k) { return k == 0; });
  if (c.lens == Lens::opencv && straight && c.p1 == 0 && c.p2 == 0) c.lens = Lens::none;
  return c;
}

Pose pose_of(const std::array<double, 7>& v) {
  for (const double x : v)
    if (!std::isfinite(x)) throw std::string("a pose's value is not a finite number");
  const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
  if (!(std::abs(q.norm() - 1) < 1e-3)) throw std::string("a pose's quaternion is not of unit length");
  return {q.normalized(), {v[4], v[5], v[6]}};
}

double number_at(const std::vector<std::string_view>& words, std::size_t i) {
  const auto value = finite_number(words[i]);
  if (!value) throw "\"" + std::string(words[i].substr(0, 40)) + "\" is not a finite number";
  return *value;
}

std::int64_t id_at(const std::vector<std::string_view>& words, std::size_t i) {
  const double value = number_at(words, i);
  if (!(value >= 0) || value > 4294967295.0 || value != std::floor(value))
    throw std::string("an identifier is not a whole number");
  return std::int64_t(value);
}

}  // namespace

void parse_colmap_cameras_text(std::string_view text, const std::string& file, ColmapModel& model) {
  std::size_t number = 0;
  for (const std::string_view line : lines_of(text)) {
    ++number;
    const auto words = words_of(line);
    if (words.empty() || words[0][0] == '#') continue;
    if (words.size() < 5) fail_at_line(file, number, "expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS…");
    const auto kind =
        std::find_if(kModels.begin(), kModels.end(), [&](const ModelKind& k) { return k.name == words[1]; });
    if (kind == kModels.end())
      throw Error(ErrorCode::unsupported,
                  "line " + std::to_string(number) + ": camera model " + std::string(words[1].substr(0, 40)) +
                      "; known are " + known_models(),
                  file);
    if (words.size() != 4 + std::size_t(kind->parameters))
      fail_at_line(file, number,
                   "expected " + std::to_string(kind->parameters) + " parameters of model " + std::string(kind->name) +
                       ", found " + std::to_string(words.size() - 4));
    try {
      std::vector<double> parameters;
      for (std::size_t i = 4; i < words.size(); ++i) parameters.push_back(number_at(words, i));
      const auto camera = camera_of(*kind, number_at(words, 2), number_at(words, 3), parameters);
      if (!model.cameras.emplace(id_at(words, 0), camera).second) throw std::string("a camera that was there already");
    } catch (const std::string& what) {
      fail_at_line(file, number, what);
    }
  }
}

void parse_colmap_images_text(std::string_view text, const std::string& file, ColmapModel& model) {
  const auto lines = lines_of(text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto words = words_of(lines[i]);
    if (words.empty() || words[0][0] == '#') continue;
    if (words.size() < 10)
      fail_at_line(
          file, i + 1,
          "expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, found " + std::to_string(words.size()) + " words");
    try {
      std::array<double, 7> v;
      for (std::size_t k = 0; k < 7; ++k) v[k] = number_at(words, k + 1);
      id_at(words, 0);
      const std::string name(words[9].data(), words.back().data() + words.back().size());
      if (name.find('\0') != std::string::npos) throw std::string("a NUL in the image's name");
      model.images.push_back({name, id_at(words, 8), pose_of(v), {}});
    } catch (const std::string& what) {
      fail_at_line(file, i + 1, what);
    }
    if (model.images.size() > kMaxImages) fail_at_line(file, i + 1, "more than a million images");
    ++i;  // the image's 2-D points: a line that may be empty, but is always there
  }
}

namespace {

/// Little-endian values from bytes that may end anywhere.
class BinaryReader {
 public:
  BinaryReader(std::string_view bytes, std::string file) : bytes_(bytes), file_(std::move(file)) {
    static_assert(std::endian::native == std::endian::little);
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::bad_input, "byte " + std::to_string(at_) + ": " + what, file_);
  }
  template <class T>
  T read() {
    T value;
    if (bytes_.size() - at_ < sizeof value) fail("the file ends too early");
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  void skip(std::uint64_t count, std::uint64_t size) {
    if (count > (bytes_.size() - at_) / size) fail("the file ends too early");
    at_ += count * size;
  }
  /// A count of items of at least `size` bytes each.
  std::uint64_t count(std::uint64_t size) {
    const auto n = read<std::uint64_t>();
    if (n > (bytes_.size() - at_) / size) fail("a count of " + std::to_string(n) + " is more than the file can hold");
    return n;
  }
  std::string name() {
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string_view::npos || end - at_ > 4096) fail("a name without an end");
    const std::string text(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    if (text.empty()) fail("an image without a name");
    return text;
  }
  void expect_end() const {
    if (at_ != bytes_.size()) fail("more bytes than images or cameras");
  }

 private:
  std::string_view bytes_;
  std::string file_;
  std::size_t at_ = 0;
};

}  // namespace

void parse_colmap_cameras_binary(std::string_view bytes, const std::string& file, ColmapModel& model) {
  BinaryReader reader(bytes, file);
  const std::uint64_t count = reader.count(4 + 4 + 8 + 8 + 3 * 8);
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto id = reader.read<std::uint32_t>();
    const auto model_id = reader.read<std::int32_t>();
    const auto width = reader.read<std::uint64_t>(), height = reader.read<std::uint64_t>();
    const auto kind =
        std::find_if(kModels.begin(), kModels.end(), [&](const ModelKind& k) { return k.id == model_id; });
    if (kind == kModels.end())
      throw Error(ErrorCode::unsupported,
                  "camera model number " + std::to_string(model_id) + "; known are " + known_models(), file);
    std::vector<double> parameters(std::size_t(kind->parameters));
    for (double& p : parameters) p = reader.read<double>();
    try {
      const auto camera = camera_of(*kind, double(width), double(height), parameters);
      if (!model.cameras.emplace(id, camera).second) throw std::string("a camera that was there already");
    } catch (const std::string& what) {
      reader.fail(what);
    }
  }
  reader.expect_end();
}

void parse_colmap_images_binary(std::string_view bytes, const std::string& file, ColmapModel& model) {
  BinaryReader reader(bytes, file);
  const std::uint64_t count = reader.count(4 + 7 * 8 + 4 + 2 + 8);
  for (std::uint64_t i = 0; i < count; ++i) {
    reader.read<std::uint32_t>();  // the image's own number
    std::array<double, 7> v;
    for (double& x : v) x = reader.read<double>();
    ColmapImage image;
    image.camera = reader.read<std::uint32_t>();
    image.name = reader.name();
    const auto points = reader.read<std::uint64_t>();
    reader.skip(points, 2 * 8 + 8);
    try {
      image.cam_from_world = pose_of(v);
    } catch (const std::string& what) {
      reader.fail(what);
    }
    model.images.push_back(std::move(image));
  }
  reader.expect_end();
}

void check_colmap_model(const ColmapModel& model, const std::string& file) {
  if (model.images.empty()) throw Error(ErrorCode::bad_input, "the model has no images", file);
  for (const ColmapImage& image : model.images)
    if (!model.cameras.contains(image.camera))
      throw Error(ErrorCode::bad_input,
                  "image " + image.name + " names camera " + std::to_string(image.camera) + ", which is not there",
                  file);
}

namespace {

std::string digits(double value) {
  char text[40];
  std::snprintf(text, sizeof text, " %.17g", value);
  return text;
}

}  // namespace

std::string print_colmap_cameras(const ColmapModel& model) {
  std::string text = "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (const auto& [id, c] : model.cameras) {
    const bool full = c.k[2] != 0 || c.k[3] != 0 || c.k[4] != 0 || c.k[5] != 0;
    const bool pinhole = c.lens == ForwardCamera::Lens::none;
    text += std::to_string(id) +
            (pinhole ? " PINHOLE "
             : full  ? " FULL_OPENCV "
                     : " OPENCV ") +
            std::to_string(c.width) + " " + std::to_string(c.height);
    for (const double value : {c.fx, c.fy, c.cx, c.cy}) text += digits(value);
    if (!pinhole)
      for (const double value : {c.k[0], c.k[1], c.p1, c.p2}) text += digits(value);
    if (full)
      for (int i = 2; i < 6; ++i) text += digits(c.k[i]);
    text += "\n";
  }
  return text;
}

std::string print_colmap_images(const ColmapModel& model) {
  std::string text =
      "# Image list with two lines of data per image:\n"
      "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n";
  int id = 0;
  for (const ColmapImage& image : model.images) {
    const Pose& p = image.cam_from_world;
    text += std::to_string(++id);
    for (const double value : {p.rotation.w(), p.rotation.x(), p.rotation.y(), p.rotation.z(), p.translation.x(),
                               p.translation.y(), p.translation.z()})
      text += digits(value);
    text += " " + std::to_string(image.camera) + " " + image.name + "\n";
    for (const ColmapImage::Point& point : image.points)
      text += (&point == image.points.data() ? digits(point.pixel.x()).substr(1) : digits(point.pixel.x())) +
              digits(point.pixel.y()) + " " + std::to_string(point.point3d + 1);
    text += "\n";
  }
  return text;
}

std::string print_colmap_points(const ColmapModel& model) {
  std::string text =
      "# 3D point list with one line of data per point:\n"
      "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const ColmapPoint& point = model.points[i];
    text += std::to_string(i + 1);
    for (const double value : {point.place.x(), point.place.y(), point.place.z()}) text += digits(value);
    text += " 128 128 128" + digits(point.error_px);
    for (const auto& [image, index] : point.track)
      text += " " + std::to_string(image + 1) + " " + std::to_string(index);
    text += "\n";
  }
  return text;
}

}  // namespace lumihull::internal
