// What the importers share.

#include "import_common.h"

#include <fcntl.h>
#include <lumihull/base/parallel.h>
#include <lumihull/internal/small_matrices.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <set>
#include <system_error>

#include "claim.h"
#include "text.h"

namespace lumihull::internal {

namespace fs = std::filesystem;

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    lines.push_back(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  constexpr std::string_view kBlank = " \t";
  for (;;) {
    const std::size_t start = line.find_first_not_of(kBlank);
    if (start == std::string_view::npos) return words;
    line.remove_prefix(start);
    const std::size_t end = std::min(line.find_first_of(kBlank), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

std::optional<double> finite_number(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

void fail_at_line(const std::string& file, std::size_t line, const std::string& what) {
  throw Error(ErrorCode::bad_input, "line " + std::to_string(line) + ": " + what, file);
}

std::vector<ImageInfo> read_infos(const std::vector<fs::path>& files, Job& job) {
  std::vector<ImageInfo> infos(files.size());
  parallel_for(job, files.size(), [&](std::size_t i) { infos[i] = read_image_info(files[i]); });
  return infos;
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(ErrorCode::io, "can't make the folder: " + error.message(), folder.string());
}

void check_output(const fs::path& output) {
  std::error_code error;
  if (output.empty()) throw Error(ErrorCode::invalid_argument, "a folder for the new capture is needed");
  if (!fs::exists(output, error)) return;
  if (!fs::is_directory(output, error))
    throw Error(ErrorCode::invalid_argument, "a file is in the way of the new capture's folder", output.string());
  if (!fs::is_empty(output, error))
    throw Error(ErrorCode::invalid_argument, "the folder is in use: an import makes a new capture", output.string());
}

std::optional<Eigen::Matrix3d> rotation_within(const Eigen::Matrix3d& m, double tolerance) {
  if (!m.allFinite()) return std::nullopt;
  const internal::NearestRotation nearest = internal::nearest_rotation(m);
  if (nearest.reflected || (nearest.rotation - m).cwiseAbs().maxCoeff() > tolerance) return std::nullopt;
  return nearest.rotation;
}

Camera camera_from_matrix(const Eigen::Matrix3d& k, double shift, int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.f = k(1, 1);
  camera.s = k(0, 0) / k(1, 1);
  camera.skew = k(0, 1);
  camera.u0 = k(0, 2) + shift;
  camera.v0 = k(1, 2) + shift;
  return camera;
}

void merge_equal_cameras(Imported& imported) {
  const auto same = [](const Camera& a, const Camera& b) {
    if (a.width != b.width || a.height != b.height) return false;
    const double side = std::max(a.width, a.height);
    const auto near = [&](double x, double y, double unit) {
      return std::abs(x - y) <= 1e-10 * std::max(unit, std::abs(x));
    };
    return near(a.f, b.f, side) && near(a.s, b.s, 1) && near(a.skew, b.skew, side) && near(a.u0, b.u0, side) &&
           near(a.v0, b.v0, side) && a.k1 == b.k1 && a.k2 == b.k2 && a.k3 == b.k3 && a.p1 == b.p1 && a.p2 == b.p2;
  };
  std::vector<Camera> kept;
  std::vector<int> index(imported.cameras.size());
  for (std::size_t i = 0; i < imported.cameras.size(); ++i) {
    // Captures have few cameras, or one a photograph: looking at the latest 64 finds the first kind, and bounds the
    // second.
    const std::size_t from = kept.size() > 64 ? kept.size() - 64 : 0;
    std::size_t j = from;
    while (j < kept.size() && !same(kept[j], imported.cameras[i])) ++j;
    if (j == kept.size()) kept.push_back(imported.cameras[i]);
    index[i] = int(j);
  }
  imported.cameras = std::move(kept);
  for (ImportedPhoto& photo : imported.photos) photo.camera = index[std::size_t(photo.camera)];
}

namespace {

/// The folder that a capture is built in; removed unless it was put in place.
class Aside {
 public:
  explicit Aside(const fs::path& output) : output_(fs::absolute(output).lexically_normal()) {
    if (!output_.has_filename()) output_ = output_.parent_path();
    const fs::path beside = output_.parent_path();
    make_folder(beside);
    claim_ = claim(beside / ("." + output_.filename().string() + ".importing-"), ClaimKind::folder, output_);
  }
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;
  ~Aside() {
    std::error_code ignored;
    if (!in_place_) fs::remove_all(claim_.path, ignored);
    ::close(claim_.descriptor);
  }
  const fs::path& folder() const { return claim_.path; }

  void put_in_place() {
    if (::syncfs(claim_.descriptor) != 0)
      throw Error(ErrorCode::io, std::generic_category().message(errno), claim_.path.string());
    std::error_code error;
    fs::rename(claim_.path, output_, error);  // also over an empty folder
    if (error) throw Error(ErrorCode::io, "can't put the new capture in place: " + error.message(), output_.string());
    in_place_ = true;
  }

 private:
  fs::path output_;
  Claim claim_;
  bool in_place_ = false;
};

/// A part of a file's name: printable UTF-8 without slashes, and short.
std::string clean_part(const std::string& text, std::size_t most) {
  std::string part = printable(text, '_', most);
  std::replace_if(
      part.begin(), part.end(), [](char c) { return c == '/' || c == '\\'; }, '_');
  return part;
}

std::string clean_name(const std::string& text) {
  const std::string name = clean_part(text, 120);
  return name.empty() || name == "." || name == ".." ? "photo" : name;
}

/// The alpha channel as a mask; an empty picture where it is opaque everywhere.
Image mask_from_alpha(const Image& photo) {
  const Image rgba = converted(photo, PixelType::u8, 4);
  Image mask = Image::uninitialized(rgba.width(), rgba.height(), 1);
  bool opaque = true;
  for (int y = 0; y < rgba.height(); ++y) {
    const std::uint8_t* from = rgba.row<std::uint8_t>(y);
    std::uint8_t* to = mask.row<std::uint8_t>(y);
    for (int x = 0; x < rgba.width(); ++x) opaque &= (to[x] = from[4 * x + 3]) == 255;
  }
  return opaque ? Image() : mask;
}

}  // namespace

std::string unique_name(const fs::path& file, std::set<std::string>& taken) {
  const std::string stem = clean_name(file.stem().string());
  const std::string folder = clean_name(file.parent_path().filename().string());
  std::string extension = clean_part(file.extension().string(), 40);
  if (!extension.empty()) extension[0] = '_';
  for (const std::string& name : {stem, clean_name(folder + "_" + stem), clean_name(stem + extension)})
    if (taken.insert(name).second) return name;
  for (int i = 2;; ++i)
    if (const std::string name = stem + "_" + std::to_string(i); taken.insert(name).second) return name;
}

std::string copy_name(const std::string& name, const fs::path& file) {
  return name + clean_part(file.extension().string(), 40);
}

std::string reference_to(const fs::path& file) {
  std::error_code error;
  const std::string path = fs::canonical(file, error).string();
  if (error) throw Error(ErrorCode::io, "can't find out its path: " + error.message(), file.string());
  if (printable(path, '?') != path)
    throw Error(ErrorCode::unsupported,
                "a path that is not UTF-8, or holds control characters, can't be referred to: copy the photograph",
                file.string());
  return path;
}

Capture build_capture(Imported imported, const std::vector<ImageInfo>& infos, const ImportOptions& options, Job& job) {
  check_output(options.output);
  if (imported.photos.empty()) throw Error(ErrorCode::bad_input, "nothing to import: no photographs");
  for (std::size_t i = 0; i < imported.photos.size(); ++i) {
    const Camera& camera = imported.cameras.at(std::size_t(imported.photos[i].camera));
    if (infos[i].width != camera.width || infos[i].height != camera.height)
      throw Error(ErrorCode::bad_input,
                  "the photograph has " + std::to_string(infos[i].width) + " x " + std::to_string(infos[i].height) +
                      " pixels, its camera " + std::to_string(camera.width) + " x " + std::to_string(camera.height),
                  imported.photos[i].file.string());
  }
  for (const Camera& camera : imported.cameras) camera.validate();

  Aside aside(options.output);
  Capture capture = Capture::create(aside.folder());
  capture.cameras = std::move(imported.cameras);
  capture.notes = std::move(imported.notes);
  std::set<std::string> taken;
  for (std::size_t i = 0; i < imported.photos.size(); ++i) {
    const ImportedPhoto& photo = imported.photos[i];
    Shot shot;
    shot.name = unique_name(photo.file, taken);
    shot.file = options.reference ? reference_to(photo.file) : "photos/" + copy_name(shot.name, photo.file);
    shot.camera = photo.camera;
    shot.orientation = infos[i].orientation;
    shot.cam_from_world = photo.cam_from_world;
    shot.time = infos[i].time;
    capture.shots.push_back(std::move(shot));
  }
  if (!options.reference) make_folder(aside.folder() / "photos");
  std::vector<char> masked(capture.shots.size(), 0);
  job.begin("importing photographs", capture.shots.size());
  parallel_for(
      job, capture.shots.size(),
      [&](std::size_t i) {
        Shot& shot = capture.shots[i];
        const fs::path& source = imported.photos[i].file;
        if (!options.reference) {
          std::error_code error;
          fs::copy_file(source, capture.photo_path(shot), error);
          if (error) throw Error(ErrorCode::io, "can't copy the photograph: " + error.message(), source.string());
        }
        shot.stamp = Capture::stamp(capture.photo_path(shot));
        if (!imported.alpha_is_mask || infos[i].channels != 4) return;
        const Image mask = mask_from_alpha(read_image(source));
        if (mask.empty()) return;
        capture.write_mask(i, mask, MaskSource::imported);
        masked[i] = 1;
      },
      true);
  job.end();
  if (const auto count = std::count(masked.begin(), masked.end(), 1); count > 0) {
    capture.notes.push_back("masks of " + std::to_string(count) +
                            " photographs were taken from their alpha channels; pictures are judged on white");
    capture.background_rgb = {255, 255, 255};
  }
  capture.save();
  aside.put_in_place();
  return Capture::open(options.output);
}

}  // namespace lumihull::internal
