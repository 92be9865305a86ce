#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/rig/scene.h>
#include <lumihull/rig/trajectory.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace lumihull::rig {

/// How finely the light that does not depend on the camera is computed, once a scene.
struct LightOptions {
  int ambient_rays = 64;  ///< paths a vertex or texel
  int lamp_rays = 12;     ///< a vertex or texel, for each lamp
  int bounces = 8;  ///< along a path, 1 … 1000; it ends earlier where less than 1 % of its light would come back
  int floor_texels = 160;  ///< along a side of the floor's light map; walls have a fifth of it
  float vertex_spacing =
      .01f;  ///< triangles are split until their edges are shorter than this part of the object's size
};

/// A cable or the like: a cylinder that is dark, thin, and throws no shadow.
struct ThinLine {
  Eigen::Vector3d from, to;                    ///< world, m
  float radius = .001f;                        ///< m
  Eigen::Vector3f color{.012f, .012f, .013f};  ///< radiance
};

/// What of the light a picture shows: a photograph is without_highlights + highlights_alone, as long as it is not
/// white.
enum class Shown : std::uint8_t {
  all,
  without_highlights,  ///< lamps light the scene, but objects don't mirror them; they mirror all the rest
  highlights_alone,    ///< objects mirror the lamps, all else is black; no sheets and lines
};

/// What happens between the lens and the file.
struct PhotoOptions {
  int rays = 2;        ///< rays x rays a pixel …
  int edge_rays = 6;   ///< … and so many where the first ones disagree: outlines
  double blur_px = 0;  ///< of the lens: sigma of a Gaussian, in linear light, 0 … 100
  /// Thin lens: its opening is focal length / f_number wide. 0: a pinhole, all is sharp; else 0.5 … 1000.
  double f_number = 0;
  double focus_m = 0;  ///< where the sharp plane is along the optical axis, m; 0: the scene's centre
  double sensor_width_mm = kSensorWidth_mm;  ///< says how many mm Camera::f is
  double exposure = 1;                       ///< radiance 1 / exposure is white
  double full_well = 25000;                  ///< electrons at white: shot noise. 0: none
  double read_noise = 9;                     ///< electrons
  bool bayer = false;                        ///< the sensor sees one colour a pixel (RGGB), demosaiced bilinearly
  bool depth = false;                        ///< fill Photo::depth
  Shown shown = Shown::all;
  std::vector<ThinLine> lines;  ///< objects hide them; masks don't know of them
  int reduce = 1;  ///< > 1: light is traced at 1/reduce of the size and enlarged bicubically; noise at full size
};

/// Error{invalid_argument} naming the first option that is out of range.
void check(const PhotoOptions& options);

/// Time against quality, for those who want to say it in one word. fast: a third of the size is traced. normal: what
/// the options' defaults are. fine: 4 times the rays and paths, finer light maps.
enum class Quality : std::uint8_t { fast, normal, fine };
PhotoOptions photo_options(Quality quality);
LightOptions light_options(Quality quality);

/// A photograph and the truth about it.
struct Photo {
  Image picture;  ///< 8-bit sRGB, 3 channels
  Image mask;     ///< 8-bit, 1 channel: the part of the pixel that objects cover, 255 = all
  Image depth;    ///< f32, 1 channel: z in the camera's frame at the pixel's centre, m; 0: no object. Or empty
};

/// Takes photographs of a scene. Light that does not depend on the camera (lamps with soft shadows, light from the
/// painted room) is computed once, at construction; highlights and reflections for each photograph.
/// Immutable after construction: any number of threads may take photographs.
class Photographer {
 public:
  /// Errors: invalid_argument (a room without extent), bad_input (an object's mesh).
  Photographer(const Scene& scene, const LightOptions& options, Job& job);
  Photographer(Photographer&&) noexcept;
  ~Photographer();

  /// `during`: cam_from_world at equally spaced moments from the shutter's opening to its closing, between which the
  /// camera moves evenly; empty: it stands at the view's pose. Focus and depth are the view's.
  /// The photograph is a function of scene, view, options, seed (of noise, and of where rays pass the lens, and when)
  /// and `during`, whatever the threads. Errors: invalid_argument (camera outside the enclosure, options out of range).
  Photo photograph(const View& view, const PhotoOptions& options, std::uint64_t seed, Job& job,
                   std::span<const Pose> during = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumihull::rig
