#include <chrono>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <thread>

#include "bindings.h"

namespace lumihull::python {

namespace {

constexpr std::chrono::milliseconds kSignalInterval{50};

const char* code_name(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_argument:
      return "invalid_argument";
    case ErrorCode::bad_input:
      return "bad_input";
    case ErrorCode::not_found:
      return "not_found";
    case ErrorCode::io:
      return "io";
    case ErrorCode::unsupported:
      return "unsupported";
    case ErrorCode::degenerate:
      return "degenerate";
    case ErrorCode::out_of_memory:
      return "out_of_memory";
    case ErrorCode::cancelled:
      return "cancelled";
    case ErrorCode::internal:
      return "internal";
  }
  return "internal";
}

PyObject* error_type = nullptr;  ///< lumihull.Error; lives as long as the interpreter

void raise_error(const Error& e) {
  py::object error = py::reinterpret_borrow<py::object>(error_type)(e.what());
  error.attr("code") = code_name(e.code());
  error.attr("message") = e.message();
  error.attr("subject") = e.subject();
  PyErr_SetObject(error_type, error.ptr());
}

/// Between the thread that works and the one that waits.
struct Shared {
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  Job* job = nullptr;
  std::optional<Progress> news;
  std::exception_ptr failure;
};

void do_work(Shared& shared, unsigned threads, const std::function<void(Job&)>& body, bool wants_progress) {
  Job::Callback callback;
  if (wants_progress)
    callback = [&shared](const Progress& progress) {
      const std::lock_guard lock(shared.mutex);
      shared.news = progress;
    };
  Job job(std::move(callback), threads);
  {
    const std::lock_guard lock(shared.mutex);
    shared.job = &job;
  }
  std::exception_ptr failure;
  try {
    body(job);
  } catch (...) {
    failure = std::current_exception();
  }
  const std::lock_guard lock(shared.mutex);
  shared.job = nullptr;
  shared.failure = std::move(failure);
  shared.done = true;
  shared.changed.notify_one();
}

/// Who is in use: -1 by one that changes it, else by so many that read it. The GIL protects it.
std::map<const void*, int>& users() {
  static std::map<const void*, int> all;
  return all;
}

}  // namespace

InUse::InUse(const void* object, bool alone) : object_(object), alone_(alone) {
  int& count = users()[object];
  if (count < 0 || (alone && count > 0))
    throw Error(ErrorCode::invalid_argument,
                "a call in another thread, or the one that called back, is still using it; wait for its end", "self");
  count = alone ? -1 : count + 1;
}

InUse::~InUse() {
  const auto at = users().find(object_);
  if (alone_ || --at->second == 0) users().erase(at);
}

void run_job(const py::object& progress, unsigned threads, const std::function<void(Job&)>& body) {
  const bool wants_progress = !progress.is_none();
  Shared shared;
  std::optional<py::error_already_set> raised;
  {
    py::gil_scoped_release without_gil;
    std::jthread worker([&] { do_work(shared, threads, body, wants_progress); });
    std::unique_lock lock(shared.mutex);
    while (!shared.changed.wait_for(lock, kSignalInterval, [&] { return shared.done; })) {
      if (!raised) {
        const std::optional<Progress> news = std::exchange(shared.news, std::nullopt);
        lock.unlock();
        {
          py::gil_scoped_acquire gil;
          try {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            if (news) progress(*news);
          } catch (py::error_already_set& e) {
            raised.emplace(std::move(e));
          }
        }
        lock.lock();
      }
      if (raised && shared.job) shared.job->cancel();
    }
  }
  if (raised) throw py::error_already_set(std::move(*raised));
  if (shared.failure) std::rethrow_exception(shared.failure);
  if (shared.news) progress(*shared.news);
}

}  // namespace lumihull::python

PYBIND11_MODULE(_lumihull, module) {
  using namespace lumihull;
  namespace py = pybind11;
  module.doc() = "Photographs of an object in; silhouettes, a mesh and new views out.";
  module.attr("__version__") = LUMIHULL_VERSION;

  python::error_type = PyErr_NewExceptionWithDoc(
      "lumihull.Error",
      "What Lumihull raises: code (a word), message (one line), subject (a file, a photograph, or '').",
      PyExc_RuntimeError, nullptr);
  module.attr("Error") = py::reinterpret_borrow<py::object>(python::error_type);
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const Error& e) {
      python::raise_error(e);
    } catch (const std::filesystem::filesystem_error& e) {
      python::raise_error(Error(ErrorCode::io, e.code().message(), e.path1().string()));
    }
  });

  py::class_<Progress>(module, "Progress", "How far a long call is.")
      .def_readonly("stage", &Progress::stage)
      .def_readonly("done", &Progress::done)
      .def_readonly("total", &Progress::total)
      .def_readonly("elapsed_s", &Progress::elapsed_s)
      .def_readonly("eta_s", &Progress::eta_s, "Seconds to go; negative: not known yet.");

  python::bind_base(module);
  python::bind_model(module);
  python::bind_capture(module);
  python::bind_views(module);
  python::bind_targets(module);
  python::bind_detections(module);
  python::bind_resect(module);
  python::bind_lens(module);
  python::bind_target_model(module);
  python::bind_mechanism(module);
  python::bind_plan(module);
  python::bind_session(module);
}
