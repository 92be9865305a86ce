// NeRF's transforms*.json (Mildenhall et al. 2020; the further fields are instant-ngp's and nerfstudio's).

#include <lumihull/base/files.h>
#include <lumihull/internal/json.h>

#include <array>
#include <cmath>
#include <numbers>

#include "import_common.h"
#include "lens_models.h"
#include "nerf_json.h"

namespace lumihull {
namespace internal {

namespace {

constexpr double kMaxNumber = 1e9;

std::optional<double> optional_number(const JsonReader& json, std::string_view key, double low) {
  if (!json.has(key) || json.at(key).value().is_null()) return std::nullopt;
  return json.at(key).number(low, kMaxNumber);
}

void read_intrinsics(const JsonReader& json, NerfIntrinsics& i) {
  const auto take = [&](std::string_view key, std::optional<double>& to, double low) {
    if (const auto value = optional_number(json, key, low)) to = value;
  };
  for (const auto& [key, to] : {std::pair{"camera_angle_x", &i.angle_x}, std::pair{"camera_angle_y", &i.angle_y}})
    if (json.has(key)) *to = json.at(key).number(1e-6, std::numbers::pi - 1e-6);
  take("fl_x", i.fx, 1e-6);
  take("fl_y", i.fy, 1e-6);
  take("cx", i.cx, -kMaxNumber);
  take("cy", i.cy, -kMaxNumber);
  take("w", i.width, 1);
  take("h", i.height, 1);
  constexpr std::array<const char*, 6> kLens = {"k1", "k2", "k3", "k4", "p1", "p2"};
  for (std::size_t k = 0; k < kLens.size(); ++k)
    if (const auto value = optional_number(json, kLens[k], -kMaxNumber)) i.lens[k] = *value;
  if (json.has("is_fisheye")) i.fisheye = json.at("is_fisheye").boolean();
  if (json.has("camera_model")) {
    const std::string model = json.at("camera_model").string(100);
    if (model == "OPENCV_FISHEYE")
      i.fisheye = true;
    else if (model != "OPENCV" && model != "PINHOLE" && model != "SIMPLE_PINHOLE")
      throw Error(ErrorCode::unsupported,
                  "at /camera_model: " + model + "; known are PINHOLE, OPENCV and OPENCV_FISHEYE", json.file());
  }
}

}  // namespace

std::vector<NerfFrame> parse_nerf(std::string_view text, const std::string& file) {
  const Json document = parse_json(text, file);
  const JsonReader top(document, file);
  NerfIntrinsics shared;
  const JsonReader frames = top.at("frames");
  const std::size_t count = frames.array_size(1'000'000);
  if (count == 0) frames.fail("at least one frame");
  read_intrinsics(top, shared);
  std::vector<NerfFrame> result;
  for (std::size_t i = 0; i < count; ++i) {
    const JsonReader frame = frames.at(i);
    NerfFrame entry;
    entry.pointer = "/frames/" + std::to_string(i);
    entry.file = frame.at("file_path").string();
    if (entry.file.empty()) frame.at("file_path").fail("the name of a photograph");
    entry.intrinsics = shared;
    read_intrinsics(frame, entry.intrinsics);
    const JsonReader matrix = frame.at("transform_matrix");
    const std::size_t rows = matrix.array_size(4);
    if (rows != 4 && rows != 3) matrix.fail("a 4 x 4 matrix");
    Eigen::Matrix<double, 3, 4> world_from_cam;
    for (std::size_t r = 0; r < rows; ++r) {
      if (matrix.at(r).array_size(4) != 4) matrix.at(r).fail("4 numbers");
      for (std::size_t c = 0; c < 4; ++c) {
        const double value = matrix.at(r).at(c).number();
        if (r < 3) world_from_cam(int(r), int(c)) = value;
        if (r == 3 && std::abs(value - (c == 3 ? 1 : 0)) > 1e-6) matrix.at(r).fail("the row 0 0 0 1");
      }
    }
    const auto rotation = rotation_within(world_from_cam.leftCols<3>(), 1e-3);
    if (!rotation) matrix.fail("a rotation (orthogonal, determinant 1) in the left 3 x 3 block");
    // OpenGL's camera looks along -z with y up: two axes change sign.
    const Eigen::Matrix3d flip = Eigen::Vector3d(1, -1, -1).asDiagonal();
    const Eigen::Matrix3d r = flip * rotation->transpose();
    entry.cam_from_world = Pose::from_matrix(r, -(r * world_from_cam.col(3)));
    result.push_back(std::move(entry));
  }
  return result;
}

namespace {

std::filesystem::path find_photo(const std::filesystem::path& folder, const NerfFrame& frame, const std::string& json) {
  const std::filesystem::path base = folder / frame.file;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(base, ignored)) return base;
  for (const char* extension : {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG", ".exr", ".tif", ".webp"}) {
    std::filesystem::path file = base;
    file += extension;
    if (std::filesystem::is_regular_file(file, ignored)) return file;
  }
  throw Error(ErrorCode::not_found,
              "no such photograph, with or without .png, .jpg, … (" + frame.pointer + "/file_path of " + json + ")",
              base.string());
}

ForwardCamera forward_camera(const NerfFrame& frame, const ImageInfo& info, const std::string& file) {
  const NerfIntrinsics& i = frame.intrinsics;
  ForwardCamera c;
  c.width = info.width;
  c.height = info.height;
  if ((i.width && *i.width != info.width) || (i.height && *i.height != info.height))
    throw Error(ErrorCode::bad_input,
                "at " + frame.pointer + ": w and h say " + std::to_string(int(i.width.value_or(info.width))) + " x " +
                    std::to_string(int(i.height.value_or(info.height))) + " pixels, the photograph has " +
                    std::to_string(info.width) + " x " + std::to_string(info.height),
                file);
  if (i.fx)
    c.fx = *i.fx;
  else if (i.angle_x)
    c.fx = 0.5 * info.width / std::tan(0.5 * *i.angle_x);
  else
    throw Error(ErrorCode::bad_input, "at " + frame.pointer + ": expected fl_x or camera_angle_x, here or for the file",
                file);
  c.fy = i.fy ? *i.fy : !i.fx && i.angle_y ? 0.5 * info.height / std::tan(0.5 * *i.angle_y) : c.fx;
  c.cx = i.cx.value_or(info.width / 2.0);
  c.cy = i.cy.value_or(info.height / 2.0);
  const auto& l = i.lens;
  if (i.fisheye) {
    c.lens = ForwardCamera::Lens::fisheye;
    for (int k = 0; k < 4; ++k) c.k[k] = l[std::size_t(k)];
  } else if (l != std::array<double, 6>{}) {
    c.lens = ForwardCamera::Lens::opencv;  // k4 is the first of OpenCV's denominator
    for (int k = 0; k < 4; ++k) c.k[k] = l[std::size_t(k)];
    c.p1 = l[4];
    c.p2 = l[5];
  }
  return c;
}

bool same(const ForwardCamera& a, const ForwardCamera& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy &&
         a.lens == b.lens && std::equal(a.k, a.k + 6, b.k) && a.p1 == b.p1 && a.p2 == b.p2;
}

}  // namespace
}  // namespace internal

Capture import_nerf(std::span<const std::filesystem::path> files, const RefitImportOptions& options, Job& job) {
  using namespace internal;
  check_output(options.output);
  std::vector<NerfFrame> frames;
  std::vector<std::string> sources;
  std::vector<std::filesystem::path> photos;
  for (const auto& file : files) {
    for (NerfFrame& frame : parse_nerf(read_file(file, std::size_t(1) << 28), file.string())) {
      photos.push_back(find_photo(file.parent_path(), frame, file.string()));
      frames.push_back(std::move(frame));
      sources.push_back(file.string());
    }
  }
  const std::vector<ImageInfo> infos = read_infos(photos, job);
  Imported imported;
  imported.alpha_is_mask = true;
  std::vector<ForwardCamera> known;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    job.check();
    const ForwardCamera theirs = forward_camera(frames[i], infos[i], sources[i]);
    auto at = std::find_if(known.begin(), known.end(), [&](const ForwardCamera& c) { return same(c, theirs); });
    const int index = int(at - known.begin());
    if (at == known.end()) {
      known.push_back(theirs);
      const Refit refit = refit_camera(theirs, options.max_refit_error_px, sources[i] + " " + frames[i].pointer);
      if (theirs.lens != ForwardCamera::Lens::none) imported.notes.push_back(refit_note(index, refit));
      imported.cameras.push_back(refit.camera);
    }
    imported.photos.push_back({photos[i], index, frames[i].cam_from_world});
  }
  return build_capture(std::move(imported), infos, options, job);
}

}  // namespace lumihull
