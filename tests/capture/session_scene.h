#pragma once

// A capture with simulated devices, for tests.

#include <lumihull/capture/session.h>
#include <lumihull/capture/simulated_devices.h>

#include <deque>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "support.h"

namespace lumihull::test {

/// Stops around a turntable, or of a mechanism of six cables around an object; times are milliseconds.
capture::Plan turntable_plan(int stops, std::vector<std::string> cameras = {"main"});
capture::Plan cable_plan(int azimuths, int rows);

/// Answers by a script: for each kind of question a word, or the first choice where none is given. Keeps the questions.
class ScriptedOperator : public capture::Operator {
 public:
  std::map<capture::Question::About, std::deque<std::string>> answers;  ///< the last one stays
  std::vector<capture::Question> asked;
  std::vector<std::string> told;
  std::string ask(const capture::Question& question, Job& job) override;
  void tell(const std::string& line) override { told.push_back(line); }
  std::size_t count(capture::Question::About about) const;
};

/// Folder, devices and options of one capture; devices are made anew for each session, as by a new process.
struct Scene {
  explicit Scene(const std::filesystem::path& place, capture::Plan p);

  std::filesystem::path folder, memory;  ///< of the capture; of robot and cameras
  capture::Plan plan;
  capture::SessionOptions options;
  ScriptedOperator who;
  bool recalls = true, delivers = true, robot_remembers = true;
  std::function<void(capture::SimulatedRobot&, const std::vector<capture::SimulatedCamera*>&)> prepare;  ///< faults
  std::vector<std::string> moves;  ///< every place that the robot was sent to, over all sessions
  std::vector<capture::PlannedStop> ways;
  bool ended_safe = false;  ///< motors off, cameras released, after the latest session

  capture::SessionResult run(Job* job = nullptr);
  capture::JournalState state() const { return capture::read_journal(capture::journal_path(folder)); }
  /// The camera's own list: (shot, stop, digest).
  struct Exposure {
    capture::ShotId shot;
    std::string stop, sha256;
  };
  std::vector<Exposure> exposures(const std::string& camera) const;

  /// Every planned view is there once, its digest is what the journal, capture.json and the camera say, and nothing
  /// else lies in photos/.
  void expect_complete() const;
};

}  // namespace lumihull::test
