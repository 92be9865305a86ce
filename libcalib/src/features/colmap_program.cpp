// COLMAP's program: its commands, what it says of its progress, its models.
#include "colmap_program.h"

#include <lumihull/base/error.h>
#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/internal/child_process.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <sstream>

namespace lumihull::calib {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLastWords = 6;

/// The number behind `word`, as in "Registering image #7 (12)": 12 behind " (".
std::optional<std::uint64_t> number_behind(const std::string& line, std::string_view word) {
  const std::size_t at = line.find(word);
  if (at == std::string::npos) return std::nullopt;
  char* end = nullptr;
  const char* start = line.c_str() + at + word.size();
  const unsigned long long value = std::strtoull(start, &end, 10);
  if (end == start) return std::nullopt;
  return value;
}

/// "MODEL" and "p1,p2,…" of a camera in COLMAP's words.
std::pair<std::string, std::string> words_of(const Camera& camera) {
  std::istringstream lines(colmap_camera(camera).text);
  std::string line, id, model, width, height, parameters;
  while (std::getline(lines, line) && (line.empty() || line[0] == '#')) {
  }
  std::istringstream words(line);
  words >> id >> model >> width >> height;
  for (std::string word; words >> word;) parameters += (parameters.empty() ? "" : ",") + word;
  return {model, parameters};
}

/// One command, its output into the log. counted: the number of things done so far that a line tells, if it does.
/// forgiven: a failure with these words among its last is none.
class Step {
 public:
  Step(const ColmapRun& run, Job& job, std::ofstream& log) : run_(run), job_(job), log_(log) {}

  void operator()(const std::string& stage, std::uint64_t total, std::vector<std::string> command,
                  const std::function<std::optional<std::uint64_t>(const std::string&)>& counted,
                  std::string_view forgiven = {}) const {
    command.insert(command.begin(), run_.program);
    std::deque<std::string> last;
    std::uint64_t done = 0;
    job_.begin(stage, total);
    int status = 0;
    try {
      status = internal::run_child(command, job_, [&](const std::string& line) {
        log_ << line << "\n";
        if (line.find_first_not_of(" \t\r=") == std::string::npos) return;
        last.push_back(line);
        if (last.size() > kLastWords) last.pop_front();
        if (const auto now = counted(line); now && *now > done && *now <= total) {
          job_.advance(*now - done);
          done = *now;
        }
      });
    } catch (const Error& e) {
      if (e.code() != ErrorCode::not_found) throw;
      throw Error(ErrorCode::not_found,
                  "poses from features are found by the program COLMAP, which is not installed (Debian's package "
                  "colmap); photographs of printed targets need no other program: see `lumihull targets`",
                  run_.program);
    }
    std::string words;
    for (const std::string& line : last) words += (words.empty() ? "" : " | ") + line;
    if (status != 0 && (forgiven.empty() || words.find(forgiven) == std::string::npos)) {
      throw Error(ErrorCode::io,
                  "COLMAP's " + command[1] + " failed with status " + std::to_string(status) + ": " + words +
                      "; all of its words are in " + (run_.work / "colmap.log").string(),
                  run_.program);
    }
    job_.end();
  }

 private:
  const ColmapRun& run_;
  Job& job_;
  std::ofstream& log_;
};

/// How many images a binary model has: the count that images.bin begins with.
std::uint64_t image_count(const fs::path& model) {
  std::ifstream file(model / "images.bin", std::ios::binary);
  std::uint64_t n = 0;
  file.read(reinterpret_cast<char*>(&n), sizeof n);
  return file ? n : 0;
}

}  // namespace

fs::path ColmapRun::model(Job& job) const {
  ::setenv("QT_QPA_PLATFORM", "offscreen", 0);  // its commands open no window, but link what wants a display
  std::ofstream log(work / "colmap.log");
  const Step step(*this, job, log);
  const std::string database = (work / "database.db").string(), threads = std::to_string(job.threads());
  const fs::path models = work / "models";
  fs::create_directories(models);

  std::vector<std::string> extract{"feature_extractor",
                                   "--database_path",
                                   database,
                                   "--image_path",
                                   photos.string(),
                                   "--ImageReader.single_camera_per_folder",
                                   "1",
                                   "--SiftExtraction.use_gpu",
                                   "0",
                                   "--SiftExtraction.num_threads",
                                   threads};
  if (known_camera) {
    const auto [name, parameters] = words_of(*known_camera);
    extract.insert(extract.end(), {"--ImageReader.camera_model", name, "--ImageReader.camera_params", parameters});
  }
  if (std::error_code ignored; !fs::exists(mark(), ignored)) {
    step("finding features", photo_count, extract,
         [](const std::string& line) { return number_behind(line, "Processed file ["); });
    write_file(mark(), inputs);
  }

  std::uint64_t blocks = 0;
  step("matching features", photo_count,
       {sequential ? "sequential_matcher" : "exhaustive_matcher", "--database_path", database, "--SiftMatching.use_gpu",
        "0", "--SiftMatching.num_threads", threads},
       [&](const std::string& line) -> std::optional<std::uint64_t> {
         if (sequential) return number_behind(line, "Matching image [");
         // "Matching block [2/3, 1/3] in 0.5s": blocks in a square, counted as they end.
         const std::size_t slash = line.find('/'), comma = line.find(", ");
         if (line.find("Matching block [") == std::string::npos || slash == std::string::npos ||
             comma == std::string::npos)
           return std::nullopt;
         const std::uint64_t side = std::max<std::uint64_t>(1, std::strtoull(line.c_str() + slash + 1, nullptr, 10));
         return photo_count * ++blocks / (side * side);
       });

  std::vector<std::string> map{"mapper",        "--database_path",      database,
                               "--image_path",  photos.string(),        "--output_path",
                               models.string(), "--Mapper.num_threads", threads};
  if (known_camera)
    for (const char* flag : {"--Mapper.ba_refine_focal_length", "--Mapper.ba_refine_extra_params"})
      map.insert(map.end(), {flag, "0"});
  step(
      "placing photographs", photo_count, map,
      [](const std::string& line) -> std::optional<std::uint64_t> {
        return line.find("Registering image #") == std::string::npos ? std::nullopt : number_behind(line, " (");
      },
      "failed to create sparse model");

  fs::path best;
  std::uint64_t most = 0;
  for (const auto& entry : fs::directory_iterator(models))
    if (const std::uint64_t n = image_count(entry.path()); n > most) most = n, best = entry.path();
  if (most < 2)
    throw Error(ErrorCode::degenerate,
                "COLMAP found no two photographs that show enough of the same: too plain or shiny, too far from "
                "one another, or without parallax; its words are in " +
                    (work / "colmap.log").string() +
                    ". Printed targets beside the object help: see `lumihull targets`");
  return best;
}

}  // namespace lumihull::calib
