// The photographs that the model of the targets is made from.
#include "model_photos.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace lumihull::calib::network {
namespace {

constexpr int kPictureCells = 6;     // along each side of a picture
constexpr double kCellWeight = 0.2;  // of a cell of the picture, beside a view of a body

/// From which side a body is seen: four quarters around, and from above or obliquely.
int side_of(const Sighting& s) {
  const Eigen::Vector3d eye = s.cam_from_body[0].center();  // z into the paper: the camera is at negative z
  const double tilt = std::atan2(std::hypot(eye.x(), eye.y()), std::abs(eye.z()));
  if (tilt < 0.35) return 0;
  return 1 + (eye.x() > 0) + 2 * (eye.y() > 0) + 4 * (tilt > 0.9);
}

}  // namespace

ModelPhotos choose_model_photos(const Network& n, int most) {
  ModelPhotos chosen;
  chosen.use.assign(n.photos.size(), false);
  chosen.reason.resize(n.photos.size());
  std::vector<int> candidates;
  for (std::size_t i = 0; i < n.photos.size(); ++i)
    if (!n.by_photo[i].empty()) candidates.push_back(int(i));
  if (most <= 0 || int(candidates.size()) <= most) {
    for (const int i : candidates) {
      chosen.use[std::size_t(i)] = true;
      chosen.reason[std::size_t(i)] = "all photographs with targets make the model";
    }
    return chosen;
  }
  std::map<std::pair<int, int>, int> views;        // (body, side) -> photographs
  std::map<int, int> body_views;                   // body -> photographs
  std::map<std::tuple<int, int, int>, int> cells;  // (camera, cell) -> photographs
  struct Cells {
    std::vector<std::tuple<int, int, int>> of;
  };
  std::vector<Cells> in_cells(n.photos.size());
  for (const int i : candidates) {
    const Camera& camera = n.camera_of(i);
    for (const int s : n.by_photo[std::size_t(i)])
      for (const std::uint32_t k : n.sightings[std::size_t(s)].seen) {
        const auto cell = [](double x, int size) {
          return std::clamp(int(x / size * kPictureCells), 0, kPictureCells - 1);
        };
        in_cells[std::size_t(i)].of.emplace_back(n.photos[std::size_t(i)].camera,
                                                 cell(n.seen[k].pixel.x(), camera.width),
                                                 cell(n.seen[k].pixel.y(), camera.height));
      }
    auto& of = in_cells[std::size_t(i)].of;
    std::sort(of.begin(), of.end());
    of.erase(std::unique(of.begin(), of.end()), of.end());
  }
  const auto gain = [&](int i) {
    double sum = 0;
    for (const int k : n.by_photo[std::size_t(i)]) {
      const Sighting& s = n.sightings[std::size_t(k)];
      if (s.poses == 0) continue;
      const auto v = views.find({s.body, side_of(s)});
      const int same = v == views.end() ? 0 : v->second;
      sum += (1 + 0.05 * std::min<double>(double(s.seen.size()), 25)) / ((1 + same) * (1 + same));
    }
    for (const auto& cell : in_cells[std::size_t(i)].of) {
      const auto c = cells.find(cell);
      const int count = c == cells.end() ? 0 : c->second;
      sum += kCellWeight / ((1 + count) * (1 + count));
    }
    return sum;
  };
  // Gains only fall: what was worth less than the best of the fresh ones need not be looked at again.
  std::vector<std::pair<double, int>> heap;
  for (const int i : candidates) heap.emplace_back(gain(i), -i);
  std::make_heap(heap.begin(), heap.end());
  for (int taken = 0; taken < most && !heap.empty();) {
    std::pop_heap(heap.begin(), heap.end());
    const auto [old, minus] = heap.back();
    const double now = gain(-minus);
    heap.pop_back();
    if (now < old && !heap.empty() && now < heap.front().first) {
      heap.emplace_back(now, minus);
      std::push_heap(heap.begin(), heap.end());
      continue;
    }
    const int i = -minus;
    int first_views = 0, new_sides = 0;
    for (const int k : n.by_photo[std::size_t(i)]) {
      const Sighting& s = n.sightings[std::size_t(k)];
      if (s.poses == 0) continue;
      new_sides += views[{s.body, side_of(s)}]++ == 0;
      first_views += body_views[s.body]++ == 0;
    }
    for (const auto& cell : in_cells[std::size_t(i)].of) ++cells[cell];
    chosen.use[std::size_t(i)] = true;
    std::string& why = chosen.reason[std::size_t(i)];
    if (first_views > 0)
      why = "first to show " + std::to_string(first_views) + (first_views == 1 ? " target" : " targets");
    else if (new_sides > 0)
      why = "shows " + std::to_string(new_sides) + (new_sides == 1 ? " target" : " targets") + " from a new side";
    else
      why = "adds most to what the model has";
    ++taken;
  }
  for (const int i : candidates)
    if (!chosen.use[std::size_t(i)])
      chosen.reason[std::size_t(i)] = "the model has enough views like this one; placed by resection, then adjusted with all";
  return chosen;
}

}  // namespace lumihull::calib::network
