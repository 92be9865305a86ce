// The mechanism's design and its calibration: what the README of libcapture/src/design reports.
//
//   bench_design design SEEDS EVALUATIONS   Φ alone and practical designs beside each other
//   bench_design tilt SEEDS                 how far the tilt may reach
//   bench_design calibration SEEDS          lengths at new poses, by noise and kind of data
//   bench_design figures FOLDER             pictures of paper_mechanism()

#include <lumihull/base/files.h>
#include <lumihull/capture/design.h>
#include <lumihull/capture/mechanism_figures.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "../capture/simulated_observations.h"

using namespace lumihull;
using namespace lumihull::capture;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

double cpu_s() { return double(std::clock()) / CLOCKS_PER_SEC; }

KeepOut object_of(const Mechanism& m, double radius) { return {{0, 0, m.room.min().z()}, radius, -m.room.min().z()}; }

/// Between the poses that were designed for, too.
void print_reach(const Mechanism& m, Job& job) {
  for (const double radius : {1.0, 1.5, 2.0, 2.7}) {
    Workspace w;
    w.radius_m = radius, w.azimuths = 72, w.polar_steps = 31;
    const KeepOut object = object_of(m, 0.4 * std::min(1.0, radius / 1.5));
    const WorkspaceReport r = examine(m, w, &object, job);
    double least = 1e9, most = 0, near = 1e9, cables = 1e9, axis = 1e9, sight = 1e9, turn = 0;
    int balanced = 0, crossings = 0;
    for (const PoseReport& p : r.poses) {
      balanced += p.balanced(), crossings += p.crossing.has_value();
      least = std::min(least, p.balanced() ? p.tensions.tension_N.minCoeff() : 0);
      most = std::max(most, p.tensions.tension_N.maxCoeff());
      near = std::min(near, least_clearance_m(p.clearance));
      cables = std::min(cables, p.clearance.cable_cable), axis = std::min(axis, p.clearance.cable_object);
      sight = std::min(sight, p.sight_rad), turn = std::max(turn, p.sensitivity.rotation_joint);
    }
    std::printf(
        "  radius %.1f m: %5.1f %% balanced, %5.1f %% with 1 N and 5 cm, %d crossings, %.2f to %.0f N, clearance "
        "%.1f cm (cables %.1f, object %.1f), sight %.1f deg, %.2f deg/mm\n",
        radius, 100.0 * balanced / double(w.size()), 100 * r.coverage(1, 0.05), crossings, least, most, 100 * near,
        100 * cables, 100 * axis, sight / kDegree, turn * 1e-3 / kDegree);
  }
}

void design(int seeds, std::size_t evaluations) {
  Job job;
  for (const bool practical : {false, true})
    for (const bool paired : {true, false})
      for (int seed = 21; seed < 21 + seeds; ++seed) {
        DesignOptions options;
        if (!practical) options.goals.reset();
        options.object = object_of(paper_mechanism(), 0.4);
        // A coarse grid finds as good designs as one of 240 poses, in a third of the time; judged on 2232 below.
        options.workspaces[0].azimuths = 12, options.workspaces[0].polar_steps = 7;
        options.paired = paired, options.seed = std::uint64_t(seed), options.evaluations = evaluations;
        const double start = cpu_s();
        const MechanismDesign d = design_mechanism(paper_mechanism(), options, job);
        std::printf("%s, %s, seed %d: objective %.4f after %zu evaluations, %d restarts, %.1f s of CPU\n",
                    practical ? "practical" : "phi alone", paired ? "three points" : "six points", seed, d.objective,
                    d.evaluations, d.restarts, cpu_s() - start);
        print_reach(d.mechanism, job);
        for (const Cable& c : d.mechanism.cables)
          std::printf("    {{%.4f, %.4f, %.4f}, {%.4f, %.4f, 0}}\n", c.departure.x(), c.departure.y(), c.departure.z(),
                      c.attachment.x(), c.attachment.y());
        std::fflush(stdout);
      }
}

void tilt(int seeds) {
  Job job;
  std::printf("best Φ of %d seeds, 20000 evaluations each, 240 poses, three points; law: tilt from first to last\n",
              seeds);
  for (const bool centred : {true, false})
    for (const int reach : {15, 30, 45, 60, 75, 90}) {
      double best = 0;
      for (int seed = 1; seed <= seeds; ++seed) {
        DesignOptions options;
        options.goals.reset();
        options.seed = std::uint64_t(seed);
        set_tilt(options.workspaces[0], centred ? -reach * kDegree : 0, reach * kDegree);
        best = std::min(best, design_mechanism(paper_mechanism(), options, job).objective);
      }
      Workspace w;
      set_tilt(w, centred ? -reach * kDegree : 0, reach * kDegree);
      std::printf("  %4d to %2d degrees: %.0f of 240; paper_mechanism() %d\n", centred ? -reach : 0, reach, -best,
                  -paper_objective(paper_mechanism(), w));
      std::fflush(stdout);
    }
}

void calibration(int seeds) {
  for (const bool room : {false, true})
    for (const int poses : {60, 240, 600})
      for (const double noise : {0.0, 1.0}) {
        double rms = 0, worst = 0, departures = 0, across = 0;
        for (int seed = 1; seed <= seeds; ++seed) {
          test::SimulatedOptions options;
          options.seed = std::uint64_t(seed), options.observations = poses, options.all_over_the_room = room;
          options.groups = std::min(24, poses / 10);
          options.position_noise_m *= noise, options.rotation_noise_rad *= noise;
          const auto mechanism = test::simulated_mechanism(options);
          const auto found =
              calibrate_mechanism(mechanism.guess, test::simulated_observations(mechanism, options, options.seed));
          test::SimulatedOptions clean = options;
          clean.position_noise_m = clean.rotation_noise_rad = 0;
          clean.observations = 480;
          const double error =
              test::length_error_m(found, test::simulated_observations(mechanism, clean, 1000 + options.seed));
          clean.all_over_the_room = true;
          across +=
              test::length_error_m(found, test::simulated_observations(mechanism, clean, 2000 + options.seed)) / seeds;
          rms += error / seeds, worst = std::max(worst, error);
          for (std::size_t i = 0; i < 6; ++i)
            departures +=
                (found.mechanism.cables[i].departure - mechanism.truth.cables[i].departure).norm() / (6 * seeds);
        }
        std::printf(
            "%-10s %3d poses, %.1f mm / %.1f mrad: new poses %.4f mm (worst seed %.4f), all over the room "
            "%.3f mm, departures %.2f mm\n",
            room ? "room" : "hemisphere", poses, 0.5 * noise, 0.3 * noise, 1e3 * rms, 1e3 * worst, 1e3 * across,
            1e3 * departures);
        std::fflush(stdout);
      }
}

void figures(const std::filesystem::path& folder) {
  Job job;
  const Mechanism m = paper_mechanism();
  const KeepOut object = object_of(m, 0.4);
  Workspace w;
  write_file(folder / "room.svg", draw_mechanism(m, w, &object, 0, 6));
  const WorkspaceReport report = examine(m, w, &object, job);
  write_file(folder / "balance.svg", draw_map(report, WorkspaceValue::balance));
  write_file(folder / "least_tension.svg", draw_map(report, WorkspaceValue::least_tension));
  write_file(folder / "clearance.svg", draw_map(report, WorkspaceValue::clearance));
  write_file(folder / "sensitivity.svg", draw_map(report, WorkspaceValue::rotation_sensitivity));
  write_file(folder / "tensions.svg", draw_tensions(report, m, 0));
  Workspace without = w;
  w.polar_steps = 31;
  write_file(folder / "tilt.svg", draw_tilt_ranges(m, w, 0, job));
  set_tilt(without, 0, std::numbers::pi / 2);
  write_file(folder / "balance_without_offset.svg",
             draw_map(examine(m, without, &object, job), WorkspaceValue::balance));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const int seeds = argc > 2 ? std::max(1, std::atoi(argv[2])) : 3;
  if (what == "design")
    design(seeds, argc > 3 ? std::size_t(std::atoi(argv[3])) : 20000);
  else if (what == "tilt")
    tilt(seeds);
  else if (what == "calibration")
    calibration(seeds);
  else if (what == "figures" && argc > 2)
    figures(argv[2]);
  else
    return std::fputs("usage: bench_design design|tilt|calibration SEEDS, or figures FOLDER\n", stderr), 2;
  return 0;
}
