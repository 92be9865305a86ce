// First poses: a surest pair of photographs, then whatever is seen with what stands.
#include "grow.h"

#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "lens/point_term.h"

namespace lumihull::calib::network {
namespace {

using Eigen::Vector3d;

constexpr double kRoughShare = 0.15, kRoughPx = 1.5;  // of a sighting's size; and more
constexpr int kPairPhotos = 48, kPartners = 6;        // how many pairs of photographs are looked at
constexpr double kLeastMargin = 0.5;                  // bodies by which the best relative pose must beat others
constexpr double kOtherTurn = 5 * std::numbers::pi / 180;
constexpr int kPlacesFrom = 16;  // sightings whose poses are tried for a body

double tolerance(const Sighting& s) { return kRoughShare * s.size_px + kRoughPx; }

/// Bodies that both photographs see, as pairs of sightings.
std::vector<std::pair<int, int>> shared(const Network& n, int a, int b) {
  std::vector<std::pair<int, int>> result;
  for (const int i : n.by_photo[std::size_t(a)])
    for (const int j : n.by_photo[std::size_t(b)]) {
      const Sighting &s = n.sightings[std::size_t(i)], &t = n.sightings[std::size_t(j)];
      if (s.body == t.body && s.counts && t.counts && s.poses > 0 && t.poses > 0 &&
          n.body_part[std::size_t(s.body)] < 0)
        result.emplace_back(i, j);
    }
  return result;
}

struct Pair {
  int a = -1, b = -1;
  Pose b_from_a;
  double margin = 0, cost = 0;
};

/// How one photograph lies to another: the candidate by which most shared bodies are where they are seen.
Pair relate(const Network& n, int a, int b) {
  Pair best{a, b, {}, 0, 0};
  const auto both = shared(n, a, b);
  if (both.size() < 2) return best;
  struct Candidate {
    Pose b_from_a;
    double cost;
  };
  std::vector<Candidate> candidates;
  for (const auto& [i, j] : both) {
    const Sighting &s = n.sightings[std::size_t(i)], &t = n.sightings[std::size_t(j)];
    for (int p = 0; p < s.poses; ++p)
      for (int q = 0; q < t.poses; ++q)
        candidates.push_back({t.cam_from_body[std::size_t(q)] * s.cam_from_body[std::size_t(p)].inverse(), 0});
  }
  for (Candidate& c : candidates)
    for (const auto& [i, j] : both) {
      const Sighting &s = n.sightings[std::size_t(i)], &t = n.sightings[std::size_t(j)];
      double least = 1;
      for (int p = 0; p < s.poses; ++p) {
        const double off = rough_distance(n, t, c.b_from_a * s.cam_from_body[std::size_t(p)]);
        least = std::min(least, off * off);
      }
      c.cost += least;
    }
  const auto first = std::min_element(candidates.begin(), candidates.end(),
                                      [](const Candidate& x, const Candidate& y) { return x.cost < y.cost; });
  best.b_from_a = first->b_from_a;
  best.cost = first->cost;
  double other = double(both.size());
  for (const Candidate& c : candidates)
    if (first->b_from_a.rotation.angularDistance(c.b_from_a.rotation) > kOtherTurn) other = std::min(other, c.cost);
  best.margin = other - first->cost;
  return best;
}

std::vector<int> unplaced_photos(const Network& n) {
  std::vector<int> photos;
  for (std::size_t i = 0; i < n.photos.size(); ++i) {
    const bool sees = std::any_of(n.by_photo[i].begin(), n.by_photo[i].end(), [&](int s) {
      const Sighting& sighting = n.sightings[std::size_t(s)];
      return sighting.counts && sighting.poses > 0 && n.body_part[std::size_t(sighting.body)] < 0;
    });
    if (!n.cam_from_world[i] && n.in_model[i] && sees) photos.push_back(int(i));
  }
  return photos;
}

std::optional<Pair> surest_pair(const Network& n, Job& job) {
  std::vector<int> photos = unplaced_photos(n);
  std::vector<double> worth(n.photos.size(), 0);
  for (const int p : photos)
    for (const int s : n.by_photo[std::size_t(p)])
      if (n.sightings[std::size_t(s)].counts) worth[std::size_t(p)] += double(n.sightings[std::size_t(s)].poses > 0);
  std::stable_sort(photos.begin(), photos.end(),
                   [&](int a, int b) { return worth[std::size_t(a)] > worth[std::size_t(b)]; });
  // Few photographs: all pairs. Many: those that see most, with others that they share most bodies with.
  std::vector<std::pair<int, int>> pairs;
  const std::size_t firsts = std::min<std::size_t>(photos.size(), kPairPhotos);
  for (std::size_t i = 0; i < firsts; ++i) {
    std::vector<std::pair<int, int>> partners;  // (- shared, photograph)
    for (std::size_t j = 0; j < photos.size(); ++j)
      if (j > i || j >= firsts) {
        const int common = int(shared(n, photos[i], photos[j]).size());
        if (common >= 2) partners.emplace_back(-common, photos[j]);
      }
    std::stable_sort(partners.begin(), partners.end());
    // Partners far apart in the list of those that share much: photographs beside each other resolve little.
    const std::size_t stride = std::max<std::size_t>(1, partners.size() / (4 * kPartners));
    for (std::size_t k = 0; k < partners.size() && k / stride < std::size_t(4 * kPartners); k += stride)
      pairs.emplace_back(photos[i], partners[k].second);
  }
  std::vector<Pair> answers(pairs.size());
  parallel_for(job, pairs.size(), [&](std::size_t i) { answers[i] = relate(n, pairs[i].first, pairs[i].second); });
  std::optional<Pair> best;
  for (const Pair& p : answers)
    if (p.margin >= kLeastMargin && (!best || p.margin > best->margin)) best = p;
  return best;
}

/// The sighting to begin with where no two photographs agree on anything: of the largest and surest.
int surest_sighting(const Network& n) {
  int best = -1;
  double most = 0;
  for (const int p : unplaced_photos(n))
    for (const int i : n.by_photo[std::size_t(p)]) {
      const Sighting& s = n.sightings[std::size_t(i)];
      if (!s.counts || s.poses == 0 || n.body_part[std::size_t(s.body)] >= 0) continue;
      double seen_in = 0;  // a start that leads somewhere
      for (const int k : n.by_body[std::size_t(s.body)])
        seen_in += !n.cam_from_world[std::size_t(n.sightings[std::size_t(k)].photo)];
      const double worth = (s.sure ? 1e6 : 1) * seen_in * double(s.seen.size()) * s.size_px;
      if (worth > most) most = worth, best = i;
    }
  return best;
}

bool place_body(Network& n, int body, int part, bool last) {
  std::vector<int> sightings;
  for (const int i : n.by_body[std::size_t(body)]) {
    const Sighting& s = n.sightings[std::size_t(i)];
    if (s.counts && s.poses > 0 && n.photo_part[std::size_t(s.photo)] == part) sightings.push_back(i);
  }
  if (sightings.empty()) return false;
  if (sightings.size() == 1 && !n.sightings[std::size_t(sightings[0])].sure && !last) return false;
  const std::optional<BodyPlace> place = agreed_place(n, sightings);
  // One photograph that is sure is enough; two must agree.
  if (!place || (place->sightings.size() < 2 && sightings.size() > 1 && !last)) return false;
  n.bodies[std::size_t(body)].body.world_from_body = refined_body(n, body, place->world_from_body, [&](int i) {
    return std::find(place->sightings.begin(), place->sightings.end(), i) != place->sightings.end();
  });
  n.bodies[std::size_t(body)].placed = true;
  n.body_part[std::size_t(body)] = part;
  return true;
}

}  // namespace

double rough_distance(const Network& network, const Sighting& sighting, const Pose& cam_from_body) {
  return distance_px(network, sighting, cam_from_body) / tolerance(sighting);
}

bool roughly_met(const Network& network, const Sighting& sighting, const Pose& cam_from_body) {
  return rough_distance(network, sighting, cam_from_body) < 1;
}

bool occupied(const Network& n, int body, const Pose& world_from_body, std::size_t sightings, int part) {
  double size = 0;
  for (const BodyPoint& p : n.bodies[std::size_t(body)].body.points) size = std::max(size, p.place.norm());
  for (std::size_t o = 0; o < n.bodies.size(); ++o) {
    if (int(o) == body || n.body_part[o] != part || n.bodies[o].board >= 0) continue;
    const Pose& other = n.bodies[o].body.world_from_body;
    if ((other.translation - world_from_body.translation).norm() > 0.5 * size) continue;
    std::size_t seen = 0;
    for (const int s : n.by_body[o])
      seen +=
          n.sightings[std::size_t(s)].counts && n.photo_part[std::size_t(n.sightings[std::size_t(s)].photo)] == part;
    if (seen > sightings) return true;
  }
  return false;
}

std::optional<BodyPlace> agreed_place(const Network& n, const std::vector<int>& sightings) {
  std::optional<BodyPlace> best;
  double least = std::numeric_limits<double>::infinity();
  const std::size_t stride = std::max<std::size_t>(1, sightings.size() / kPlacesFrom);
  for (std::size_t k = 0; k < sightings.size(); k += stride) {
    const Sighting& s = n.sightings[std::size_t(sightings[k])];
    for (int p = 0; p < s.poses; ++p) {
      const Pose world_from_body = n.cam_from_world[std::size_t(s.photo)]->inverse() * s.cam_from_body[std::size_t(p)];
      double cost = 0;
      std::vector<int> agree;
      for (const int i : sightings) {
        const Sighting& t = n.sightings[std::size_t(i)];
        const double off = rough_distance(n, t, *n.cam_from_world[std::size_t(t.photo)] * world_from_body);
        cost += std::min(1.0, off * off);
        if (off < 1) agree.push_back(i);
      }
      if (cost < least && !occupied(n, s.body, world_from_body, agree.size(), n.photo_part[std::size_t(s.photo)])) {
        least = cost;
        best = BodyPlace{world_from_body, std::move(agree)};
      }
    }
  }
  return best;
}

Pose refined_body(const Network& n, int body, Pose world_from_body, const std::function<bool(int)>& use) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  const AdjustedBody& printed = n.bodies[std::size_t(body)].body;
  for (int iteration = 0; iteration < 10; ++iteration) {
    Matrix6 h = Matrix6::Zero();
    Vector6 b = Vector6::Zero();
    for (const int i : n.by_body[std::size_t(body)]) {
      if (!use(i)) continue;
      const Sighting& s = n.sightings[std::size_t(i)];
      const Pose cam_from_world = *n.cam_from_world[std::size_t(s.photo)];
      const Pose cam_from_body = cam_from_world * world_from_body;
      const Eigen::Matrix3d r = cam_from_world.rotation.toRotationMatrix();
      Matrix6 adjoint = Matrix6::Zero();  // a motion in the world as one in the camera's frame
      adjoint.topLeftCorner<3, 3>() = r;
      adjoint.bottomRightCorner<3, 3>() = r;
      adjoint.bottomLeftCorner<3, 3>() = lens::cross_matrix(cam_from_world.translation) * r;
      const double scale = tolerance(s);
      for (const std::uint32_t k : s.seen) {
        const Seen& seen = n.seen[k];
        if (!seen.counts) continue;
        const BodyPoint& p = printed.points[std::size_t(seen.point)];
        BoardMatch match;
        match.board = p.place, match.radius = p.radius, match.normal = p.normal;
        Eigen::Vector2d pixel;
        lens::Matrix26d by_pose;
        if (!lens::predict(n.camera_of(s.photo), cam_from_body, match, &pixel, nullptr, &by_pose)) continue;
        const Eigen::Vector2d error = seen.pixel - pixel;
        const double weight = 1 / (1 + error.squaredNorm() / (scale * scale));
        const lens::Matrix26d j = by_pose * adjoint;
        h += weight * weight * j.transpose() * j;
        b += weight * weight * j.transpose() * error;
      }
    }
    h.diagonal().array() += 1e-9 * h.diagonal().maxCoeff() + 1e-300;
    const Vector6 step = h.ldlt().solve(b);
    if (!step.allFinite() || step.head<3>().norm() > 1) break;
    world_from_body = lens::moved(world_from_body, step);
    if (step.norm() < 1e-9) break;
  }
  return world_from_body;
}

bool place_photo(Network& n, int photo, int part) {
  std::vector<PointMatch> matches;
  std::vector<int> sightings;
  for (const int i : n.by_photo[std::size_t(photo)]) {
    const Sighting& s = n.sightings[std::size_t(i)];
    if (!s.counts || n.body_part[std::size_t(s.body)] != part) continue;
    const auto more = n.matches(s, true);
    matches.insert(matches.end(), more.begin(), more.end());
    sightings.push_back(i);
  }
  if (matches.size() < 4) return false;
  std::optional<Pose> pose;
  const auto agreeing = [&](const Pose& cam_from_world) {
    int agree = 0;
    for (const int i : sightings) {
      const Sighting& s = n.sightings[std::size_t(i)];
      agree += roughly_met(n, s, cam_from_world * n.bodies[std::size_t(s.body)].body.world_from_body);
    }
    return agree;
  };
  bool sure = true;
  try {
    const Resection r = resect(n.camera_of(photo), matches, {});
    pose = r.cam_from_world;
    sure = !r.alternative;
  } catch (const Error& e) {
    if (e.code() != ErrorCode::degenerate) throw;
  }
  int agree = pose ? agreeing(*pose) : 0;
  // Bodies that stand roughly only, or a half of them wrong: from each sighting's own poses.
  if (agree < int(sightings.size()) && sightings.size() > 1)
    for (const int i : sightings) {
      const Sighting& s = n.sightings[std::size_t(i)];
      for (int p = 0; p < s.poses; ++p) {
        const Pose candidate =
            s.cam_from_body[std::size_t(p)] * n.bodies[std::size_t(s.body)].body.world_from_body.inverse();
        if (const int count = agreeing(candidate); count > agree) agree = count, pose = candidate, sure = true;
      }
    }
  if (!pose || !(agree >= 2 || (agree == 1 && sightings.size() == 1 && sure))) return false;
  if (agree >= 2 && 2 * agree < int(sightings.size()) && agree < 4) return false;  // chance
  n.cam_from_world[std::size_t(photo)] = pose;
  n.photo_part[std::size_t(photo)] = part;
  return true;
}

void grow_on(Network& n, int part, Job& job, const std::function<void()>& adjust) {
  const auto size = [&] {
    std::size_t placed = 0;
    for (const int p : n.photo_part) placed += p == part;
    for (const int b : n.body_part) placed += b == part;
    return placed;
  };
  std::size_t adjusted = 0;
  bool last = false;
  for (;;) {
    job.check();
    bool grown = false;
    // All that can be placed from what stood before: the order of the photographs must not matter.
    std::vector<int> photos;
    for (std::size_t i = 0; i < n.photos.size(); ++i)
      if (!n.cam_from_world[i] && n.in_model[i] && !n.by_photo[i].empty()) photos.push_back(int(i));
    std::vector<std::uint8_t> placed(photos.size(), 0);
    parallel_for(job, photos.size(), [&](std::size_t i) { placed[i] = place_photo(n, photos[i], part); });
    grown = std::any_of(placed.begin(), placed.end(), [](std::uint8_t p) { return p != 0; });
    std::vector<int> bodies;
    for (std::size_t b = 0; b < n.bodies.size(); ++b)
      if (n.body_part[b] < 0) bodies.push_back(int(b));
    std::vector<std::uint8_t> set(bodies.size(), 0);
    parallel_for(job, bodies.size(), [&](std::size_t i) { set[i] = place_body(n, bodies[i], part, last); });
    grown = grown || std::any_of(set.begin(), set.end(), [](std::uint8_t p) { return p != 0; });
    if (grown && 3 * size() >= 4 * adjusted) adjust(), adjusted = size();
    if (grown) continue;
    if (last) break;
    if (size() > adjusted) adjust(), adjusted = size();
    last = true;  // bodies that one photograph shows, or with two tilts: better than nothing, and seen through later
  }
}

bool grow_part(Network& n, int part, Job& job, const std::function<void()>& adjust) {
  if (const std::optional<Pair> pair = surest_pair(n, job)) {
    for (const auto& [photo, pose] : {std::pair{pair->a, Pose{}}, {pair->b, pair->b_from_a}}) {
      n.cam_from_world[std::size_t(photo)] = pose;
      n.photo_part[std::size_t(photo)] = part;
    }
    for (const auto& [i, j] : shared(n, pair->a, pair->b)) place_body(n, n.sightings[std::size_t(i)].body, part, false);
  } else if (const int i = surest_sighting(n); i >= 0) {
    const Sighting& s = n.sightings[std::size_t(i)];
    n.cam_from_world[std::size_t(s.photo)] = s.cam_from_body[0];
    n.photo_part[std::size_t(s.photo)] = part;
    n.bodies[std::size_t(s.body)].body.world_from_body = Pose{};
    n.bodies[std::size_t(s.body)].placed = true;
    n.body_part[std::size_t(s.body)] = part;
  } else {
    return false;
  }
  grow_on(n, part, job, adjust);
  return true;
}

}  // namespace lumihull::calib::network
