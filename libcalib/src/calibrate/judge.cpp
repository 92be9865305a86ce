// What does not fit: observations, misread targets, other tilts, targets that moved.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "grow.h"
#include "settle.h"

namespace lumihull::calib::network {
namespace {

constexpr double kMedianOfRayleigh = 1.1774;
constexpr double kMisfit_px = 1;         // a photograph that is off by less as a whole is the model's fault
constexpr double kMostOff = 0.5;         // of a detection's points: then it is the detection that is wrong
constexpr double kClearlyBetter = 0.7;   // of the clipped cost
constexpr std::size_t kSecondPlace = 3;  // detections that must agree on another place
constexpr double kInOrder = 0.9;         // of the photographs before and after a move

double clipped_cost(const Network& n, const Sighting& s, const Pose& cam_from_body) {
  const double off = rough_distance(n, s, cam_from_body);
  return std::min(1.0, off * off);
}

/// Scale of each photograph's own residuals, in units of their covariances', where as a whole they are small: what a
/// model of the lens leaves over grows where few photographs look, and they must not be taken for outliers one by one
/// until the others agree with a wrong camera. 0 for all others.
std::vector<double> own_scales(const Network& n, int part, const std::vector<double>& sigmas,
                               const std::vector<double>& off_px) {
  std::vector<std::vector<double>> in_sigma(n.photos.size()), in_px(n.photos.size());
  for (std::size_t k = 0; k < n.seen.size(); ++k) {
    const auto photo = std::size_t(n.seen[k].photo);
    if (n.photo_part[photo] != part || !(sigmas[k] >= 0)) continue;
    in_sigma[photo].push_back(sigmas[k]);
    in_px[photo].push_back(off_px[k]);
  }
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  std::vector<double> scales(n.photos.size(), 0);
  for (std::size_t i = 0; i < scales.size(); ++i)
    if (!in_px[i].empty() && median(in_px[i]) < kMisfit_px) scales[i] = median(in_sigma[i]) / kMedianOfRayleigh;
  return scales;
}

}  // namespace

double residual_scale(const Network& n, int part) {
  std::vector<double> sample;
  for (const Seen& s : n.seen) {
    if (!s.counts || n.photo_part[std::size_t(s.photo)] != part || n.body_part[std::size_t(s.body)] != part) continue;
    if (const auto error = error_of(n, s)) sample.push_back(in_sigmas(s, *error));
  }
  if (sample.empty()) return 1;
  const auto middle = sample.begin() + std::ptrdiff_t(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  return *middle / kMedianOfRayleigh;
}

int judge(Network& n, int part, double outlier_sigma, double* scale) {
  std::vector<double> off(n.seen.size(), -1), off_px(n.seen.size(), -1);
  for (std::size_t k = 0; k < n.seen.size(); ++k) {
    const Seen& s = n.seen[k];
    if (n.photo_part[std::size_t(s.photo)] != part || n.body_part[std::size_t(s.body)] != part) continue;
    const auto error = error_of(n, s);
    off[k] = error ? in_sigmas(s, *error) : std::numeric_limits<double>::infinity();
    off_px[k] = error ? error->norm() : std::numeric_limits<double>::infinity();
  }
  *scale = std::max(1.0, residual_scale(n, part));
  const std::vector<double> own = own_scales(n, part, off, off_px);
  int changed = 0;
  for (Sighting& sighting : n.sightings) {
    if (n.photo_part[std::size_t(sighting.photo)] != part || n.body_part[std::size_t(sighting.body)] != part) continue;
    const double limit = outlier_sigma * std::max(*scale, own[std::size_t(sighting.photo)]);
    std::map<int, std::pair<int, int>> detections;  // (beyond the limit, all)
    for (const std::uint32_t k : sighting.seen) {
      auto& [beyond, all] = detections[n.seen[k].detection];
      beyond += off[k] > limit;
      ++all;
    }
    bool any = false;
    for (const std::uint32_t k : sighting.seen) {
      const auto& [beyond, all] = detections[n.seen[k].detection];
      const bool counts = off[k] <= limit && beyond <= kMostOff * all;
      changed += counts != n.seen[k].counts;
      n.seen[k].counts = counts;
      any = any || counts;
    }
    sighting.counts = any;
  }
  return changed;
}

int second_look(Network& n, int part, Job& job) {
  std::vector<std::uint8_t> changed(n.photos.size() + n.bodies.size(), 0);
  std::vector<Pose> better(changed.size());
  parallel_for(job, n.photos.size(), [&](std::size_t i) {
    if (n.photo_part[i] != part) return;
    std::vector<int> sightings;
    for (const int s : n.by_photo[i])
      if (n.body_part[std::size_t(n.sightings[std::size_t(s)].body)] == part && n.sightings[std::size_t(s)].poses > 0)
        sightings.push_back(s);
    const auto cost = [&](const Pose& cam_from_world) {
      double sum = 0;
      for (const int s : sightings) {
        const Sighting& t = n.sightings[std::size_t(s)];
        sum += clipped_cost(n, t, cam_from_world * n.bodies[std::size_t(t.body)].body.world_from_body);
      }
      return sum;
    };
    const double now = cost(*n.cam_from_world[i]);
    double least = kClearlyBetter * now - 0.05;
    for (const int s : sightings) {
      const Sighting& t = n.sightings[std::size_t(s)];
      for (int p = 0; p < t.poses; ++p) {
        const Pose pose =
            t.cam_from_body[std::size_t(p)] * n.bodies[std::size_t(t.body)].body.world_from_body.inverse();
        if (const double c = cost(pose); c < least) least = c, better[i] = pose, changed[i] = 1;
      }
    }
  });
  parallel_for(job, n.bodies.size(), [&](std::size_t b) {
    if (n.body_part[b] != part) return;
    std::vector<int> sightings;
    for (const int s : n.by_body[b])
      if (n.photo_part[std::size_t(n.sightings[std::size_t(s)].photo)] == part && n.sightings[std::size_t(s)].poses > 0)
        sightings.push_back(s);
    if (sightings.empty()) return;
    double now = 0, then = 0;
    const auto place = agreed_place(n, sightings);
    if (!place) return;
    for (const int s : sightings) {
      const Sighting& t = n.sightings[std::size_t(s)];
      const Pose& camera = *n.cam_from_world[std::size_t(t.photo)];
      now += clipped_cost(n, t, camera * n.bodies[b].body.world_from_body);
      then += clipped_cost(n, t, camera * place->world_from_body);
    }
    const std::size_t agree = place->sightings.size();
    if (then < kClearlyBetter * now - 0.05 ||
        (then < now + 0.05 && occupied(n, int(b), n.bodies[b].body.world_from_body, agree, part)))
      better[n.photos.size() + b] = place->world_from_body, changed[n.photos.size() + b] = 1;
  });
  // What was judged from where they were counts again, until it is judged anew.
  const auto give_back = [&](const std::vector<int>& sightings) {
    for (const int s : sightings) {
      n.sightings[std::size_t(s)].counts = true;
      for (const std::uint32_t k : n.sightings[std::size_t(s)].seen) n.seen[k].counts = true;
    }
  };
  int count = 0;
  for (std::size_t i = 0; i < changed.size(); ++i) {
    if (!changed[i]) continue;
    ++count;
    give_back(i < n.photos.size() ? n.by_photo[i] : n.by_body[i - n.photos.size()]);
    if (i < n.photos.size()) {
      n.cam_from_world[i] = better[i];
    } else {
      n.bodies[i - n.photos.size()].body.world_from_body = better[i];
      n.bodies[i - n.photos.size()].body.free_places.clear();
    }
  }
  return count;
}

bool find_second_places(Network& n, int part, Job& job) {
  bool found = false;
  const std::size_t bodies = n.bodies.size();
  for (std::size_t b = 0; b < bodies; ++b) {
    job.check();
    if (n.body_part[b] != part || n.bodies[b].board >= 0) continue;
    std::vector<int> off, on;
    for (const int s : n.by_body[b])
      if (n.photo_part[std::size_t(n.sightings[std::size_t(s)].photo)] == part && n.sightings[std::size_t(s)].poses > 0)
        (n.sightings[std::size_t(s)].counts ? on : off).push_back(s);
    if (off.size() < kSecondPlace) continue;
    const auto place = agreed_place(n, off);
    if (!place || place->sightings.size() < kSecondPlace) continue;
    const int fresh = int(n.bodies.size());
    CalibratedBody body = n.bodies[b];
    body.name += " (second place)";
    body.body.name = body.name;
    body.body.free_places.clear();
    std::set<int> there(place->sightings.begin(), place->sightings.end());
    body.body.world_from_body =
        refined_body(n, int(b), place->world_from_body, [&](int s) { return there.count(s) > 0; });
    n.bodies.push_back(std::move(body));
    n.body_part.push_back(part);
    n.by_body.emplace_back();
    for (const int s : place->sightings) {
      Sighting& sighting = n.sightings[std::size_t(s)];
      sighting.body = fresh;
      sighting.counts = true;
      for (const std::uint32_t k : sighting.seen) n.seen[k].body = fresh, n.seen[k].counts = true;
      n.by_body[std::size_t(fresh)].push_back(s);
      std::erase(n.by_body[b], s);
    }
    // Moved: all photographs with it at one place come before those with it at the other.
    std::vector<int> first, second;
    for (const int s : on) first.push_back(n.sightings[std::size_t(s)].photo);
    for (const int s : place->sightings) second.push_back(n.sightings[std::size_t(s)].photo);
    double in_order = 0, best = 0;
    std::vector<std::pair<int, int>> order;
    for (const int p : first) order.emplace_back(p, 0);
    for (const int p : second) order.emplace_back(p, 1);
    std::sort(order.begin(), order.end());
    int split = -1;
    for (int way = 0; way < 2; ++way)
      for (std::size_t cut = 0; cut <= order.size(); ++cut) {
        in_order = 0;
        for (std::size_t k = 0; k < order.size(); ++k) in_order += (order[k].second == way) == (k < cut);
        if (in_order > best && cut > 0 && cut < order.size()) best = in_order, split = order[cut].first;
      }
    Removed r;
    r.kind = Removed::Kind::target;
    r.body = int(b);
    r.design = n.bodies[b].design, r.id = n.bodies[b].id;
    const bool moved = best >= kInOrder * double(order.size()) && split >= 0;
    r.why = moved ? Removed::Why::moved : Removed::Why::same_id;
    r.photo = moved ? split : -1;
    const double distance = (place->world_from_body.translation - n.bodies[b].body.world_from_body.translation).norm();
    char text[64];
    std::snprintf(text, sizeof text, "%.1f mm", 1000 * distance);
    r.text = body_text(n, int(b)) +
             (moved ? " was moved by " + std::string(text) + " before " + photo_text(n, split)
                    : " is there twice, " + std::string(text) + " apart: two targets with one id") +
             "; both places are kept, as two targets (" + std::to_string(first.size()) + " and " +
             std::to_string(second.size()) + " photographs)";
    n.removed.push_back(std::move(r));
    found = true;
  }
  return found;
}

}  // namespace lumihull::calib::network
