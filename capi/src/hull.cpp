#include <lumihull/hull/carve.h>
#include <lumihull/hull/region.h>

#include <vector>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

namespace {

constexpr size_t kMaxViews = 1'000'000;

hull::Box box_from(const double* six) {
  return {Eigen::Map<const Eigen::Vector3d>(six), Eigen::Map<const Eigen::Vector3d>(six + 3)};
}

/// A hull's options without the names of views.
hull::CarveOptions carve_options(const lh_carve_options* user) {
  const lh_carve_options o = read_struct(user, "options");
  hull::CarveOptions options;
  options.resolution = or_default(int(o.resolution), options.resolution);
  if (o.has_region) options.region = box_from(o.region);
  options.rule.tolerance = or_default(int(o.tolerance), options.rule.tolerance);
  options.rule.min_views = or_default(int(o.min_views), options.rule.min_views);
  options.min_component = std::max(0.0, or_default(o.min_component, options.min_component));
  array(o.cut_planes, o.cut_plane_count, 4, "cut_planes");
  for (size_t i = 0; i < o.cut_plane_count; ++i)
    options.rule.cut_planes.push_back(
        {Eigen::Map<const Eigen::Vector3d>(o.cut_planes + 4 * i), o.cut_planes[4 * i + 3]});
  array(o.cut_boxes, o.cut_box_count, 6, "cut_boxes");
  for (size_t i = 0; i < o.cut_box_count; ++i) options.rule.cut_boxes.push_back(box_from(o.cut_boxes + 6 * i));
  return options;
}

/// Views of n cameras that stand as far apart as the first one's struct_size says.
std::vector<View> views_from(size_t n, const lh_camera* cameras, const double* cam_from_world) {
  const size_t stride = checked_struct_size(given(cameras, "cameras").struct_size, "cameras");
  array(cam_from_world, n, 12, "cam_from_world");
  const auto* bytes = reinterpret_cast<const unsigned char*>(cameras);
  std::vector<View> views;
  views.reserve(n);
  for (size_t i = 0; i < n; ++i) {
    const auto* camera = reinterpret_cast<const lh_camera*>(bytes + i * stride);
    if (camera->struct_size != stride) invalid("expected the same struct_size in each", "cameras");
    views.push_back({camera_from(camera, "cameras"), pose_from(cam_from_world + 12 * i, "cam_from_world")});
  }
  return views;
}

}  // namespace

lh_status lh_hull_carve(lh_context* ctx, size_t n, const lh_camera* cameras, const double* cam_from_world,
                        const uint8_t* const* masks, const lh_carve_options* user, lh_mesh** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    if (n == 0 || n > kMaxViews) invalid("expected 1 to 1,000,000 views, found " + std::to_string(n), "n");
    hull::CarveOptions options = carve_options(user);
    const std::vector<View> views = views_from(n, cameras, cam_from_world);
    for (const uint8_t* mask : array(masks, n, 1, "masks")) given(mask, "masks");
    for (size_t i = 0; i < n; ++i) options.names.push_back("view " + std::to_string(i));
    const auto load = [&](size_t i) {
      Image mask = Image::uninitialized(views[i].camera.width, views[i].camera.height, 1);
      std::memcpy(mask.data(), masks[i], mask.bytes());
      return mask;
    };
    const auto silhouettes =
        hull::make_silhouettes(views, load, options.region, options.resolution, options.rule, options.names, job);
    give(out, hull::carve(views, silhouettes, options, job).mesh);
  });
}
