// What came of the paper's experiments on the robot: from a calibrated capture, from a film of a target.
#include <lumihull/base/error.h>
#include <lumihull/capture/experiments.h>
#include <lumihull/internal/html.h>
#include <lumihull/internal/svg_figure.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

namespace lumihull::capture {
namespace {

using Json = nlohmann::ordered_json;
using lumihull::internal::html_escaped;
using lumihull::internal::number;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kSamePlace = 1e-6;  ///< m and rad; a plan's poses come back to the last digits

bool same_place(const CommandedShot& a, const CommandedShot& b) {
  return a.device == b.device && (a.cam_from_world.translation - b.cam_from_world.translation).norm() < kSamePlace &&
         a.cam_from_world.rotation.angularDistance(b.cam_from_world.rotation) < kSamePlace;
}

/// Shots of one place, in the capture's order.
std::vector<std::vector<std::size_t>> places_of(const Capture& capture) {
  std::vector<std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    const auto& commanded = capture.shots[i].commanded;
    if (!commanded) continue;
    const auto place = std::find_if(places.begin(), places.end(), [&](const std::vector<std::size_t>& visits) {
      return same_place(*capture.shots[visits.front()].commanded, *commanded);
    });
    if (place == places.end())
      places.push_back({i});
    else
      place->push_back(i);
  }
  std::erase_if(places, [](const auto& visits) { return visits.size() < 2; });
  return places;
}

double rms(double sum, std::size_t n) { return n > 0 ? std::sqrt(sum / double(n)) : 0; }

}  // namespace

Repeatability repeatability(const Capture& capture) {
  const std::string subject = capture.folder().string();
  if (capture.unit != Unit::metres)
    throw Error(ErrorCode::bad_input,
                "the capture has no scale, so that distances mean nothing: calibrate it by targets of known size",
                subject);
  Repeatability out;
  double distances = 0, angles = 0, measured_m2 = 0, measured_rad2 = 0;
  bool all_known = true;
  std::set<std::string> devices;
  for (const Shot& shot : capture.shots)
    if (shot.commanded) devices.insert(shot.commanded->device);
  for (const std::vector<std::size_t>& visits : places_of(capture)) {
    RepeatedPlace place;
    std::vector<Pose> poses;
    for (const std::size_t i : visits) {
      const Shot& shot = capture.shots[i];
      if (!shot.cam_from_world) {
        out.without_pose.push_back(shot.name);
        continue;
      }
      poses.push_back(shot.cam_from_world->inverse());
      place.photographs.push_back(shot.name);
      all_known = all_known && shot.pose_quality;
      if (!shot.pose_quality) continue;
      // A small motion (w, t) after cam_from_world moves the centre by -R^T t.
      measured_rad2 += shot.pose_quality->covariance.topLeftCorner<3, 3>().trace();
      measured_m2 += shot.pose_quality->covariance.bottomRightCorner<3, 3>().trace();
    }
    if (poses.size() < 2) continue;
    const CommandedShot& first = *capture.shots[visits.front()].commanded;
    place.name = first.stop + (devices.size() > 1 ? " " + first.device : "");
    place.spread = pose_spread(poses);
    for (const double d : place.spread.distance_m) distances += d * d;
    for (const double a : place.spread.angle_rad) angles += a * a;
    out.visits += poses.size();
    out.largest_distance_m = std::max(out.largest_distance_m, place.spread.largest_distance_m);
    out.largest_angle_rad = std::max(out.largest_angle_rad, place.spread.largest_angle_rad);
    out.places.push_back(std::move(place));
  }
  if (out.places.empty())
    throw Error(ErrorCode::bad_input,
                "no place was visited twice with poses that calibration found (`lumihull plan --repeatability` makes "
                "such a plan)",
                subject);
  out.rms_distance_m = rms(distances, out.visits), out.rms_angle_rad = rms(angles, out.visits);
  if (all_known) out.measured_m = rms(measured_m2, out.visits), out.measured_rad = rms(measured_rad2, out.visits);
  return out;
}

std::string describe_json(const Repeatability& found) {
  Json json;
  json["places"] = Json::array();
  for (const RepeatedPlace& p : found.places)
    json["places"].push_back(Json{{"name", p.name},
                                  {"photographs", p.photographs},
                                  {"distances_m", p.spread.distance_m},
                                  {"angles_rad", p.spread.angle_rad},
                                  {"largest_distance_m", p.spread.largest_distance_m},
                                  {"largest_angle_rad", p.spread.largest_angle_rad}});
  json["without_pose"] = found.without_pose;
  json["visits"] = found.visits;
  json["largest_distance_m"] = found.largest_distance_m;
  json["largest_angle_rad"] = found.largest_angle_rad;
  json["rms_distance_m"] = found.rms_distance_m;
  json["rms_angle_rad"] = found.rms_angle_rad;
  json["measured_m"] = found.measured_m < 0 ? Json() : Json(found.measured_m);
  json["measured_rad"] = found.measured_rad < 0 ? Json() : Json(found.measured_rad);
  return json.dump();
}

std::string repeatability_html(const Repeatability& found, const std::string& title) {
  std::vector<PoseSpread> spreads;
  std::string rows;
  const auto cells = [](double distance_m, double distance_rms, double angle_rad, double angle_rms) {
    return "<td>" + number("%.2f", 1000 * distance_m) + "<td>" + number("%.2f", 1000 * distance_rms) + "<td>" +
           number("%.3f", angle_rad * kDegrees) + "<td>" + number("%.3f", angle_rms * kDegrees);
  };
  for (const RepeatedPlace& p : found.places) {
    spreads.push_back(p.spread);
    double distances = 0, angles = 0;
    for (const double d : p.spread.distance_m) distances += d * d;
    for (const double a : p.spread.angle_rad) angles += a * a;
    const std::size_t n = p.photographs.size();
    rows += "<tr><td>" + html_escaped(p.name) + "<td>" + std::to_string(n) +
            cells(p.spread.largest_distance_m, rms(distances, n), p.spread.largest_angle_rad, rms(angles, n)) + "\n";
  }
  rows += "<tr class=all><td>all<td>" + std::to_string(found.visits) +
          cells(found.largest_distance_m, found.rms_distance_m, found.largest_angle_rad, found.rms_angle_rad) + "\n";
  std::string notes;
  if (found.measured_m >= 0)
    notes += "<p>Calibration knows a pose to " + number("%.3f mm", 1000 * found.measured_m) + " and " +
             number("%.4f°", found.measured_rad * kDegrees) + " (RMS); that is in these figures.\n";
  if (!found.without_pose.empty())
    notes += "<p>" + std::to_string(found.without_pose.size()) + " photographs have no pose and are left out.\n";
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + html_escaped(title) +
         "</title>\n<style>body{font:15px/1.4 system-ui,sans-serif;margin:0 auto;max-width:60rem;padding:1rem}"
         "table{border-collapse:collapse}td,th{padding:.15rem .7rem;text-align:right}td:first-child{text-align:left}"
         ".all{border-top:1px solid #888;font-weight:600}</style></head><body>\n<h1>" +
         html_escaped(title) +
         "</h1>\n<p>Each place was gone to several times; how far measured poses are from their place's mean.\n"
         "<table><tr><th>place<th>visits<th>largest, mm<th>RMS, mm<th>largest, °<th>RMS, °\n" +
         rows + "</table>\n" + notes + repeatability_svg(spreads) + "</body></html>\n";
}

Stability stability(std::span<const double> time_s, std::span<const Eigen::Vector2d> center_px, double allowed_px,
                    double rest_s) {
  const auto need = [](bool ok, const char* message) {
    if (!ok) throw Error(ErrorCode::invalid_argument, message, "stability");
  };
  need(!time_s.empty() && time_s.size() == center_px.size(), "expected as many places as times");
  need(std::all_of(center_px.begin(), center_px.end(), [](const auto& p) { return p.allFinite(); }),
       "expected finite places");
  need(rest_s > 0, "expected a rest of more than 0 s");
  Stability out;
  out.allowed_px = allowed_px;
  out.time_s.assign(time_s.begin(), time_s.end());
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  std::size_t at_rest = 0;
  for (std::size_t i = 0; i < time_s.size(); ++i)
    if (time_s[i] >= time_s.back() - rest_s) sum += center_px[i], ++at_rest;
  need(at_rest >= 3, "expected at least three pictures of the rest");
  const Eigen::Vector2d rest = sum / double(at_rest);
  double squares = 0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    out.offset_px.emplace_back(center_px[i] - rest);
    out.distance_px.push_back(out.offset_px.back().norm());
    if (time_s[i] >= time_s.back() - rest_s) squares += out.offset_px.back().squaredNorm();
  }
  out.settle_s = settle_time_s(time_s, out.distance_px, allowed_px);
  out.rest_px = rms(squares, at_rest);
  return out;
}

std::string describe_json(const Stability& found) {
  Json json;
  json["time_s"] = found.time_s;
  json["offset_px"] = Json::array();
  for (const Eigen::Vector2d& o : found.offset_px) json["offset_px"].push_back({o.x(), o.y()});
  json["distance_px"] = found.distance_px;
  json["allowed_px"] = found.allowed_px;
  json["settle_s"] = found.settle_s ? Json(*found.settle_s) : Json();
  json["rest_px"] = found.rest_px;
  return json.dump();
}

}  // namespace lumihull::capture
