// lumihull plan: where photographs are taken, in which order, and whether robot and lens can do it.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/lens_calibration.h>
#include <lumihull/capture/design.h>
#include <lumihull/capture/experiments.h>
#include <lumihull/capture/optics.h>
#include <lumihull/capture/plan_report.h>
#include <lumihull/capture/planner.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <numbers>

#include "program.h"

namespace lumihull::program {

namespace {

namespace fs = std::filesystem;
using namespace capture;

constexpr double kDegree = std::numbers::pi / 180;

struct Arguments {
  std::string robot = "cables", mechanism = "paper", output = "plan.json", svg, camera, targets;
  std::string sensor = "22.7x15.1", pixels = "3072x2048", steps, phi = "0..90", orientation = "portrait";
  std::string bearing = "gravity", cameras = "camera";
  ObjectSize object;
  Optics optics;
  double radius = 0, margin = -1, spacing_deg = 0, overlap = 0, tilt_factor = 2.0 / 3, tilt_offset_deg = -30;
  double bearing_tolerance_deg = 8, settle = 7, exposure = 0.5, clearance = 0.05, travel = -1, square = 0;
  std::vector<double> center{0, 0, 0};
  Enclosure enclosure;
  int battery = 1000, kicks = 1000;
  std::uint64_t seed = 1;
  bool thin = false, raster = false;
};

/// What stays free of the picture on each side. Cables and hands come within some centimetres and degrees of where they
/// are sent, a turntable is there.
double margin_of(const Arguments& a) {
  if (a.margin >= 0) return a.margin;
  return a.robot == "turntable" ? .05 : .1;
}

/// Two numbers with a separator between them, as "24x10".
std::pair<double, double> two_numbers(const std::string& text, const std::string& separator, const char* option) {
  const std::size_t at = text.find(separator);
  try {
    if (at != std::string::npos) {
      std::size_t end = 0, end2 = 0;
      const std::string a = text.substr(0, at), b = text.substr(at + separator.size());
      const double x = std::stod(a, &end), y = std::stod(b, &end2);
      if (end == a.size() && end2 == b.size() && std::isfinite(x) && std::isfinite(y)) return {x, y};
    }
  } catch (const std::exception&) {
  }
  throw Error(ErrorCode::invalid_argument, "expected two numbers as 1" + separator + "2, not \"" + text + "\"", option);
}

int whole(double x, const char* option) {
  if (!(x >= 1 && x <= 1e9) || x != std::floor(x))
    throw Error(ErrorCode::invalid_argument, "expected whole numbers of at least 1", option);
  return int(x);
}

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> all;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    all.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return all;
}

Optics optics_of(const Arguments& a) {
  Optics optics = a.optics;
  std::tie(optics.sensor_width_mm, optics.sensor_height_mm) = two_numbers(a.sensor, "x", "--sensor");
  const auto [width, height] = two_numbers(a.pixels, "x", "--pixels");
  optics.width_px = whole(width, "--pixels"), optics.height_px = whole(height, "--pixels");
  check(optics);
  return optics;
}

Orientation orientation_of(const Arguments& a) {
  return a.orientation == "portrait" ? Orientation::portrait : Orientation::landscape;
}

HemisphereOptions views_of(const Arguments& a, double radius) {
  HemisphereOptions views;
  views.center = Eigen::Vector3d(a.center[0], a.center[1], a.center[2]);
  views.radius_m = radius;
  if (!a.steps.empty() && (a.spacing_deg > 0 || a.overlap > 0))
    throw Error(ErrorCode::invalid_argument, "--steps, --spacing-deg and --overlap exclude each other", "plan");
  if (!a.steps.empty()) {
    const auto [azimuths, rows] = two_numbers(a.steps, "x", "--steps");
    views.azimuths = whole(azimuths, "--steps"), views.rows = whole(rows, "--steps");
  }
  views.spacing_rad =
      a.overlap > 0 ? step_for_overlap(a.overlap, a.object.bounding_radius_m(), radius) : a.spacing_deg * kDegree;
  views.thin = a.thin || a.spacing_deg > 0 || a.overlap > 0;
  const auto [from, to] = two_numbers(a.phi, "..", "--phi");
  views.phi_from_rad = from * kDegree, views.phi_to_rad = to * kDegree;
  views.tilt_factor = a.tilt_factor, views.tilt_offset_rad = a.tilt_offset_deg * kDegree;
  views.bearing = a.bearing == "fixed" ? Bearing::fixed : a.bearing == "motor" ? Bearing::motor : Bearing::gravity;
  views.bearing_tolerance_rad = a.bearing_tolerance_deg * kDegree;
  views.settle_s = a.settle, views.exposure_s = a.exposure;
  check(views);
  return views;
}

std::string formatted(const char* format, double x, double y = 0, double z = 0) {
  char text[240];
  std::snprintf(text, sizeof text, format, x, y, z);
  return text;
}

std::string duration(double s) {
  return s < 3600 ? formatted("%.0f min", std::ceil(s / 60))
                  : formatted("%.0f:%02.0f h", std::floor(s / 3600), std::floor(std::fmod(s, 3600) / 60));
}

/// Some of many names.
std::string some(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, names.size()); ++i) text += (i ? ", " : "") + names[i];
  return text + (names.size() > 4 ? ", …" : "");
}

struct Comparison {
  double raster_m = 0, raster_s = 0;
};

void say(Program& program, const Arguments& a, const PlannedTour& tour, const PlanReport& r, const Sharpness& sharp,
         double radius, const std::vector<std::string>& warnings, const std::optional<Comparison>& raster) {
  program.say("stops     " + std::to_string(r.photographs) + " at " + formatted("%.2f m", radius) +
              (tour.turns ? ", the camera is turned " + std::to_string(tour.turns) + " times" : "") +
              (tour.ways_round ? ", " + std::to_string(tour.ways_round) + " ways round" : ""));
  if (!tour.left_out.empty()) {
    program.say("note      " + std::to_string(tour.left_out.size()) +
                " stops are out of reach and left out: " + some(tour.left_out));
    constexpr std::size_t kSaid = 6;
    for (std::size_t i = 0; i < std::min(kSaid, tour.left_out_why.size()); ++i)
      program.say("          " + tour.left_out_why[i]);
  }
  program.say("time      " + duration(r.total_s) +
              formatted(": travel %.0f s, settling and turning %.0f s, exposures %.0f s", r.travel_s, r.settle_s,
                        r.exposure_s));
  program.say("travel    " + formatted("%.1f m", tour.travel_m) +
              (raster ? formatted("; azimuth by azimuth it would be %.1f m: %.0f %% less", raster->raster_m,
                                  100 * (1 - tour.travel_m / raster->raster_m))
                      : ""));
  if (tour.plan.mechanism)
    program.say("cables    " + formatted("%.1f to %.1f N, clearance at least %.1f cm", r.least_tension_N,
                                         r.greatest_tension_N, 100 * r.least_clearance_m));
  program.say("picture   " + formatted("%.2f px/mm, sharp from %.2f m", sharp.pixels_per_mm, sharp.near_m) +
              (std::isfinite(sharp.far_m) ? formatted(" to %.2f m", sharp.far_m) : " on") +
              formatted(", the object fills %.0f %%", 100 * r.median_fill));
  program.say("motion    " +
              formatted("half a pixel of blur in %.2g s: %.2f mm/s", a.exposure, 1000 * sharp.largest_speed_m_s));
  if (!r.cut_off.empty())
    program.say("note      the object is cut off at " + std::to_string(r.cut_off.size()) + " stops (" +
                some(r.cut_off) +
                (std::isfinite(r.least_margin_px) ? formatted("), by up to %.0f px", -r.least_margin_px) : ")"));
  if (!r.cables_in_picture.empty())
    program.say("note      a cable may be seen in " + std::to_string(r.cables_in_picture.size()) +
                " photographs: " + some(r.cables_in_picture));
  if (!r.cables_known)
    program.say("note      whether cables are seen is not known: the lens model ends before the picture's corners");
  if (r.least_targets >= 0)
    program.say("targets   at least " + std::to_string(r.least_targets) + ", in the middle " +
                std::to_string(r.median_targets));
  if (!r.few_targets.empty())
    program.say("note      fewer than " + std::to_string(kLeastTargets) + " targets at " +
                std::to_string(r.few_targets.size()) + " stops: " + some(r.few_targets));
  for (const std::string& warning : warnings) program.say("note      " + warning);
  for (const std::string& note : tour.notes) program.say("note      " + note);
}

std::string json_list(const std::vector<std::string>& all) {
  std::string text = "[";
  for (const std::string& s : all) text += (text.size() > 1 ? ", " : "") + json_text(s);
  return text + "]";
}

std::string json_number(double x) {
  if (!std::isfinite(x)) return "null";
  char text[40];
  std::snprintf(text, sizeof text, "%.10g", x);
  return text;
}

std::string json_of(const Arguments& a, const PlannedTour& tour, const PlanReport& r, const Sharpness& sharp,
                    double radius, const std::vector<std::string>& warnings, const std::optional<Comparison>& raster) {
  std::string text = "{\"plan\": " + json_text(a.output) + ", \"robot\": " + json_text(a.robot) +
                     ", \"radius_m\": " + json_number(radius);
  const std::pair<const char*, double> numbers[] = {{"stops", double(tour.plan.stops.size())},
                                                    {"photographs", double(r.photographs)},
                                                    {"turns", tour.turns},
                                                    {"ways_round", tour.ways_round},
                                                    {"total_s", r.total_s},
                                                    {"travel_s", r.travel_s},
                                                    {"settle_s", r.settle_s},
                                                    {"exposure_s", r.exposure_s},
                                                    {"travel_m", tour.travel_m},
                                                    {"least_margin_px", r.least_margin_px},
                                                    {"fill", r.median_fill},
                                                    {"pixels_per_mm", sharp.pixels_per_mm},
                                                    {"near_m", sharp.near_m},
                                                    {"far_m", sharp.far_m},
                                                    {"hyperfocal_m", sharp.hyperfocal_m},
                                                    {"largest_speed_m_s", sharp.largest_speed_m_s}};
  for (const auto& [name, value] : numbers) text += ", \"" + std::string(name) + "\": " + json_number(value);
  if (raster)
    text += ", \"raster_travel_m\": " + json_number(raster->raster_m) +
            ", \"raster_travel_s\": " + json_number(raster->raster_s);
  if (tour.plan.mechanism)
    text += ", \"least_tension_N\": " + json_number(r.least_tension_N) +
            ", \"greatest_tension_N\": " + json_number(r.greatest_tension_N) +
            ", \"least_clearance_m\": " + json_number(r.least_clearance_m) +
            ", \"cables_in_picture\": " + (r.cables_known ? json_list(r.cables_in_picture) : "null");
  if (r.least_targets >= 0)
    text += ", \"least_targets\": " + std::to_string(r.least_targets) +
            ", \"median_targets\": " + std::to_string(r.median_targets);
  return text + ", \"cut_off\": " + json_list(r.cut_off) + ", \"few_targets\": " + json_list(r.few_targets) +
         ", \"left_out\": " + json_list(tour.left_out) + ", \"left_out_why\": " + json_list(tour.left_out_why) +
         ", \"warnings\": " + json_list(warnings) + ", \"notes\": " + json_list(tour.notes) + "}\n";
}

void draw(Program& program, const Arguments& a, const Plan& plan) {
  fs::create_directories(a.svg);
  const fs::path folder = a.svg;
  write_file(folder / "plan-above.svg", plan_from_above_svg(plan));
  write_file(folder / "plan-side.svg", plan_from_side_svg(plan));
  write_file(folder / "plan-time.svg", plan_time_svg(plan));
  if (plan.mechanism) write_file(folder / "plan-tensions.svg", plan_tensions_svg(plan));
  program.say("pictures  " + a.svg);
}

Mechanism mechanism_of(const Arguments& a) {
  if (a.mechanism == "paper") return paper_mechanism();
  return a.mechanism == "large" ? large_mechanism() : read_mechanism(a.mechanism);
}

/// How well the robot comes back: no object, no hemisphere.
void plan_repeatability(Program& program, const Arguments& a) {
  RepeatabilityOptions options;
  options.side_m = a.square;
  options.center = Eigen::Vector3d(a.center[0], a.center[1], a.center[2]);
  options.settle_s = a.settle, options.exposure_s = a.exposure;
  options.limits.clearance_m = a.clearance;
  const Plan plan = repeatability_plan(mechanism_of(a), options);
  write_plan(plan, a.output);
  program.say("plan      " + a.output + ": " + std::to_string(plan.stops.size()) + " stops, " +
              duration(duration_s(plan)));
  if (!a.svg.empty()) draw(program, a, plan);
  if (program.json)
    std::cout << "{\"plan\": " + json_text(a.output) + ", \"stops\": " + std::to_string(plan.stops.size()) +
                     ", \"total_s\": " + json_number(duration_s(plan)) + "}\n";
}

void run(Program& program, const Arguments& a) {
  if (a.square != 0) return plan_repeatability(program, a);
  check(a.object);
  const Optics optics = optics_of(a);
  const bool cables = a.robot == "cables";
  // The camera is offset by a fixed angle, the one that would be needed changes along the meridian (paper, 2.3).
  double pointing_error = 0;
  if (cables) {
    const auto [from, to] = two_numbers(a.phi, "..", "--phi");
    for (const double phi : {from, to})
      pointing_error =
          std::max(pointing_error, std::abs(phi - (a.tilt_factor * phi + a.tilt_offset_deg) - 45) * kDegree);
  }
  const double margin = margin_of(a);
  const double radius =
      a.radius > 0 ? a.radius
                   : fill_radius(optics, a.object, orientation_of(a), margin, std::min(pointing_error, 60 * kDegree));
  if (!(a.radius > 0))
    program.say("radius    " + formatted("%.3f m: there the object fills the picture but for %.0f %% on each side",
                                         radius, 100 * margin));
  const HemisphereOptions views = views_of(a, radius);
  const Camera camera = a.camera.empty() ? ideal_camera(optics, radius) : calib::load_intrinsics(a.camera).camera;
  const Sharpness sharp = sharpness(optics, radius, a.exposure);
  const std::vector<std::string> warnings = optics_warnings(optics, a.object, radius, a.exposure);

  PlannedTour tour;
  std::optional<Comparison> raster;
  if (cables) {
    const Mechanism mechanism = mechanism_of(a);
    PlannerOptions options;
    options.limits.clearance_m = a.clearance;
    options.object = standing_object(a.object, views.center, mechanism.room.min().z());
    options.cameras = words(a.cameras);
    options.pictures_per_battery = a.battery;
    options.kicks = a.kicks, options.seed = a.seed;
    const PlannedTour straight = raster_tour(mechanism, views, options, program.job());
    tour = a.raster ? straight : plan_tour(mechanism, views, options, program.job());
    if (!a.raster && straight.left_out.size() == tour.left_out.size()) raster = {straight.travel_m, straight.travel_s};
  } else {
    const double travel = a.travel >= 0 ? a.travel : a.robot == "hand" ? 10 : 3;
    tour = view_tour(a.robot, views, orientation_of(a), words(a.cameras), travel);
  }
  std::vector<PlacedTarget> targets;
  if (!a.targets.empty()) {
    targets = read_placed_targets(a.targets);
  } else if (a.enclosure.targets != 0) {
    Enclosure enclosure = a.enclosure;
    enclosure.center = views.center;
    enclosure.seed = a.seed;
    targets = scatter_targets(enclosure);
  }
  const PlanReport found = report(tour.plan, camera, a.object, views.center, targets);
  say(program, a, tour, found, sharp, radius, warnings, raster);
  write_plan(tour.plan, a.output);
  program.say("plan      " + a.output);
  if (!a.svg.empty()) draw(program, a, tour.plan);
  if (program.json) std::cout << json_of(a, tour, found, sharp, radius, warnings, raster);
}

}  // namespace

void add_plan(Program& program) {
  const auto a = std::make_shared<Arguments>();
  a->enclosure.targets = 0;
  CLI::App* verb =
      program.verb("plan", "where photographs are taken, in which order, and whether robot and lens can do it",
                   [&program, a] { run(program, *a); });
  verb->add_option("--robot", a->robot, "what carries the camera [cables]")
      ->check(CLI::IsMember({"cables", "turntable", "hand"}));
  verb->add_option("--mechanism", a->mechanism,
                   "the cables: a file, \"paper\", or \"large\" for radii to 2.7 m [paper]")
      ->type_name("FILE|paper|large");
  verb->add_option("--object-diameter", a->object.diameter_m,
                   "of an upright cylinder, or a sphere, that holds the object, m");
  verb->add_option("--object-height", a->object.height_m, "of that cylinder, m; 0: a sphere [0]");
  verb->add_option("--lens", a->optics.focal_length_mm, "focal length, mm [18]");
  verb->add_option("--sensor", a->sensor, "its width x height, mm [22.7x15.1]")->type_name("WxH");
  verb->add_option("--pixels", a->pixels, "the picture's width x height [3072x2048]")->type_name("WxH");
  verb->add_option("--f-number", a->optics.f_number, "[16]");
  verb->add_option("--confusion-mm", a->optics.circle_of_confusion_mm, "blur that counts as sharp, mm [0.015]");
  verb->add_option("--camera", a->camera, "the calibrated camera, for what is in the picture; else an ideal lens")
      ->type_name("FILE");
  verb->add_option("--radius", a->radius, "of the hemisphere, m; omitted: where the object fills the picture");
  verb->add_option("--margin", a->margin,
                   "of the picture that stays free on each side, without --radius [0.1; turntable 0.05]")
      ->check(CLI::Range(0.0, 0.45));
  verb->add_option("--center", a->center, "of the hemisphere, world, m [0,0,0]")
      ->expected(3)
      ->delimiter(',')
      ->type_name("X,Y,Z");
  verb->add_option("--steps", a->steps, "azimuths x rows [24x10]")->type_name("NxM");
  verb->add_option("--spacing-deg", a->spacing_deg,
                   "in place of --steps: between neighbouring views; fewer azimuths towards the zenith");
  verb->add_option("--overlap", a->overlap,
                   "in place of --steps: share of the seen surface that neighbours share, 0 to 0.99");
  verb->add_flag("--thin", a->thin, "fewer azimuths towards the zenith with --steps, too");
  verb->add_option("--phi", a->phi, "first and last angle from straight above, degrees [0..90]")->type_name("A..B");
  verb->add_option("--orientation", a->orientation,
                   "of the pictures; of cables' cameras it is the mechanism's [portrait]")
      ->check(CLI::IsMember({"portrait", "landscape"}));
  verb->add_option("--tilt-factor", a->tilt_factor, "the platform is tilted by factor x phi + offset [2/3]");
  verb->add_option("--tilt-offset-deg", a->tilt_offset_deg, "[-30]");
  verb->add_option("--bearing", a->bearing, "how the camera is turned to the azimuth [gravity]")
      ->check(CLI::IsMember({"gravity", "motor", "fixed"}));
  verb->add_option("--bearing-tolerance-deg", a->bearing_tolerance_deg,
                   "azimuths that far on both sides share a bearing [8]");
  verb->add_option("--settle", a->settle, "until the swing has died out, s [7]");
  verb->add_option("--exposure", a->exposure, "s [0.5]");
  verb->add_option("--travel", a->travel, "between views on a turntable [3] or in a hand [10], s")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--clearance", a->clearance,
                   "of platform and cables to the object, of the platform to the room, m [0.05]");
  verb->add_option("--targets", a->targets, "targets on the walls: a list, or a capture's targets.json")
      ->type_name("FILE");
  verb->add_option("--scatter", a->enclosure.targets,
                   "without a list: that many targets at random on eight panels and the floor");
  verb->add_option("--enclosure-radius", a->enclosure.radius_m, "to the panels, m [3]");
  verb->add_option("--target-size", a->enclosure.target_size_m, "m [0.15]");
  verb->add_option("--cameras", a->cameras, "names, one photograph a stop and camera [camera]")->type_name("NAME,…");
  verb->add_option("--battery", a->battery, "pictures until its change; 0: no end [1000]");
  verb->add_option("--repeatability", a->square,
                   "in place of views: 25 visits of the corners of a level square of this side about --center, m");
  verb->add_flag("--raster", a->raster, "azimuth by azimuth, from above downwards, as in the paper");
  verb->add_option("--kicks", a->kicks, "how long a shorter way is searched for [1000]");
  verb->add_option("--seed", a->seed, "of search and scatter [1]");
  verb->add_option("-o,--output", a->output, "[plan.json]")->type_name("FILE");
  verb->add_option("--svg", a->svg, "a folder for pictures: from above, from the side, tensions, time")
      ->type_name("FOLDER");
}

}  // namespace lumihull::program
