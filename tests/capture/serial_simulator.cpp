#include "serial_simulator.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <lumihull/capture/trajectory.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace lumihull::test {

SerialSimulator::SerialSimulator(const std::vector<std::string>& options) {
  const std::string log_file = (folder_ / "log").string();
  std::vector<std::string> words{LUMIHULL_FIRMWARE_SIM, "--log", log_file};
  words.insert(words.end(), options.begin(), options.end());
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  std::array<int, 2> in{}, out{};
  if (pipe2(in.data(), O_CLOEXEC) != 0 || pipe2(out.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe");
  child_ = fork();
  if (child_ == 0) {
    dup2(in[0], 0);
    dup2(out[1], 1);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  close(in[0]);
  close(out[1]);
  orders_ = in[1];
  for (char c = 0; read(out[0], &c, 1) == 1 && c != '\n';) device_ += c;
  close(out[0]);
  if (device_.empty()) throw std::runtime_error("the simulator did not start");
}

SerialSimulator::~SerialSimulator() {
  kill();
  close(orders_);
}

void SerialSimulator::kill() {
  if (child_ <= 0) return;
  ::kill(child_, SIGKILL);
  waitpid(child_, nullptr, 0);
  child_ = 0;
}

void SerialSimulator::order(const std::string& line) const {
  const std::string text = line + "\n";
  if (write(orders_, text.data(), text.size()) != ssize_t(text.size())) throw std::runtime_error("order");
}

std::vector<SimulatedEvent> SerialSimulator::log() const {
  std::ifstream in(folder_ / "log");
  std::vector<SimulatedEvent> events;
  std::string line;
  while (std::getline(in, line) && !in.eof()) {  // a line without its end is not finished
    const auto blank = line.find(' ');
    events.push_back({std::stoull(line.substr(0, blank)), line.substr(blank + 1)});
  }
  return events;
}

std::size_t SerialSimulator::await(const std::string& what, std::size_t from) const {
  for (int i = 0; i < 6000; ++i) {
    const auto events = log();
    for (std::size_t k = from; k < events.size(); ++k)
      if (events[k].what.rfind(what, 0) == 0) return k;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw std::runtime_error("the simulator did not log: " + what);
}

std::vector<TrueShot> true_shots(const std::vector<SimulatedEvent>& log, std::size_t count) {
  std::vector<TrueShot> shots(count);
  TrueShot* open = nullptr;
  std::uint64_t since = 0;
  for (const SimulatedEvent& event : log) {
    if (event.what.rfind("shutter on ", 0) == 0) {
      open = &shots.at(std::stoul(event.what.substr(11)));
      ++open->begun;
      since = event.ms;
    } else if (open && (event.what == "shutter off" || event.what.rfind("reset", 0) == 0)) {
      open->whole = event.what == "shutter off";
      open->ms = event.ms - since;
      open = nullptr;
    }
  }
  return shots;
}

capture::Plan short_hops() {
  capture::Plan plan;
  plan.robot = "cables";
  plan.mechanism = capture::paper_mechanism();
  plan.cameras = {"main"};
  for (int i = 0; i < 6; ++i) {
    const Pose pose{Eigen::Quaterniond::Identity(), {0.04 * i, 0.02 * (i % 2), 1.5}};
    capture::PlannedStop stop = capture::platform_stop(*plan.mechanism, Eigen::Vector3d::Zero(), pose, 0);
    stop.name = "s" + std::to_string(i);
    stop.travel_s = i > 0 ? 1 : 0;
    stop.settle_s = 0;
    stop.exposure_s = 0.05;
    plan.stops.push_back(stop);
  }
  return plan;
}

}  // namespace lumihull::test
