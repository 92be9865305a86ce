#include <lumihull/capture/experiments.h>
#include <lumihull/capture/land_card.h>
#include <lumihull_capture.h>

#include <algorithm>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

lh_status lh_card_land(lh_context* ctx, const char* folder, const char* card, const lh_card_options* user,
                       lh_card_result* result) {
  return guarded(ctx, [&](Job& job) {
    const lh_card_options o = read_struct(user, "options");
    if (result) checked_struct_size(result->struct_size, "result");
    capture::LandOptions options;
    if (o.camera) options.camera = o.camera;
    if (o.clock_known) options.clock_offset_s = o.clock_offset_s;
    options.again = o.again, options.dry_run = o.dry_run;
    const auto tell = [&](const std::string& line) {
      if (o.tell) o.tell(o.user, line.c_str());
    };
    const capture::LandedCard found =
        capture::land_card(path(folder, "folder"), path(card, "card"), options, tell, job);
    lh_card_result value{};
    value.matched = found.matched, value.landed = found.landed, value.missing = found.missing;
    value.extra = found.alignment.extra.size(), value.ambiguous = found.alignment.ambiguous.size();
    value.troubles = found.troubles.size();
    if (result) write_struct(result, value, "result");
  });
}

lh_status lh_repeatability(lh_context* ctx, const lh_capture* capture, char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] {
    give_text(capture::describe_json(capture::repeatability(given(capture, "capture").value)), buffer, size, needed);
  });
}

lh_status lh_pose_spread(lh_context* ctx, const double* world_from_camera, size_t n, double* mean, double* distance_m,
                         double* angle_rad) {
  return guarded(ctx, [&] {
    const auto matrices = array(world_from_camera, n, 12, "world_from_camera");
    std::vector<Pose> poses;
    for (std::size_t i = 0; i < n; ++i) poses.push_back(pose_from(&matrices[12 * i], "world_from_camera"));
    const capture::PoseSpread spread = capture::pose_spread(poses);
    const auto distances = distance_m ? array(distance_m, n, 1, "distance_m") : std::span<double>();
    const auto angles = angle_rad ? array(angle_rad, n, 1, "angle_rad") : std::span<double>();
    if (mean) pose_to(spread.mean, mean);
    if (distance_m) std::copy(spread.distance_m.begin(), spread.distance_m.end(), distances.begin());
    if (angle_rad) std::copy(spread.angle_rad.begin(), spread.angle_rad.end(), angles.begin());
  });
}

lh_status lh_stability(lh_context* ctx, const double* time_s, const double* center_px, size_t n, double allowed_px,
                       double rest_s, double* distance_px, double* settle_s, double* rest_px) {
  return guarded(ctx, [&] {
    const auto times = array(time_s, n, 1, "time_s");
    const auto places = array(center_px, n, 2, "center_px");
    std::vector<Eigen::Vector2d> centers;
    for (std::size_t i = 0; i < n; ++i) centers.emplace_back(places[2 * i], places[2 * i + 1]);
    const capture::Stability found =
        capture::stability(times, centers, or_default(allowed_px, 0.5), or_default(rest_s, 2.0));
    if (distance_px) std::copy(found.distance_px.begin(), found.distance_px.end(), distance_px);
    if (settle_s) *settle_s = found.settle_s.value_or(-1);
    if (rest_px) *rest_px = found.rest_px;
  });
}
