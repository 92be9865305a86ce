// Captures taken from Python: devices by words or Python's own, a person or a program that answers, a card's pictures.
#include <lumihull/base/capture.h>
#include <lumihull/capture/devices.h>
#include <lumihull/capture/experiments.h>
#include <lumihull/capture/land_card.h>
#include <lumihull/capture/session.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <variant>

#include "bindings.h"
#include "planned.h"

namespace lumihull::python {

using namespace py::literals;
using namespace lumihull::capture;

namespace {

namespace fs = std::filesystem;

/// What a Python callback raised: the session ends by an Error in its place, then it is raised itself.
struct Raised {
  std::optional<py::error_already_set> exception;

  /// Calls Python on the session's thread.
  template <class Call>
  auto call(const char* what, Call&& body) {
    const py::gil_scoped_acquire gil;
    try {
      return body();
    } catch (py::error_already_set& e) {
      if (!exception) exception.emplace(std::move(e));
      throw Error(ErrorCode::io, "an exception was raised", what);
    } catch (const py::cast_error&) {
      throw Error(ErrorCode::invalid_argument, "it returned another type than is expected", what);
    }
  }
};

/// Python's own object as a robot; what it lacks of the methods does nothing.
class PythonRobot : public Robot {
 public:
  PythonRobot(py::handle object, Raised& raised) : object_(object), raised_(raised) {}

  State state() override {
    return raised_.call("robot.state", [&] {
      State s;
      s.ready = s.position_known = true;
      if (!py::hasattr(object_, "state")) return s;
      const auto told = object_.attr("state")().cast<py::dict>();
      const auto value = [&](const char* name, auto fallback) {
        return told.contains(name) ? told[name].cast<decltype(fallback)>() : fallback;
      };
      s.ready = value("ready", true);
      s.moving = value("moving", false);
      s.position_known = value("position_known", true);
      s.lengths_m = value("lengths", std::vector<double>{});
      s.fault = value("fault", std::string());
      return s;
    });
  }
  void move_to(const PlannedStop& stop, Job& job) override {
    job.check();
    raised_.call("robot.move_to", [&] { object_.attr("move_to")(stop); });
  }
  void set_roll(double roll_rad, Job& job) override {
    job.check();
    raised_.call("robot.set_roll", [&] {
      if (py::hasattr(object_, "set_roll")) object_.attr("set_roll")(roll_rad);
    });
  }
  void declare_position(const PlannedStop& stop) override {
    raised_.call("robot.declare_position", [&] {
      if (py::hasattr(object_, "declare_position")) object_.attr("declare_position")(stop);
    });
  }
  void make_safe() noexcept override {
    try {
      raised_.call("robot.make_safe", [&] {
        if (py::hasattr(object_, "make_safe")) object_.attr("make_safe")();
      });
    } catch (const Error&) {  // it is raised when the session has ended
    }
  }

 private:
  py::handle object_;
  Raised& raised_;
};

ShotOutcome outcome_of(const py::object& told) {
  const auto [state, file, detail] =
      told.cast<std::tuple<std::string, std::optional<fs::path>, std::string>>();  // ("done", path, "")
  const ShotState states[] = {ShotState::done, ShotState::refused, ShotState::unknown};
  const char* names[] = {"done", "refused", "unknown"};
  const auto* found = std::find(std::begin(names), std::end(names), state);
  if (found == std::end(names))
    throw Error(ErrorCode::invalid_argument, "expected \"done\", \"refused\" or \"unknown\", found \"" + state + "\"",
                "camera");
  return {states[found - std::begin(names)], file.value_or(fs::path()), detail};
}

class PythonCamera : public CameraDevice {
 public:
  PythonCamera(py::handle object, Raised& raised) : object_(object), raised_(raised) {}

  bool delivers_files() const override {
    return raised_.call("camera.delivers_files", [&] {
      return !py::hasattr(object_, "delivers_files") || object_.attr("delivers_files").cast<bool>();
    });
  }
  ShotOutcome shoot(ShotId id, double exposure_s, const fs::path& folder, Job&) override {
    return raised_.call("camera.shoot", [&] { return outcome_of(object_.attr("shoot")(id, exposure_s, folder)); });
  }
  ShotOutcome recall(ShotId id) override {
    return raised_.call("camera.recall", [&] {
      return py::hasattr(object_, "recall") ? outcome_of(object_.attr("recall")(id)) : ShotOutcome{};
    });
  }
  void make_safe() noexcept override {
    try {
      raised_.call("camera.make_safe", [&] {
        if (py::hasattr(object_, "make_safe")) object_.attr("make_safe")();
      });
    } catch (const Error&) {
    }
  }

 private:
  py::handle object_;
  Raised& raised_;
};

const char* word_of(Question::About about) {
  switch (about) {
    case Question::About::motion:
      return "motion";
    case Question::About::position:
      return "position";
    case Question::About::doubt:
      return "doubt";
    case Question::About::task:
      break;
  }
  return "task";
}

class PythonOperator : public Operator {
 public:
  PythonOperator(py::handle ask, py::handle tell, bool agree_to_motion, Raised& raised)
      : ask_(ask), tell_(tell), absent_(agree_to_motion), raised_(raised) {}

  std::string ask(const Question& question, Job& job) override {
    job.check();
    if (ask_.is_none()) return absent_.ask(question, job);
    const std::string answer = raised_.call("ask", [&] {
      return ask_(word_of(question.about), question.text, question.choices).template cast<std::string>();
    });
    if (std::find(question.choices.begin(), question.choices.end(), answer) == question.choices.end())
      throw Error(ErrorCode::invalid_argument, "\"" + answer + "\" is none of the choices", "ask");
    return answer;
  }
  void tell(const std::string& line) override {
    if (!tell_.is_none()) raised_.call("tell", [&] { tell_(line); });
  }

 private:
  py::handle ask_, tell_;
  AbsentOperator absent_;
  Raised& raised_;
};

using Device = std::variant<std::string, py::object>;

/// A plan, the devices that carry it out, and how.
class PythonSession {
 public:
  PythonSession(const Planned& plan, fs::path folder, Device robot, const std::vector<Device>& cameras,
                SessionOptions options, bool agree_to_motion)
      : plan_(plan.tour.plan),
        folder_(std::move(folder)),
        robot_(std::move(robot)),
        cameras_(cameras),
        options_(std::move(options)),
        agree_to_motion_(agree_to_motion) {
    if (const auto* word = std::get_if<std::string>(&robot_)) check_robot_word(*word);
    if (cameras_.size() == 1) cameras_.resize(plan_.cameras.size(), cameras.front());
    for (const Device& camera : cameras_)
      if (const auto* word = std::get_if<std::string>(&camera)) check_camera_word(*word);
  }

  py::dict dry_run() {
    DryRun found;
    with_devices(py::none(), py::none(), py::none(), [&](auto& robot, const auto& cameras, Operator&, Job&) {
      found = capture::dry_run(plan_, robot, cameras, folder_, options_);
    });
    return py::dict("problems"_a = found.problems, "notes"_a = found.notes, "left"_a = found.left,
                    "seconds"_a = found.seconds);
  }

  py::dict run(const py::object& ask, const py::object& tell, const py::object& progress) {
    SessionResult result;
    with_devices(ask, tell, progress, [&](auto& robot, const auto& cameras, Operator& who, Job& job) {
      result = capture::capture(plan_, robot, cameras, folder_, options_, who, job);
    });
    return py::dict("views"_a = result.views, "of"_a = result.of, "taken"_a = result.taken,
                    "awaited"_a = result.awaited, "paused"_a = result.paused);
  }

 private:
  template <class Body>
  void with_devices(const py::object& ask, const py::object& tell, const py::object& progress, const Body& body) {
    Raised raised;
    try {
      run_job(progress, 0, [&](Job& job) {
        PythonOperator who(ask, tell, agree_to_motion_, raised);
        Devices by_word(folder_, who);
        std::unique_ptr<Robot> robot;
        if (const auto* word = std::get_if<std::string>(&robot_))
          robot = by_word.robot(*word, plan_);
        else
          robot = std::make_unique<PythonRobot>(std::get<py::object>(robot_), raised);
        std::vector<std::unique_ptr<CameraDevice>> owned;
        std::vector<CameraDevice*> cameras;
        for (std::size_t i = 0; i < cameras_.size(); ++i) {
          const std::string name = i < plan_.cameras.size() ? plan_.cameras[i] : "camera " + std::to_string(i + 1);
          if (const auto* word = std::get_if<std::string>(&cameras_[i]))
            owned.push_back(by_word.camera(*word, name, *robot, job));
          else
            owned.push_back(std::make_unique<PythonCamera>(std::get<py::object>(cameras_[i]), raised));
          cameras.push_back(owned.back().get());
        }
        body(*robot, cameras, who, job);
      });
    } catch (const Error&) {
      if (!raised.exception) throw;
    }
    if (raised.exception) throw py::error_already_set(std::move(*raised.exception));
  }

  Plan plan_;
  fs::path folder_;
  Device robot_;
  std::vector<Device> cameras_;
  SessionOptions options_;
  bool agree_to_motion_;
};

PythonSession make_session(const Planned& plan, const fs::path& folder, const Device& robot,
                           const std::vector<Device>& cameras, const std::string& names, std::optional<double> settle_s,
                           std::optional<double> exposure_s, int retries, const std::string& retake,
                           std::size_t pause_after, const std::map<std::string, Camera>& intrinsics,
                           bool agree_to_motion) {
  SessionOptions options;
  options.names = names;
  options.settle_s = settle_s, options.exposure_s = exposure_s;
  options.retries = retries;
  options.retake = retake;
  options.pause_after = pause_after;
  options.intrinsics = intrinsics;
  options.devices = "from Python";
  return {plan, folder, robot, cameras, options, agree_to_motion};
}

py::object loads(const std::string& json) { return py::module_::import("json").attr("loads")(json); }

py::object land(const fs::path& folder, const fs::path& card, const std::string& camera,
                std::optional<double> clock_offset_s, bool again, bool dry, const py::object& tell,
                const py::object& progress) {
  LandOptions options;
  options.camera = camera;
  options.clock_offset_s = clock_offset_s;
  options.again = again, options.dry_run = dry;
  Raised raised;
  const auto say = [&](const std::string& line) {
    if (!tell.is_none()) raised.call("tell", [&] { tell(line); });
  };
  try {
    return loads(
        work(progress, 0, [&](Job& job) { return describe_json(land_card(folder, card, options, say, job)); }));
  } catch (const Error&) {
    if (!raised.exception) throw;
  }
  throw py::error_already_set(std::move(*raised.exception));
}

void bind_experiments(py::module_& module) {
  module.def(
      "repeatability", [](const Capture& capture) { return loads(describe_json(repeatability(capture))); }, "capture"_a,
      "How well the robot came back: of a calibrated capture whose plan visits places several times.");
  module.def(
      "pose_spread",
      [](const std::vector<Pose>& poses) {
        const PoseSpread s = pose_spread(poses);
        return py::make_tuple(s.mean, Array<double>(py::ssize_t(s.distance_m.size()), s.distance_m.data()),
                              Array<double>(py::ssize_t(s.angle_rad.size()), s.angle_rad.data()));
      },
      "world_from_camera"_a, "The mean pose, and distances (n,), m, and angles (n,), rad, of the poses from it.");
  module.def(
      "stability",
      [](const Array<double>& time_s, const Array<double>& center_px, double allowed_px, double rest_s) {
        if (time_s.ndim() != 1) invalid("expected an array of shape (n,)", "time_s");
        std::vector<Eigen::Vector2d> centers(rows(center_px, 2, "center_px"));
        for (std::size_t i = 0; i < centers.size(); ++i)
          centers[i] = Eigen::Map<const Eigen::Vector2d>(center_px.data() + 2 * i);
        const Stability s = stability({time_s.data(), std::size_t(time_s.size())}, centers, allowed_px, rest_s);
        return py::dict("settle_s"_a = s.settle_s, "rest_px"_a = s.rest_px,
                        "distance_px"_a = Array<double>(py::ssize_t(s.distance_px.size()), s.distance_px.data()));
      },
      "time_s"_a, "center_px"_a, "allowed_px"_a = 0.5, "rest_s"_a = 2.0,
      "When a target (n, 2) in a film stays within allowed_px of where it rests; settle_s None: not at the end.");
}

}  // namespace

void bind_session(py::module_& module) {
  py::class_<PythonSession>(module, "Session", "A plan carried out, and gone on with, by robot and cameras.")
      .def(py::init(&make_session), "plan"_a, "folder"_a, "robot"_a, "cameras"_a, py::kw_only(),
           "names"_a = "{stop}-{camera}", "settle_s"_a = py::none(), "exposure_s"_a = py::none(), "retries"_a = 2,
           "retake"_a = "", "pause_after"_a = 0, "intrinsics"_a = std::map<std::string, Camera>{},
           "agree_to_motion"_a = false,
           "robot: \"simulate\", \"turntable\", \"hand\", \"serial:PORT\", or an object with `move_to(stop)`. cameras: "
           "\"simulate\", \"hand\", \"serial[:PORT]\", \"gphoto2[:PORT]\", \"folder:DIR\", or objects with "
           "`shoot(id, exposure_s, folder) -> (\"done\" | \"refused\" | \"unknown\", file or None, detail)`; one for "
           "all, or one for each of the plan.")
      .def("dry_run", guarded([](PythonSession& s) { return s.dry_run(); }),
           "Checks all that can be checked without moving: problems, notes, photographs left, seconds.")
      .def("run",
           guarded([](PythonSession& s, const py::object& ask, const py::object& tell, const py::object& progress) {
             return s.run(ask, tell, progress);
           }),
           "ask"_a = py::none(), "tell"_a = py::none(), "progress"_a = py::none(),
           "Moves, waits, photographs into the folder, which becomes a capture; after anything the same call goes on. "
           "ask(about, text, choices) returns one of the choices; without it nobody is there.");
  module.def("land_card", &land, "folder"_a, "card"_a, py::kw_only(), "camera"_a = "", "clock_offset_s"_a = py::none(),
             "again"_a = false, "dry_run"_a = false, "tell"_a = py::none(), "progress"_a = py::none(),
             "Pictures of a memory card to the shots of a capture's journal.");
  bind_experiments(module);
}

}  // namespace lumihull::python
