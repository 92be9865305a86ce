#pragma once

// What the verbs share: the job with its progress bar, Ctrl-C, --json, and flags made from a stage's options.

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/slf/pipeline.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::program {

/// One run of the program.
class Program {
 public:
  Program();

  CLI::App app;
  bool json = false;     ///< one JSON object on standard output, everything else on standard error
  bool quiet = false;    ///< no progress
  unsigned threads = 0;  ///< 0: one a core

  /// The job of this run: draws its progress, stops at Ctrl-C. Made at the first call, when the flags are known.
  Job& job();

  /// A verb: its body runs after all flags were parsed.
  /// Below another verb where `above` is given.
  CLI::App* verb(const std::string& name, const std::string& help, std::function<void()> body,
                 CLI::App* above = nullptr);

  /// A line for people: standard output, or standard error with --json.
  void say(const std::string& line);

  /// Parses and runs; returns the exit status: 0 done, 1 failed, 2 wrong use, 130 interrupted.
  int run(int argc, char** argv);

 private:
  void draw(const Progress& progress);
  void clear_bar();

  std::unique_ptr<Job> job_;
  std::function<void()> chosen_;
  bool bar_drawn_ = false;
  std::string last_stage_;
  double last_line_s_ = 0;
};

/// The flags of a stage's options, e.g. --max-samples for "max_samples". Where a flag was given, `store` puts it into
/// the capture; an omitted one leaves the stored value as it is.
class StageFlags {
 public:
  StageFlags(CLI::App* verb, std::vector<std::string_view> stages);
  void store(Capture& capture) const;

 private:
  struct Flag {
    std::string_view stage;
    std::string name, text;
    CLI::Option* option;
  };
  std::vector<std::unique_ptr<Flag>> flags_;
};

/// A verb that does one stage, or all that are needed where `stage` is "run": CAPTURE, --force, --hold-out and the
/// stages' own options; says what came of each stage. With --json it prints what the stages took, or, where `json` is
/// given, what that returns.
void add_stage_verb(Program& program, const std::string& stage, const std::string& help,
                    std::function<std::string(const Capture&)> json = {});

/// Makes a folder for drawings and names them FOLDER/NAME.png after the photographs, with a number behind where names
/// come twice. Errors: invalid_argument (a drawing would replace a photograph), io.
std::vector<std::string> drawing_names(const std::string& folder, const std::vector<std::string>& photos);

std::string json_text(const std::string& s);  ///< s as a JSON string, with its quotes

// One function a verb, each in the file of its name.
void add_import(Program& program);
void add_export(Program& program);
void add_calibrate(Program& program);
void add_capture(Program& program);
void add_key(Program& program);
void add_hull(Program& program);
void add_texture(Program& program);
void add_lightfield(Program& program);
void add_render(Program& program);
void add_evaluate(Program& program);
void add_run(Program& program);
void add_info(Program& program);
void add_intrinsics(Program& program);
void add_targets(Program& program);
void add_detect(Program& program);
void add_ingest(Program& program);
void add_plan(Program& program);
void add_experiments(Program& program);  // repeatability, stability
void add_simulate(Program& program);
void add_demo(Program& program);

}  // namespace lumihull::program
