#pragma once

// What the files of the Python module share.

#include <lumihull/base/error.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/base/pose.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

namespace lumihull::python {

namespace py = pybind11;

/// Arrays that NumPy may cast safely to T, in C order.
template <class T>
using Array = py::array_t<T, py::array::c_style>;

void bind_base(py::module_& module);
void bind_model(py::module_& module);
void bind_capture(py::module_& module);
void bind_views(py::module_& module);
void bind_detections(py::module_& module);
void bind_targets(py::module_& module);
void bind_resect(py::module_& module);
void bind_lens(py::module_& module);
void bind_target_model(py::module_& module);
void bind_mechanism(py::module_& module);
void bind_plan(py::module_& module);
void bind_session(py::module_& module);

[[noreturn]] inline void invalid(const std::string& message, const char* argument) {
  throw Error(ErrorCode::invalid_argument, message, argument);
}

/// Checks that an array is (n, columns) and returns n.
template <class T>
std::size_t rows(const Array<T>& array, py::ssize_t columns, const char* name) {
  if (array.ndim() != 2 || array.shape(1) != columns)
    invalid("expected an array of shape (n, " + std::to_string(columns) + ")", name);
  return std::size_t(array.shape(0));
}

/// Says, while it lives, that a Capture or a Renderer is in use, for a call that lets go of the GIL leaves it to other
/// threads, and to callbacks. Many may read at once, but who changes it must be alone: else Error{invalid_argument}.
/// Made and destroyed with the GIL.
class InUse {
 public:
  InUse(const void* object, bool alone);
  InUse(const InUse&) = delete;
  InUse& operator=(const InUse&) = delete;
  ~InUse();

 private:
  const void* object_;
  bool alone_;
};

/// The method self -> f(self, …) with `self` in use: by a reader where f takes it as const.
template <class F, class R, class Self, class... Arguments>
auto guarded_as(F f, R (F::*)(Self&, Arguments...) const) {
  return [f](Self& self, Arguments... arguments) -> R {
    const InUse in_use(&self, !std::is_const_v<Self>);
    return f(self, std::forward<Arguments>(arguments)...);
  };
}
template <class F>
auto guarded(F f) {
  return guarded_as(f, &F::operator());
}

/// Runs body(Job&) on a thread of its own, without the GIL, while the calling thread waits and, every 50 ms and with
/// the GIL, lets Python's signal handlers run and calls `progress` (None: nothing). What one of them raises (Ctrl-C's
/// KeyboardInterrupt) cancels the job and is raised as soon as the body has returned. So Ctrl-C does not depend on how
/// often an algorithm reports.
void run_job(const py::object& progress, unsigned threads, const std::function<void(Job&)>& body);

/// The same with a result.
template <class Body>
auto work(const py::object& progress, unsigned threads, Body&& body) {
  std::optional<std::invoke_result_t<Body, Job&>> result;
  run_job(progress, threads, [&](Job& job) { result.emplace(body(job)); });
  return std::move(*result);
}

/// A view of an image's pixels: (height, width, channels), or (height, width) for one channel; `owner` is kept alive.
py::array pixels(const Image& image, py::handle owner, bool writable);
/// A picture's pixels as an array that owns them.
py::array own_pixels(Image&& image);
/// A copy of an array of uint8, uint16 or float32, (h, w) or (h, w, channels), as a picture.
Image image_from(const py::array& array);

/// (3, 4) [R t], R a rotation to within 1e-6; Error{invalid_argument} else.
Pose pose_from(const Array<double>& matrix);

}  // namespace lumihull::python
