// Targets as solved against where they hang.
#include <lumihull/base/error.h>
#include <lumihull/calib/target_model.h>

#include <map>
#include <set>
#include <utility>

#include "parts.h"
#include "spread.h"

namespace lumihull::slf::truth {
namespace {

using Key = std::pair<int, int>;  // design, id

Eigen::Vector3d middle(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / double(points.size());
}

std::string name_of(const calib::TargetSet& set, Key key) {
  const std::string id = std::to_string(key.second);
  return key.first < int(set.designs.size()) ? set.designs[std::size_t(key.first)].family.name() + " " + id : id;
}

}  // namespace

TargetPairs paired_targets(const Capture& capture, std::span<const TrueTarget> targets) {
  const calib::TargetModel model = calib::TargetModel::of(capture);
  std::map<Key, const TrueTarget*> truth;
  for (const TrueTarget& t : targets) {
    if (t.design >= int(model.set.designs.size()))
      throw Error(ErrorCode::bad_input,
                  "the truth names a design " + std::to_string(t.design) + ", of which the " +
                      "capture's targets have " + std::to_string(model.set.designs.size()),
                  "targets.json");
    truth.emplace(Key(t.design, t.id), &t);
  }
  // A board has several targets; each is compared by itself.
  std::map<Key, TargetPairs::Target> solved;
  for (const calib::CalibratedBody& body : model.calibration.bodies) {
    if (!body.placed) continue;
    for (std::size_t i = 0; i < body.points.size() && i < body.features.size(); ++i) {
      const auto& feature = body.features[i];
      const Key key(feature.design, feature.id);
      TargetPairs::Target& target = solved[key];
      target.name = name_of(model.set, key);
      target.design = key.first, target.id = key.second;
      target.solved.push_back(body.points[i]);
      const auto t = truth.find(key);
      if (t == truth.end()) continue;
      const Eigen::Vector2d place = model.set.designs[std::size_t(feature.design)].feature(feature.feature);
      target.truth.push_back(t->second->world_from_target * Eigen::Vector3d(place.x(), place.y(), 0));
    }
  }
  TargetPairs pairs;
  for (auto& [key, target] : solved) {
    if (target.truth.empty())
      pairs.truth.wrong_ids.push_back(target.name);
    else
      pairs.known.push_back(std::move(target));
  }
  for (const auto& [key, t] : truth)
    if (!solved.contains(key)) pairs.truth.not_solved.push_back(name_of(model.set, key));
  return pairs;
}

std::optional<Similarity> align_targets(const TargetPairs& pairs, bool rigid) {
  std::vector<Eigen::Vector3d> from, to;
  for (const TargetPairs::Target& t : pairs.known) {
    from.insert(from.end(), t.solved.begin(), t.solved.end());
    to.insert(to.end(), t.truth.begin(), t.truth.end());
  }
  if (from.size() < 3) return std::nullopt;
  return align_points(from, to, rigid);
}

TargetTruth compare_targets(TargetPairs pairs, const Similarity& truth_from_capture) {
  TargetTruth out = std::move(pairs.truth);
  std::vector<double> all;
  for (const TargetPairs::Target& t : pairs.known) {
    std::vector<double> errors;
    for (std::size_t i = 0; i < t.solved.size(); ++i)
      errors.push_back(1000 * (truth_from_capture * t.solved[i] - t.truth[i]).norm());
    out.targets.push_back({t.name, t.design, t.id, spread_of(errors).rms});
    all.insert(all.end(), errors.begin(), errors.end());
    const Eigen::Vector3d place = truth_from_capture * middle(t.solved);
    const double off = (place - middle(t.truth)).norm();
    for (const TargetPairs::Target& other : pairs.known)
      if (&other != &t && (place - middle(other.truth)).norm() < off) {
        out.wrong_ids.push_back(t.name);
        break;
      }
  }
  out.point_mm = spread_of(std::move(all));
  return out;
}

}  // namespace lumihull::slf::truth
