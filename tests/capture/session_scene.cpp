#include "session_scene.h"

#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/trajectory.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

namespace lumihull::test {

namespace fs = std::filesystem;
using namespace capture;

Plan turntable_plan(int stops, std::vector<std::string> cameras) {
  Plan plan;
  plan.robot = "turntable";
  plan.cameras = std::move(cameras);
  for (int i = 0; i < stops; ++i) {
    PlannedStop stop;
    char name[24];
    std::snprintf(name, sizeof name, "a%03d-e00", i);
    stop.name = name;
    stop.theta_rad = 2 * std::numbers::pi * i / stops;
    stop.phi_rad = 1.2;
    const Eigen::Vector3d eye(std::cos(stop.theta_rad), std::sin(stop.theta_rad), 0.4);
    stop.cam_from_world = look_at(eye, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
    stop.world_from_platform = stop.cam_from_world.inverse();
    stop.travel_s = 0.001;
    stop.settle_s = 0.0005;
    stop.exposure_s = 0.001;
    plan.stops.push_back(stop);
  }
  return plan;
}

/// Three pairs of cables far apart: stiff enough all over the hemisphere, and no two of them can meet.
Mechanism wide_mechanism() {
  Mechanism mechanism = paper_mechanism();
  for (int i = 0; i < 6; ++i) {
    const double at = 2 * std::numbers::pi / 3 * (i / 2), from = at + (i % 2 ? 1 : -1);
    mechanism.cables[std::size_t(i)].attachment = {0.25 * std::cos(at), 0.25 * std::sin(at), 0};
    mechanism.cables[std::size_t(i)].departure = {4.5 * std::cos(from), 4.5 * std::sin(from), mechanism.room.max().z()};
  }
  return mechanism;
}

Plan cable_plan(int azimuths, int rows) {
  Plan plan;
  plan.robot = "cables";
  plan.cameras = {"main"};
  plan.mechanism = wide_mechanism();
  HemisphereOptions views;
  views.azimuths = azimuths;
  views.rows = rows;
  views.phi_from_rad = 0.3;
  views.phi_to_rad = 1.2;
  views.tilt_factor = 1.0 / 3;
  views.tilt_offset_rad = -std::numbers::pi / 12;
  views.bearing = Bearing::fixed;
  plan.stops = hemisphere_stops(*plan.mechanism, views);
  plan.object = KeepOut{{0, 0, -0.5}, 0.25, 0.5};
  for (PlannedStop& stop : plan.stops) {
    stop.travel_s = 0.001;
    stop.settle_s = 0.0005;
    stop.exposure_s = 0.001;
  }
  return plan;
}

std::string ScriptedOperator::ask(const Question& question, Job&) {
  asked.push_back(question);
  auto& script = answers[question.about];
  if (script.empty()) return question.choices.front();
  const std::string answer = script.front();
  if (script.size() > 1) script.pop_front();
  return answer;
}

std::size_t ScriptedOperator::count(Question::About about) const {
  return std::size_t(std::count_if(asked.begin(), asked.end(), [&](const Question& q) { return q.about == about; }));
}

Scene::Scene(const fs::path& place, Plan p) : folder(place / "object"), memory(place / "devices"), plan(std::move(p)) {
  fs::create_directories(memory / "card");
  options.page_every_s = 1000;
  options.retry_after_s = 0;
}

SessionResult Scene::run(Job* job) {
  Job own;
  capture::SimulatedRobot robot({.time_scale = 1,
                                 .turn_s = 0.001,
                                 .memory = robot_remembers ? memory / "robot" : fs::path(),
                                 .starts_anywhere = !plan.mechanism});
  robot.on_move = [&](const PlannedStop& stop) {
    moves.push_back(stop.name);
    ways.push_back(stop);
  };
  std::vector<std::unique_ptr<capture::SimulatedCamera>> cameras;
  std::vector<capture::SimulatedCamera*> simulated;
  std::vector<CameraDevice*> devices;
  for (const std::string& name : plan.cameras) {
    cameras.push_back(std::make_unique<capture::SimulatedCamera>(
        capture::SimulatedCamera::Options{.name = name,
                                          .list = memory / ("exposures-" + name),
                                          .recalls = recalls,
                                          .delivers = delivers,
                                          .card = memory / "card",
                                          .time_scale = 1},
        &robot));
    simulated.push_back(cameras.back().get());
    devices.push_back(cameras.back().get());
  }
  if (prepare) prepare(robot, simulated);
  ended_safe = false;
  struct End {
    Scene& scene;
    capture::SimulatedRobot& robot;
    std::vector<capture::SimulatedCamera*>& cameras;
    ~End() {
      scene.ended_safe = !robot.motors_on();
      for (const auto* camera : cameras) scene.ended_safe &= !camera->ready();
    }
  } end{*this, robot, simulated};
  return capture::capture(plan, robot, devices, folder, options, who, job ? *job : own);
}

std::vector<Scene::Exposure> Scene::exposures(const std::string& camera) const {
  std::vector<Exposure> out;
  std::ifstream in(memory / ("exposures-" + camera));
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    Exposure e;
    if (words >> e.shot >> e.stop >> e.sha256) out.push_back(e);
  }
  return out;
}

void Scene::expect_complete() const {
  const JournalState journal = state();
  const Capture written = Capture::open(folder);
  std::map<std::pair<std::string, ShotId>, Exposure> exposed;
  for (const std::string& camera : plan.cameras)
    for (const Exposure& e : exposures(camera))
      EXPECT_TRUE(exposed.emplace(std::pair(camera, e.shot), e).second) << "shot " << e.shot << " exposed twice";
  std::set<std::string> files;
  std::size_t n = 0;
  for (std::size_t s = 0; s < plan.stops.size(); ++s)
    for (std::size_t c = 0; c < plan.cameras.size(); ++c) {
      SCOPED_TRACE(plan.stops[s].name + " " + plan.cameras[c]);
      const ShotProgress& shot = journal.shots[journal.index(s, c)];
      ASSERT_EQ(shot.step, ShotStep::landed);
      const Take& take = shot.landed.back();
      const fs::path file = folder / "photos" / take.file;
      ASSERT_TRUE(fs::exists(file));
      EXPECT_EQ(sha256_of_file(file), take.sha256);
      const auto made = exposed.find({plan.cameras[c], take.shot});
      ASSERT_NE(made, exposed.end());
      EXPECT_EQ(made->second.stop, plan.stops[s].name);
      EXPECT_EQ(made->second.sha256, take.sha256);
      for (const Take& each : shot.landed) files.insert(each.file);
      ASSERT_LT(n, written.shots.size());
      EXPECT_EQ(written.shots[n].file, "photos/" + take.file);
      EXPECT_EQ(written.shots[n].stamp.sha256, take.sha256);
      EXPECT_EQ(written.shots[n].commanded->stop, plan.stops[s].name);
      ++n;
    }
  EXPECT_EQ(written.shots.size(), n);
  std::set<std::string> there;
  for (const auto& entry : fs::directory_iterator(folder / "photos")) there.insert(entry.path().filename().string());
  EXPECT_EQ(there, files);
}

}  // namespace lumihull::test
