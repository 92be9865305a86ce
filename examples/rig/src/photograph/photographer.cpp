#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/rig/photographer.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "blur_map.h"
#include "develop.h"
#include "gaussian_blur.h"
#include "light/lit_scene.h"
#include "objects/noise.h"
#include "sheets/sheets.h"
#include "shutter.h"
#include "thin_lines.h"

namespace lumihull::rig {

using Eigen::Vector3d;
using Eigen::Vector3f;
using hull::Hit;
using hull::Ray;

namespace {

/// Directions (x, y, 1) through the corners of one row of pixels, in the camera's frame; a corner that the lens can't
/// see is NaN.
std::vector<Vector3d> corner_rays(const Camera& camera, int y) {
  std::vector<Vector3d> rays(static_cast<std::size_t>(camera.width) + 1);
  for (std::size_t x = 0; x < rays.size(); ++x)
    rays[x] = camera.ray({double(x), double(y)}).value_or(Vector3d::Constant(NAN));
  return rays;
}

/// The camera whose picture is 1/n of the size; its pixel (u, v) is place (n u, n v) of the full picture.
Camera reduced(const Camera& camera, int n) {
  Camera small = camera;
  small.width = (camera.width + n - 1) / n;
  small.height = (camera.height + n - 1) / n;
  small.f /= n, small.skew /= n, small.u0 /= n, small.v0 /= n;
  return small;
}

struct Exposure {
  Image light, cover, depth;  ///< f32: 3, 1, 1 channels
};

/// Takes the pixels of a block of rows.
class RowTracer {
 public:
  /// blur: of a lens or shutter that make any; else nullptr.
  RowTracer(const LitScene& scene, const View& view, const PhotoOptions& options, const Shutter& shutter,
            const BlurMap* blur, std::uint64_t seed)
      : scene_(scene),
        view_(view),
        options_(options),
        shutter_(shutter),
        blur_(blur),
        seed_(seed),
        world_from_cam_(view.cam_from_world.rotation.conjugate().toRotationMatrix()),
        origin_(view.center().cast<float>()) {}

  /// Rows are asked for in ascending order, one after the other.
  void row(int y, Exposure& out) {
    if (bottom_.empty()) bottom_ = corner_rays(view_.camera, y);
    top_ = std::exchange(bottom_, corner_rays(view_.camera, y + 1));
    y_ = y;
    blur_ ? blurred_row(out) : sharp_row(out);
    if (options_.depth) {
      const int width = view_.camera.width;
      sample(0, width, 1, rays_, hits_);
      float* depth = out.depth.row<float>(y);
      const Vector3f forward = (view_.cam_from_world.rotation.conjugate() * Vector3d::UnitZ()).cast<float>();
      for (int x = 0; x < width; ++x) {
        const Hit& hit = hits_[std::size_t(x)];
        depth[x] = hit ? hit.t * forward.dot(rays_[std::size_t(x)].direction) : 0;
      }
    }
  }

 private:
  void sharp_row(Exposure& out) {
    const int n = options_.rays, width = view_.camera.width;
    sample(0, width, n, rays_, hits_);
    for (int x = 0; x < width; ++x) {
      const std::size_t first = std::size_t(x) * std::size_t(n * n);
      std::span<const Ray> rays(rays_.data() + first, std::size_t(n * n));
      std::span<const Hit> hits(hits_.data() + first, std::size_t(n * n));
      // Next to an outline the first samples may all miss it: the neighbours' nearest columns are asked, too.
      const std::size_t before = x > 0 ? first - 1 : first, after = x + 1 < width ? first + std::size_t(n * n) : first;
      bool smooth = true;
      if (!alike(rays, hits) || bool(hits_[before]) != bool(hits[0]) || bool(hits_[after]) != bool(hits[0])) {
        sample(x, x + 1, options_.edge_rays, edge_rays_, edge_hits_);
        rays = edge_rays_;
        hits = edge_hits_;
        smooth = false;
      }
      set(out, x, integrate(rays, hits, smooth));
    }
  }

  /// How many rays a pixel gets is known before they are cast: were it to depend on what they meet, means would be
  /// drawn towards what is met more often.
  void blurred_row(Exposure& out) {
    const int width = view_.camera.width;
    for (int x0 = 0, x1 = 0; x0 < width; x0 = x1) {
      const BlurMap::Pixel pixel = blur_->at(x0, y_);
      for (x1 = x0 + 1; x1 < width && x1 < x0 + 256 && blur_->at(x1, y_) == pixel;) ++x1;
      sample_blurred(x0, x1, pixel.side);
      const std::size_t n = std::size_t(pixel.side) * std::size_t(pixel.side);
      for (int x = x0; x < x1; ++x) {
        const std::size_t first = std::size_t(x - x0) * n;
        set(out, x,
            integrate(std::span(rays_).subspan(first, n), std::span(hits_).subspan(first, n), pixel.plain_room));
      }
    }
  }

  void set(Exposure& out, int x, const std::pair<Vector3f, float>& seen) const {
    for (int c = 0; c < 3; ++c) out.light.row<float>(y_)[3 * x + c] = seen.first[c];
    out.cover.row<float>(y_)[x] = seen.second;
  }

  /// Direction in the camera's frame at a place of pixel x. Within a pixel directions are bilinear: the lens's
  /// curvature over one pixel is below 1e-6 px.
  Vector3d direction(int x, double u, double v) const {
    const std::size_t i = std::size_t(x);
    return (1 - v) * ((1 - u) * top_[i] + u * top_[i + 1]) + v * ((1 - u) * bottom_[i] + u * bottom_[i + 1]);
  }

  /// n x n rays for each of the pixels [x0, x1), a pixel's samples together, and what they meet.
  void sample(int x0, int x1, int n, std::vector<Ray>& rays, std::vector<Hit>& hits) const {
    rays.clear();
    for (int x = x0; x < x1; ++x)
      for (int b = 0; b < n; ++b)
        for (int a = 0; a < n; ++a) {
          const Vector3d d = world_from_cam_ * direction(x, (a + .5) / n, (b + .5) / n);
          Ray ray{origin_, d.cast<float>()};
          if (!d.allFinite()) ray = {origin_, Vector3f::UnitZ(), 0, 0};  // sees nothing
          rays.push_back(ray);
        }
    hits.resize(rays.size());
    scene_.hit(rays, hits);
  }

  /// The same through all of the lens, while the shutter is open; places within a pixel are jittered.
  void sample_blurred(int x0, int x1, int n) {
    rays_.clear();
    PixelSamples samples(n);
    for (int x = x0; x < x1; ++x) {
      const std::uint64_t hash = mix(seed_, (std::uint64_t(y_) << 32) + std::uint64_t(x));
      samples.shuffle(hash);
      for (int i = 0; i < n * n; ++i) {
        const std::uint64_t jitter = mix(hash, 0x10000 + std::uint64_t(i));
        const Vector3d d = direction(x, (i % n + unit_double(jitter)) / n, (i / n + unit_double(mix(jitter))) / n);
        Ray ray = shutter_.ray(d, samples.lens(i), samples.time(i));
        if (!d.allFinite()) ray = {origin_, Vector3f::UnitZ(), 0, 0};
        rays_.push_back(ray);
      }
    }
    hits_.resize(rays_.size());
    scene_.hit(rays_, hits_);
  }

  static bool unseen(const Ray& ray) { return ray.t_far == 0; }

  /// Whether a pixel's samples show one smooth piece of one thing.
  bool alike(std::span<const Ray> rays, std::span<const Hit> hits) {
    const bool first = bool(hits[0]);
    for (const Hit& hit : hits)
      if (bool(hit) != first) return false;
    if (first) {
      float near = hits[0].t, far = near;
      for (const Hit& hit : hits) near = std::min(near, hit.t), far = std::max(far, hit.t);
      return far < 1.02f * near;
    }
    // Of the room two opposite corners are asked: its edges are soft to the eye, and it is most of the picture.
    return scene_.room().hit(origin_, rays.front().direction).surface ==
           scene_.room().hit(origin_, rays.back().direction).surface;
  }

  /// Mean radiance and covered part. A pixel that is `smooth` and sees the room alone is worth one look at its middle.
  std::pair<Vector3f, float> integrate(std::span<const Ray> rays, std::span<const Hit> hits, bool smooth) const {
    Vector3f sum = Vector3f::Zero();
    int covered = 0, room = 0;
    Vector3f middle = Vector3f::Zero(), from = Vector3f::Zero();
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i]) {
        sum += scene_.object_radiance(rays[i], hits[i], options_.shown);
        ++covered;
      } else if (!unseen(rays[i]) && options_.shown != Shown::highlights_alone) {
        ++room;
        if (smooth)
          middle += rays[i].direction, from += rays[i].origin;
        else
          sum += scene_.room_radiance(scene_.room().hit(rays[i].origin, rays[i].direction));
      }
    }
    const float n = float(rays.size());
    if (smooth && room > 0) sum += float(room) * scene_.room_radiance(scene_.room().hit(from / float(room), middle));
    return {sum / n, float(covered) / n};
  }

  const LitScene& scene_;
  const View& view_;
  const PhotoOptions& options_;
  const Shutter& shutter_;
  const BlurMap* blur_;
  std::uint64_t seed_;
  Eigen::Matrix3d world_from_cam_;
  Vector3f origin_;
  int y_ = 0;
  std::vector<Vector3d> top_, bottom_;  ///< corner rays of the row
  std::vector<Ray> rays_, edge_rays_;
  std::vector<Hit> hits_, edge_hits_;
};

}  // namespace

void check(const PhotoOptions& o) {
  const auto within = [](double x, double low, double high) { return x >= low && x <= high; };
  const auto expect = [](bool good, const char* what) {
    if (!good) throw Error(ErrorCode::invalid_argument, what, "rig");
  };
  expect(within(o.rays, 1, 64) && within(o.edge_rays, 1, 64), "rays must be from 1 to 64 a side of a pixel");
  expect(within(o.exposure, 1e-6, 1e6), "the exposure (brightness) must be from 1e-6 to 1e6");
  expect(within(o.blur_px, 0, 100), "the lens's blur must be from 0 to 100 px");
  expect(within(o.full_well, 0, 1e12) && within(o.read_noise, 0, 1e9), "the sensor's noise is out of range");
  expect(within(o.reduce, 1, 64), "the picture must be traced at 1 to 1/64 of its size");
  expect(o.f_number == 0 || within(o.f_number, .5, 1000), "the f-number must be from 0.5 to 1000, or 0 for a pinhole");
  expect(within(o.focus_m, 0, 1e4), "the distance that is sharp must be from 0 to 10000 m");
  expect(within(o.sensor_width_mm, .1, 1e4), "the sensor's width must be from 0.1 to 10000 mm");
  expect(!o.depth || o.reduce == 1, "depth is known at full size only: not together with a reduced picture (--fast)");
}

PhotoOptions photo_options(Quality quality) {
  PhotoOptions options;
  if (quality == Quality::fast) options.reduce = 3;
  if (quality == Quality::fine) options.rays = 4, options.edge_rays = 12;
  return options;
}

LightOptions light_options(Quality quality) {
  LightOptions options;
  if (quality == Quality::fine) options.ambient_rays = 256, options.lamp_rays = 48, options.floor_texels = 320;
  return options;
}

struct Photographer::Impl {
  LitScene scene;
};

Photographer::Photographer(const Scene& scene, const LightOptions& options, Job& job)
    : impl_(new Impl{LitScene(scene, options, job)}) {}
Photographer::Photographer(Photographer&&) noexcept = default;
Photographer::~Photographer() = default;

Photo Photographer::photograph(const View& view, const PhotoOptions& options, std::uint64_t seed, Job& job,
                               std::span<const Pose> during) const {
  check(options);
  view.camera.validate();
  const LitScene& scene = impl_->scene;
  const auto inside = [&](const Pose& pose) { return scene.room().contains(pose.center().cast<float>()); };
  if (!inside(view.cam_from_world) || !std::all_of(during.begin(), during.end(), inside))
    throw Error(ErrorCode::invalid_argument, "the camera stands outside the enclosure, or in its pedestal", "rig");
  View small = view;
  small.camera = reduced(view.camera, options.reduce);
  const double center_depth = (view.cam_from_world * scene.center().cast<double>()).z();
  PhotoOptions lens = options;
  lens.sensor_width_mm *= double(small.camera.width) * options.reduce / view.camera.width;
  const Shutter shutter(small, lens, during, center_depth);
  const int width = small.camera.width, height = small.camera.height;
  Exposure exposure{Image(width, height, 3, PixelType::f32), Image(width, height, 1, PixelType::f32), {}};
  if (options.depth) exposure.depth = Image(width, height, 1, PixelType::f32);
  std::optional<BlurMap> blur;
  if (!shutter.still()) blur.emplace(scene, small, options, shutter, job);
  parallel_chunks(job, std::size_t(height), 8, [&](std::size_t first, std::size_t last) {
    RowTracer tracer(scene, small, options, shutter, blur ? &*blur : nullptr, mix(seed, 0x1e45));
    for (std::size_t y = first; y < last; ++y) tracer.row(int(y), exposure);
  });
  if (options.reduce > 1) {
    const auto enlarged = [&](Image& image) {
      if (!image.empty()) image = enlarge(image, options.reduce, view.camera.width, view.camera.height, job);
    };
    enlarged(exposure.light);
    enlarged(exposure.cover);
  }
  if (options.blur_px > 0) {
    gaussian_blur(exposure.light, options.blur_px);
    gaussian_blur(exposure.cover, options.blur_px);
  }
  if (options.shown != Shown::highlights_alone) {
    const Shutter full(view, options, during, center_depth);
    add_sheets(scene, view, full, options.blur_px, exposure.cover, exposure.light, job);
    add_lines(scene, view, options.lines, full, options.blur_px, exposure.light);
  }
  Photo photo;
  photo.picture = develop(exposure.light, options, mix(seed), job);
  photo.mask = converted(exposure.cover, PixelType::u8, 1);
  photo.depth = std::move(exposure.depth);
  return photo;
}

}  // namespace lumihull::rig
