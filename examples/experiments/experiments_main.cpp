// lumihull-experiments: the paper's experiments on the virtual rig.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>

#include "experiment.h"
#include "model.h"

namespace ex = lumihull::experiments;
namespace fs = std::filesystem;

namespace {

lumihull::Job* running = nullptr;

void stop(int) {
  if (running) running->cancel();
}

std::vector<ex::Experiment> all() {
  std::vector<ex::Experiment> list;
  list.push_back({"repeatability", "how well the robot comes back (section 5.2, figure 9)", ex::measure_repeatability});
  list.push_back({"stability", "how long it swings (section 5.1, figure 8)", ex::measure_stability});
  for (ex::Experiment& e : ex::object_experiments()) list.push_back(std::move(e));
  list.push_back({"gloss", "a glossy object: its highlight in new views", ex::measure_gloss});
  list.push_back({"bleeding", "the enclosure's colour on the object, with and without despill", ex::measure_bleeding});
  list.push_back({"elastic", "cables that stretch, in a room for an object of 12 m (section 6)", ex::measure_elastic});
  list.push_back({"large", "an object of 12 m (section 6)", ex::measure_large});
  return list;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The paper's experiments on the virtual rig. An experiment that is done is not done again.");
  std::string folder;
  std::vector<std::string> only;
  ex::Size size;
  unsigned threads = 0;
  const std::vector<ex::Experiment> list = all();
  std::string names;
  for (const ex::Experiment& e : list) names += "\n  " + e.name + ": " + e.what;
  app.add_option("folder", folder, "for captures, pictures and results.json")->required();
  app.add_option("--only", only, "experiments to do:" + names)->delimiter(',');
  app.add_flag("--full", size.full, "the paper's numbers of photographs, 6.3 megapixels each: hours");
  app.add_option("--threads", threads, "0: one for each core")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  for (const std::string& name : only)
    if (std::none_of(list.begin(), list.end(), [&](const auto& e) { return e.name == name; })) {
      std::fprintf(stderr, "lumihull-experiments: there is no experiment \"%s\"\n", name.c_str());
      return 2;
    }

  lumihull::Job job(
      [](const lumihull::Progress& p) {
        static std::string ended;
        if (p.done == p.total && p.stage != ended)
          std::fprintf(stderr, "    %-32s %.1f s\n", p.stage.c_str(), p.elapsed_s);
        ended = p.done == p.total ? p.stage : "";
      },
      threads);
  running = &job;
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  int status = 0;
  ex::Json results{{"size", size.name()}};
  for (const ex::Experiment& e : list) {
    const fs::path at = fs::path(folder) / size.name() / e.name, file = at / "result.json";
    const bool wanted = only.empty() || std::find(only.begin(), only.end(), e.name) != only.end();
    try {
      if (wanted && !fs::exists(file)) {
        std::fprintf(stderr, "%s: %s\n", e.name.c_str(), e.what.c_str());
        fs::create_directories(at);
        const ex::Stopwatch watch;
        ex::Json result = e.run(at, size, job);
        result["seconds"] = watch.seconds();
        lumihull::write_file(file, result.dump(1) + "\n");
      }
      const fs::path picture = at / "overview.jpg";
      if (wanted && !fs::exists(picture) && fs::exists(at / "capture" / "light_field.glb")) {
        const lumihull::Image strip = ex::overview(lumihull::Capture::open(at / "capture"), job);
        if (!strip.empty()) lumihull::write_jpeg(picture, strip, 80);
      }
      if (fs::exists(file)) results[e.name] = ex::Json::parse(lumihull::read_file(file));
    } catch (const std::exception& error) {
      std::fprintf(stderr, "lumihull-experiments: %s: %s\n", e.name.c_str(), error.what());
      status = 1;
      if (job.cancelled()) return 130;  // the same command goes on from here
    }
  }
  const fs::path file = fs::path(folder) / size.name() / "results.json";
  lumihull::write_file(file, results.dump(1) + "\n");
  std::printf("%s\n", file.string().c_str());
  return status;
}
