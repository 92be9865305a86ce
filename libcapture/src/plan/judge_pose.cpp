// Whether a pose can be taken, and if not, which cable is in the way.
#include <lumihull/capture/planner.h>
#include <lumihull/capture/statics.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

namespace lumihull::capture {
namespace {

using Kind = Obstacle::Kind;

std::string said(const char* format, double a, double b = 0, double c = 0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

void judge_lengths(const Mechanism& mechanism, const Pose& pose, PoseJudgement& judged) {
  const CableVector lengths = cable_lengths(mechanism, pose);
  for (Eigen::Index i = 0; i < lengths.size(); ++i) {
    const Cable& cable = mechanism.cables[std::size_t(i)];
    if (lengths[i] > cable.max_length_m)
      judged.obstacles.push_back(
          {Kind::cable_long, int(i),
           "cable " + cable.name + said(" would be %.2f m long, its drum holds %g m", lengths[i], cable.max_length_m)});
    if (lengths[i] < cable.min_length_m)
      judged.obstacles.push_back(
          {Kind::cable_short, int(i),
           "cable " + cable.name +
               said(" would be %.3f m long, its winch stops at %g m", lengths[i], cable.min_length_m)});
  }
}

/// The cable that would have to push hardest, of the tensions that balance without regard to their sign.
int pushing_cable(const Mechanism& mechanism, const Pose& pose) {
  const WrenchMatrix w = wrench_matrix(mechanism, pose);
  Eigen::Matrix<double, 6, 1> gravity;
  const Eigen::Vector3d weight(0, 0, -mechanism.mass_kg * mechanism.gravity_m_s2);
  gravity << weight, (pose.rotation * mechanism.center_of_mass).cross(weight);
  const Eigen::MatrixXd wide = w;
  const Eigen::VectorXd t = wide.completeOrthogonalDecomposition().solve(-gravity);
  Eigen::Index least = 0;
  return t.minCoeff(&least) < 0 ? int(least) : -1;
}

void judge_tensions(const Mechanism& mechanism, const Pose& pose, PoseJudgement& judged) {
  const Tensions found = tensions(mechanism, pose);
  judged.least_tension_N = found.tension_N.minCoeff();
  judged.greatest_tension_N = found.tension_N.maxCoeff();
  if (found.balance == Balance::unbalanced) {
    const int cable = pushing_cable(mechanism, pose);
    judged.obstacles.push_back(
        {Kind::unbalanced, cable,
         "no tensions hold the platform" +
             (cable >= 0 ? ": cable " + mechanism.cables[std::size_t(cable)].name + " would have to push"
                         : std::string())});
    return;
  }
  if (found.balance == Balance::singular)
    judged.obstacles.push_back({Kind::uncontrolled, -1, "a motion of the platform remains that no cable resists"});
  if (found.balance != Balance::loose) return;
  for (Eigen::Index i = 0; i < found.tension_N.size(); ++i) {
    const Cable& cable = mechanism.cables[std::size_t(i)];
    const double t = found.tension_N[i];
    if (t < cable.min_tension_N)
      judged.obstacles.push_back(
          {Kind::slack, int(i),
           "cable " + cable.name + said(" would be slack: %.2f N, at least %g N", t, cable.min_tension_N)});
    if (t > cable.max_tension_N)
      judged.obstacles.push_back(
          {Kind::taut, int(i),
           "cable " + cable.name + said(" would be too taut: %.0f N, at most %g N", t, cable.max_tension_N)});
  }
}

void judge_clearance(const Mechanism& mechanism, const Pose& pose, const KeepOut* object, const PoseLimits& limits,
                     PoseJudgement& judged) {
  const Clearance c = clearance(mechanism, pose, object);
  const auto at_least = [&](double distance, double wanted, Kind kind, const char* what) {
    if (distance < wanted)
      judged.obstacles.push_back({kind, -1, what + said(": %.1f cm, at least %g cm", 100 * distance, 100 * wanted)});
  };
  at_least(c.platform_room, limits.clearance_m, Kind::outside_room,
           "the platform is too close to a wall, floor or ceiling");
  at_least(c.cable_cable, limits.cable_clearance_m, Kind::cables_close, "two cables are too close to each other");
  judged.clearance_m = std::min(c.platform_room, c.cable_cable);
  if (!object) return;
  at_least(c.platform_object, limits.clearance_m, Kind::object_close, "the platform is too close to the object");
  at_least(c.cable_object, limits.clearance_m, Kind::object_close, "a cable is too close to the object");
  judged.clearance_m = std::min({judged.clearance_m, c.platform_object, c.cable_object});
}

}  // namespace

PoseJudgement judge_pose(const Mechanism& mechanism, const Pose& pose, const KeepOut* object,
                         const PoseLimits& limits) {
  PoseJudgement judged;
  if (!mechanism.room.contains(pose.translation)) {
    judged.obstacles.push_back({Kind::outside_room, -1,
                                said("the platform would be outside of the room, at %.2f, %.2f, %.2f m",
                                     pose.translation.x(), pose.translation.y(), pose.translation.z())});
    judged.clearance_m = -mechanism.room.exteriorDistance(pose.translation);
    return judged;
  }
  judge_lengths(mechanism, pose, judged);
  const bool shortened = std::any_of(judged.obstacles.begin(), judged.obstacles.end(),
                                     [](const Obstacle& o) { return o.kind == Kind::cable_short; });
  if (shortened) return judged;  // a cable without length has no direction
  judge_tensions(mechanism, pose, judged);
  judge_clearance(mechanism, pose, object, limits, judged);
  return judged;
}

std::vector<std::string> obstacles_in_words(std::span<const PoseJudgement> judgements) {
  struct Group {
    std::size_t stops = 0;
    std::string text;  // of the first one
  };
  std::map<std::pair<Kind, int>, Group> groups;
  for (const PoseJudgement& judged : judgements)
    for (const Obstacle& o : judged.obstacles) {
      Group& group = groups[{o.kind, o.cable}];
      if (group.stops++ == 0) group.text = o.text;
    }
  std::vector<Group> sorted;
  for (auto& [key, group] : groups) sorted.push_back(std::move(group));
  std::stable_sort(sorted.begin(), sorted.end(), [](const Group& a, const Group& b) { return a.stops > b.stops; });
  std::vector<std::string> words;
  for (const Group& group : sorted)
    words.push_back("at " + std::to_string(group.stops) + " of " + std::to_string(judgements.size()) +
                    (group.stops > 1 ? " stops, as: " : " stops: ") + group.text);
  return words;
}

}  // namespace lumihull::capture
