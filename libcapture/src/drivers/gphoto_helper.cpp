// lumihull-gphoto2: libgphoto2 in a process of its own. gphoto_protocol.h says what it is asked and answers.
//
// It is dumb on purpose: deadlines, decisions and files are the parent's, for any call into libgphoto2 may hang.

#include <gphoto2/gphoto2.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>

#include "gphoto_protocol.h"

namespace {

using lumihull::capture::gphoto::word;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

void put(const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = ::write(STDOUT_FILENO, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) std::_Exit(1);  // nobody listens
    data += n;
    size -= std::size_t(n);
  }
}

void say(const std::string& line) { put((line + '\n').c_str(), line.size() + 1); }
void say_error(int result) { say("error " + word(gp_result_as_string(result))); }

/// libgphoto2 may hang for ever; the parent may be killed meanwhile. Ends this process soon after its input has ended.
void watch_parent() {
  std::thread([] {
    pollfd parent{STDIN_FILENO, 0, 0};  // asks for nothing: only the hang-up is told
    while (::poll(&parent, 1, -1) < 0 && errno == EINTR) {
    }
    std::this_thread::sleep_for(milliseconds(1500));  // for an orderly end
    std::_Exit(1);
  }).detach();
}

class Helper {
 public:
  Helper() : context_(gp_context_new()) {
    const auto keep = [](GPContext*, const char* text, void* data) {
      if (text) *static_cast<std::string*>(data) = text;
    };
    gp_context_set_error_func(context_, keep, &trouble_);
  }
  ~Helper() { close(); }
  Helper(const Helper&) = delete;
  Helper& operator=(const Helper&) = delete;

  void cameras();
  void open(const std::string& port, const std::string& model);
  void drain();
  void trigger();
  void event(int wait_ms);
  void get(const std::string& folder, const std::string& name);
  void remove(const std::string& folder, const std::string& name);
  bool is_open() const { return camera_ != nullptr; }

 private:
  void close() {
    if (!camera_) return;
    gp_camera_exit(camera_, context_);
    gp_camera_unref(camera_);
    camera_ = nullptr;
  }
  int choose_model(const std::string& model);
  int choose_port(const std::string& port);
  /// One event, or none by then. libgphoto2 may come back before the time that it was given.
  CameraEventType wait(int wait_ms, CameraFilePath& path, int& result);

  GPContext* context_;
  std::string trouble_;  ///< what libgphoto2 said last of an error
  Camera* camera_ = nullptr;
};

void Helper::cameras() {
  CameraList* list = nullptr;
  gp_list_new(&list);
  const int count = gp_camera_autodetect(list, context_);
  for (int i = 0; i < count; ++i) {
    const char *model = "", *port = "";
    gp_list_get_name(list, i, &model);
    gp_list_get_value(list, i, &port);
    say("camera " + word(model) + " " + word(port));
  }
  gp_list_unref(list);
  if (count < 0) return say_error(count);
  say("ok");
}

int Helper::choose_model(const std::string& model) {
  CameraAbilitiesList* list = nullptr;
  int result = gp_abilities_list_new(&list);
  if (result < GP_OK) return result;
  result = gp_abilities_list_load(list, context_);
  if (result >= GP_OK) result = gp_abilities_list_lookup_model(list, model.c_str());
  CameraAbilities abilities;
  if (result >= GP_OK) result = gp_abilities_list_get_abilities(list, result, &abilities);
  if (result >= GP_OK) result = gp_camera_set_abilities(camera_, abilities);
  gp_abilities_list_free(list);
  return result;
}

int Helper::choose_port(const std::string& port) {
  GPPortInfoList* list = nullptr;
  int result = gp_port_info_list_new(&list);
  if (result < GP_OK) return result;
  result = gp_port_info_list_load(list);
  if (result >= GP_OK) result = gp_port_info_list_lookup_path(list, port.c_str());
  GPPortInfo info = nullptr;
  if (result >= GP_OK) result = gp_port_info_list_get_info(list, result, &info);
  if (result >= GP_OK) result = gp_camera_set_port_info(camera_, info);
  gp_port_info_list_free(list);
  return result;
}

void Helper::open(const std::string& port, const std::string& model) {
  close();
  int result = gp_camera_new(&camera_);
  if (result >= GP_OK && !model.empty()) result = choose_model(model);
  if (result >= GP_OK && !port.empty()) result = choose_port(port);
  if (result >= GP_OK) result = gp_camera_init(camera_, context_);
  CameraAbilities abilities{};
  if (result >= GP_OK) result = gp_camera_get_abilities(camera_, &abilities);
  if (result < GP_OK) {
    if (camera_) gp_camera_unref(camera_);
    camera_ = nullptr;
    return say_error(result);
  }
  say("ok " + word(abilities.model));
}

CameraEventType Helper::wait(int wait_ms, CameraFilePath& path, int& result) {
  const auto end = Clock::now() + milliseconds(wait_ms);
  for (;;) {
    const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now()).count();
    CameraEventType type = GP_EVENT_TIMEOUT;
    void* data = nullptr;
    result = gp_camera_wait_for_event(camera_, int(left > 0 ? left : 0), &type, &data, context_);
    if (result >= GP_OK && type == GP_EVENT_FILE_ADDED && data) path = *static_cast<CameraFilePath*>(data);
    std::free(data);
    if (result < GP_OK || type == GP_EVENT_FILE_ADDED || type == GP_EVENT_CAPTURE_COMPLETE) return type;
    if (Clock::now() >= end) return GP_EVENT_TIMEOUT;
    if (type == GP_EVENT_TIMEOUT) std::this_thread::sleep_for(milliseconds(10));
  }
}

void Helper::drain() {
  constexpr int kMost = 1000;
  int pictures = 0;
  for (int i = 0; i < kMost; ++i) {
    CameraFilePath path{};
    int result = GP_OK;
    const CameraEventType type = wait(20, path, result);
    if (result < GP_OK) return say_error(result);
    if (type == GP_EVENT_TIMEOUT) break;
    pictures += type == GP_EVENT_FILE_ADDED;
  }
  say("ok " + std::to_string(pictures));
}

void Helper::trigger() {
  trouble_.clear();
  const int result = gp_camera_trigger_capture(camera_, context_);
  if (result >= GP_OK) return say("ok");
  // The camera's own answers that mean "no"; any other failure may have come after the shutter. Most of PTP's answers
  // (PIMA 15740, 11) come as one number and differ in their text alone, which no locale translates here.
  bool no = result == GP_ERROR_CAMERA_BUSY || result == GP_ERROR_NO_SPACE || result == GP_ERROR_NOT_SUPPORTED;
  for (const char* answer : {"Store Full", "Store Read Only", "Store Not Available", "Access Denied", "Device Busy"})
    no = no || trouble_.find(answer) != std::string::npos;
  const std::string why = gp_result_as_string(result);
  say((no ? "refused " : "doubt ") + word(trouble_.empty() ? why : why + " (" + trouble_ + ")"));
}

void Helper::event(int wait_ms) {
  CameraFilePath path{};
  int result = GP_OK;
  const CameraEventType type = wait(wait_ms, path, result);
  if (result < GP_OK) return say_error(result);
  if (type == GP_EVENT_CAPTURE_COMPLETE) return say("complete");
  if (type != GP_EVENT_FILE_ADDED) return say("nothing");
  CameraFileInfo info{};
  std::uint64_t size = 0;
  if (gp_camera_file_get_info(camera_, path.folder, path.name, &info, context_) >= GP_OK &&
      (info.file.fields & GP_FILE_INFO_SIZE))
    size = info.file.size;
  say("added " + std::to_string(size) + " " + word(path.folder) + " " + word(path.name));
}

int pass_on(void*, unsigned char* data, std::uint64_t* size) {
  for (std::uint64_t at = 0; at < *size;) {
    const std::size_t n = std::size_t(std::min<std::uint64_t>(*size - at, lumihull::capture::gphoto::kMaxChunk));
    say("data " + std::to_string(n));
    put(reinterpret_cast<const char*>(data) + at, n);
    at += n;
  }
  return GP_OK;
}

void Helper::get(const std::string& folder, const std::string& name) {
  CameraFileHandler handler{};
  handler.write = pass_on;
  CameraFile* file = nullptr;
  int result = gp_file_new_from_handler(&file, &handler, nullptr);
  if (result >= GP_OK)
    result = gp_camera_file_get(camera_, folder.c_str(), name.c_str(), GP_FILE_TYPE_NORMAL, file, context_);
  if (file) gp_file_unref(file);
  if (result < GP_OK) return say_error(result);
  say("ok");
}

void Helper::remove(const std::string& folder, const std::string& name) {
  const int result = gp_camera_file_delete(camera_, folder.c_str(), name.c_str(), context_);
  if (result < GP_OK) return say_error(result);
  say("ok");
}

void answer(Helper& helper, const std::vector<std::string>& w) {
  const std::string verb = w.empty() ? "" : w[0];
  if (verb == "cameras" && w.size() == 1) return helper.cameras();
  if (verb == "open" && w.size() == 3) return helper.open(w[1], w[2]);
  if (!helper.is_open()) return say("error " + word("no camera is open"));
  if (verb == "drain" && w.size() == 1) return helper.drain();
  if (verb == "trigger" && w.size() == 1) return helper.trigger();
  if (verb == "event" && w.size() == 2) return helper.event(std::atoi(w[1].c_str()));
  if (verb == "get" && w.size() == 3) return helper.get(w[1], w[2]);
  if (verb == "delete" && w.size() == 3) return helper.remove(w[1], w[2]);
  say("error " + word("no such request"));
}

}  // namespace

int main() {
  watch_parent();
  say(std::string(lumihull::capture::gphoto::kHello));
  Helper helper;
  std::string line;
  while (std::getline(std::cin, line)) {
    const auto w = lumihull::capture::gphoto::words(line);
    answer(helper, w ? *w : std::vector<std::string>{});
  }
  return 0;
}
