#include <lumihull/base/error.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/highlights.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "bright_spots.h"
#include "color.h"

namespace lumihull::slf {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kSmoothing = 0.004, kReach = 0.05, kLeastStep = 0.01;  // of the shorter side
constexpr float kLeastHeight = 0.02f, kProminence = 1.0f / 3;
constexpr float kSeen = 0.5f, kFound = 0.3f;  // of the height in truth, in the photograph
constexpr float kStayed = 0.5f;               // of the height of the one that it would have become
constexpr double kApart = 1.5;  // times as far as the nearest highlight must the next one be, to tell them apart
constexpr const char* kPhotograph = "photograph";

using Levels = std::array<float, 256>;

Levels light_levels() {
  Levels light;
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = linear_from_srgb(unit_of_srgb8(std::uint8_t(i)));
  return light;
}

float luminance(const std::uint8_t* p, const Levels& light) {
  return 0.2126f * light[p[0]] + 0.7152f * light[p[1]] + 0.0722f * light[p[2]];
}

int smoothing_radius(const Plane& p) { return std::max(1, int(std::lround(kSmoothing * std::min(p.width, p.height)))); }

bool fits(const Image& image, const Camera& camera) {
  return image.type() == PixelType::u8 && (image.channels() == 3 || image.channels() == 4) &&
         image.width() == camera.width && image.height() == camera.height;
}

/// At each pixel how much a misplacement by one pixel, the worst of four, changes a picture that is smoothed then.
Plane shaken(const Plane& picture) {
  const int w = picture.width, h = picture.height, r = smoothing_radius(picture);
  Plane most{w, h, std::vector<float>(picture.values.size(), 0)}, change = most;
  constexpr int kShifts[][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  for (const auto& [dx, dy] : kShifts) {
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        change.values[std::size_t(y) * std::size_t(w) + std::size_t(x)] =
            picture.at(std::clamp(x + dx, 0, w - 1), std::clamp(y + dy, 0, h - 1)) - picture.at(x, y);
    smooth(change, r);
    for (std::size_t i = 0; i < most.values.size(); ++i)
      most.values[i] = std::max(most.values[i], std::abs(change.values[i]));
  }
  return most;
}

/// As far around a place as smoothing reaches.
float largest_near(const Plane& plane, const Vector2d& pixel) {
  const int r = smoothing_radius(plane) + 1, x = int(pixel.x()), y = int(pixel.y());
  float most = 0;
  for (int j = std::max(0, y - r); j <= std::min(plane.height - 1, y + r); ++j)
    for (int i = std::max(0, x - r); i <= std::min(plane.width - 1, x + r); ++i) most = std::max(most, plane.at(i, j));
  return most;
}

/// Where a highlight is, in a picture and on the surface.
struct Place {
  Vector2d pixel;
  std::optional<Vector3d> point;
  float height = 0;
  bool faked = false;  ///< could be, by paint that is misplaced: known, lest others are taken for it, but not asked for
};

/// What a method's picture shows.
struct Shown {
  std::vector<Place> places;
  std::vector<std::optional<std::size_t>> found;  ///< for each true place, which of them
};

struct JudgedView {
  View view;
  Plane without;              ///< linear luminance
  std::vector<Place> places;  ///< the true ones
  std::map<std::string, Shown> shown;
};

}  // namespace

struct HighlightJudge::Impl {
  hull::RayScene surface;
  Levels light;  ///< of sRGB bytes
  std::vector<JudgedView> views;
  std::map<std::string, std::size_t> pictures;  ///< views that a method has one of

  std::optional<Vector3d> on_surface(const View& view, const Vector2d& pixel) const {
    const auto ray = view.camera.ray(pixel);
    if (!ray) return std::nullopt;
    const Vector3d eye = view.center(), way = view.cam_from_world.rotation.conjugate() * *ray;
    const hull::Hit hit = surface.hit({eye.cast<float>(), way.cast<float>()});
    if (!hit) return std::nullopt;
    return eye + double(hit.t) * way;
  }

  Plane gloss_of(const JudgedView& v, const Image& picture) const {
    Plane gloss = v.without;
    for (int y = 0; y < gloss.height; ++y) {
      const std::uint8_t* row = picture.row<std::uint8_t>(y);
      float* out = &gloss.values[std::size_t(y) * std::size_t(gloss.width)];
      for (int x = 0; x < gloss.width; ++x) out[x] = luminance(row + picture.channels() * x, light) - out[x];
    }
    smooth(gloss, smoothing_radius(gloss));
    return gloss;
  }

  std::vector<Place> places_of(const View& view, const Plane& gloss) const {
    std::vector<Place> places;
    for (const BrightSpot& spot : bright_spots(gloss, kLeastHeight, kProminence)) {
      auto point = on_surface(view, spot.pixel);
      if (!point) point = on_surface(view, spot.peak);  // the centroid of a bent one may lie beside the object
      places.push_back({.pixel = spot.pixel, .point = point, .height = spot.height});
    }
    return places;
  }

  /// For each true place, the picture's that is nearest.
  Shown measured(const std::string& method, const Image& picture) const;
};

Shown HighlightJudge::Impl::measured(const std::string& method, const Image& picture) const {
  const JudgedView& v = views.back();
  const double reach = kReach * std::min(v.without.width, v.without.height);
  Shown shown{places_of(v.view, gloss_of(v, picture)), {}};
  for (std::size_t i = 0; i < v.places.size(); ++i) {
    float least = kSeen * v.places[i].height;
    if (method != kPhotograph) {
      const Shown& photograph = v.shown.at(kPhotograph);
      least = kFound * photograph.places[*photograph.found[i]].height;
    }
    std::optional<std::size_t> best;
    double nearest = reach;
    for (std::size_t k = 0; k < shown.places.size(); ++k) {
      const double distance = (shown.places[k].pixel - v.places[i].pixel).norm();
      if (shown.places[k].height < least || !shown.places[k].point || distance > nearest) continue;
      nearest = distance, best = k;
    }
    shown.found.push_back(best);
  }
  return shown;
}

namespace {

/// Index of the nearest place on the surface, if no other is about as near.
std::optional<std::size_t> nearest(const std::vector<Place>& places, const Vector3d& point) {
  double first = std::numeric_limits<double>::infinity(), second = first;
  std::size_t best = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double d = (*places[i].point - point).norm();
    if (d < first)
      second = first, first = d, best = i;
    else
      second = std::min(second, d);
  }
  if (places.empty() || !(first * kApart < second)) return std::nullopt;
  return best;
}

/// A highlight in the views that follow one another from `first` on: its index among each view's places.
struct Track {
  std::size_t first = 0;
  std::vector<std::size_t> places;
};

std::vector<Track> tracks_of(const std::vector<JudgedView>& views) {
  std::vector<Track> tracks;
  std::map<std::size_t, std::size_t> open;  // of the tracks that reach a view, by its place there
  for (std::size_t v = 0; v + 1 < views.size(); ++v) {
    std::map<std::size_t, std::size_t> going_on;
    const auto &here = views[v].places, &there = views[v + 1].places;
    for (std::size_t i = 0; i < here.size(); ++i) {
      const auto next = nearest(there, *here[i].point);
      if (!next || nearest(here, *there[*next].point) != i || here[i].faked || there[*next].faked) continue;
      const auto [known, begins] = open.try_emplace(i, tracks.size());
      if (begins) tracks.push_back({v, {i}});
      going_on[*next] = known->second;
      tracks[known->second].places.push_back(*next);
    }
    open = std::move(going_on);
  }
  return tracks;
}

/// How far a highlight has moved over the surface: its place in a later view less where the surface's point of before
/// is.
std::optional<Vector2d> way(const Place& before, const Place& after, const View& later) {
  const auto carried = later.project(*before.point);
  return carried ? std::optional<Vector2d>(after.pixel - *carried) : std::nullopt;
}

/// The way from `before` to a place of a later view; none where the picture shows there one that is nearer to where
/// `before` was, and half as bright: then this one stayed, and the other is not the same.
std::optional<Vector2d> way(const Place& before, const Shown& later, std::size_t after, const View& view) {
  const auto moved = way(before, later.places[after], view);
  for (const Place& other : later.places)
    if (const auto stayed = way(before, other, view);
        moved && stayed && stayed->norm() < moved->norm() && other.height > kStayed * later.places[after].height)
      return std::nullopt;
  return moved;
}

HighlightPath path_of(const std::string& method, const std::vector<JudgedView>& views,
                      const std::vector<Track>& tracks) {
  HighlightPath path;
  double squares = 0, followed = 0, weights = 0, counted = 0;
  for (const Track& track : tracks) {
    ++path.tracks;
    for (std::size_t k = 0, before = 0; k < track.places.size(); ++k) {
      const JudgedView &view = views[track.first + k], &last = views[track.first + before];
      const Shown &shown = view.shown.at(method), &shown_last = last.shown.at(method);
      const Place &known = view.places[track.places[k]], &known_last = last.places[track.places[before]];
      const auto found = shown.found[track.places[k]], found_last = shown_last.found[track.places[before]];
      ++path.places;
      if (found) {
        ++path.found;
        squares += double(known.height) * (shown.places[*found].pixel - known.pixel).squaredNorm();
        weights += double(known.height);
      }
      const auto step = way(known_last, known, view.view);
      const double length = step ? step->norm() : 0;
      if (length < kLeastStep * std::min(view.without.width, view.without.height)) continue;
      const double weight = double(std::min(known.height, known_last.height));
      path.true_length_px += length;
      counted += weight * length;
      if (found && found_last)
        if (const auto moved = way(shown_last.places[*found_last], shown, *found, view.view))
          followed += weight * std::clamp(moved->dot(*step) / length, 0.0, length);
      before = k;
    }
  }
  path.share = counted > 0 ? followed / counted : 0;
  path.rms_px = weights > 0 ? std::sqrt(squares / weights) : 0;
  return path;
}

}  // namespace

HighlightJudge::HighlightJudge(const hull::Mesh& surface)
    : impl_(new Impl{hull::RayScene(surface), light_levels(), {}, {}}) {}
HighlightJudge::HighlightJudge(HighlightJudge&&) noexcept = default;
HighlightJudge::~HighlightJudge() = default;

void HighlightJudge::add_view(const View& view, const Image& without, const Image& alone, const Image& photograph) {
  view.camera.validate();
  for (const Image* image : {&without, &alone, &photograph})
    if (!fits(*image, view.camera))
      throw Error(ErrorCode::invalid_argument, "expected 8-bit RGB or RGBA pictures of the camera's size");
  Impl& impl = *impl_;
  JudgedView v{view, {without.width(), without.height(), {}}, {}, {}};
  Plane gloss = v.without;
  const auto seen = [&](const std::uint8_t* w, const std::uint8_t* a, int c) {
    return std::min(impl.light[a[c]], 1 - impl.light[w[c]]);
  };
  for (int y = 0; y < gloss.height; ++y)
    for (int x = 0; x < gloss.width; ++x) {
      const std::uint8_t* w = without.row<std::uint8_t>(y) + without.channels() * x;
      const std::uint8_t* a = alone.row<std::uint8_t>(y) + alone.channels() * x;
      v.without.values.push_back(luminance(w, impl.light));
      gloss.values.push_back(0.2126f * seen(w, a, 0) + 0.7152f * seen(w, a, 1) + 0.0722f * seen(w, a, 2));
    }
  smooth(gloss, smoothing_radius(gloss));
  v.places = impl.places_of(view, gloss);
  std::erase_if(v.places, [](const Place& p) { return !p.point; });
  const Plane doubt = shaken(v.without);
  for (Place& p : v.places) p.faked = kFound * p.height < largest_near(doubt, p.pixel);
  impl.views.push_back(std::move(v));
  JudgedView& added = impl.views.back();
  Shown shown = impl.measured(kPhotograph, photograph);
  // What the photograph does not show can't be asked of a model.
  std::vector<Place> seen_places;
  std::vector<std::optional<std::size_t>> found;
  for (std::size_t i = 0; i < added.places.size(); ++i)
    if (shown.found[i]) seen_places.push_back(added.places[i]), found.push_back(shown.found[i]);
  added.places = std::move(seen_places);
  shown.found = std::move(found);
  added.shown[kPhotograph] = std::move(shown);
  ++impl.pictures[kPhotograph];
}

void HighlightJudge::add_picture(const std::string& method, const Image& picture) {
  Impl& impl = *impl_;
  if (impl.views.empty() || method == kPhotograph || impl.pictures[method] + 1 != impl.views.size())
    throw Error(ErrorCode::invalid_argument, "expected one picture of each view, after the view", method);
  if (!fits(picture, impl.views.back().view.camera))
    throw Error(ErrorCode::invalid_argument, "expected 8-bit RGB or RGBA pictures of the camera's size", method);
  impl.views.back().shown[method] = impl.measured(method, picture);
  ++impl.pictures[method];
}

std::map<std::string, HighlightPath> HighlightJudge::paths() const {
  const std::vector<Track> tracks = tracks_of(impl_->views);
  std::map<std::string, HighlightPath> paths;
  for (const auto& [method, count] : impl_->pictures) {
    if (count != impl_->views.size()) continue;
    const HighlightPath path = path_of(method, impl_->views, tracks);
    if (path.true_length_px > 0) paths[method] = path;
  }
  return paths;
}

}  // namespace lumihull::slf
