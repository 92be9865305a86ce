#include "program.h"

#include <lumihull/base/error.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <set>

namespace lumihull::program {

namespace {

std::atomic<Job*> interrupted_job{nullptr};

/// The first Ctrl-C (or kill) asks the job to stop, the second one ends the program at once.
void on_signal(int number) {
  if (Job* job = interrupted_job.load()) job->cancel();
  std::signal(number, SIG_DFL);
}

std::string duration(double seconds) {
  char text[32];
  const int s = int(seconds + 0.5);
  if (s < 60)
    std::snprintf(text, sizeof text, "%d s", s);
  else if (s < 3600)
    std::snprintf(text, sizeof text, "%d:%02d min", s / 60, s % 60);
  else
    std::snprintf(text, sizeof text, "%d:%02d h", s / 3600, s / 60 % 60);
  return text;
}

std::string flag_name(const std::string& option) {
  std::string name = "--" + option;
  std::replace(name.begin() + 2, name.end(), '_', '-');
  return name;
}

std::string shown(const OptionValue& value) {
  const std::string text = slf::option_text(value);
  return text.empty() ? "none" : text;
}

}  // namespace

Program::Program() : app("Photographs of an object in, a model to look at out.", "lumihull") {
  app.require_subcommand(1);
  app.set_version_flag("--version", LUMIHULL_VERSION);
  app.fallthrough();
  app.add_flag("--json", json, "one JSON object on standard output; progress on standard error");
  app.add_flag("-q,--quiet", quiet, "no progress");
  app.add_option("--threads", threads, "threads to use; 0 = one a core")->check(CLI::Range(0u, 1024u));
  app.footer("Each verb has its own --help. Exit status: 0 done, 1 failed, 2 wrong use, 130 interrupted.");
}

Job& Program::job() {
  if (!job_) {
    job_ = std::make_unique<Job>(
        [this](const Progress& progress) {
          if (!quiet) draw(progress);
        },
        threads);
    interrupted_job = job_.get();
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
  }
  return *job_;
}

CLI::App* Program::verb(const std::string& name, const std::string& help, std::function<void()> body, CLI::App* above) {
  CLI::App* verb = (above ? above : &app)->add_subcommand(name, help);
  verb->callback([this, body = std::move(body)] { chosen_ = body; });
  return verb;
}

void Program::say(const std::string& line) {
  clear_bar();
  (json ? std::cerr : std::cout) << line << std::endl;
}

void Program::clear_bar() {
  if (bar_drawn_) std::cerr << "\r\033[K" << std::flush;
  bar_drawn_ = false;
}

void Program::draw(const Progress& p) {
  const double share = p.total ? double(p.done) / double(p.total) : 0;
  const std::string eta = p.done == p.total ? duration(p.elapsed_s)
                          : p.eta_s >= 0    ? "about " + duration(p.eta_s) + " to go"
                                            : "…";
  if (isatty(STDERR_FILENO)) {
    winsize window{};
    const int columns = ioctl(STDERR_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col ? window.ws_col : 80;
    const int width = std::clamp(columns - 60, 10, 40);
    const int full = int(share * width);
    std::string bar;
    for (int i = 0; i < width; ++i) bar += i < full ? "█" : "░";
    std::fprintf(stderr, "\r\033[K%-24.24s %s %3d %%  %s", p.stage.c_str(), bar.c_str(), int(100 * share), eta.c_str());
    std::fflush(stderr);
    bar_drawn_ = p.done != p.total;
    if (!bar_drawn_) std::fprintf(stderr, "\r\033[K");
    return;
  }
  // Elsewhere plain lines: at the beginning and end of each stage and every ten seconds.
  const bool edge = p.stage != last_stage_ || p.done == p.total;
  if (!edge && p.elapsed_s - last_line_s_ < 10) return;
  if (edge && p.done == p.total && p.stage == last_stage_ && last_line_s_ < 0) return;
  last_stage_ = p.stage;
  last_line_s_ = p.done == p.total ? -1 : p.elapsed_s;
  std::fprintf(stderr, "%s: %llu of %llu, %s\n", p.stage.c_str(), static_cast<unsigned long long>(p.done),
               static_cast<unsigned long long>(p.total), eta.c_str());
}

int Program::run(int argc, char** argv) {
  add_import(*this);
  add_calibrate(*this);
  add_capture(*this);
  add_key(*this);
  add_hull(*this);
  add_texture(*this);
  add_lightfield(*this);
  add_render(*this);
  add_evaluate(*this);
  add_run(*this);
  add_export(*this);
  add_info(*this);
  add_intrinsics(*this);
  add_targets(*this);
  add_detect(*this);
  add_ingest(*this);
  add_plan(*this);
  add_experiments(*this);
  add_simulate(*this);
  add_demo(*this);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e, std::cout, std::cerr) == 0 ? 0 : 2;
  }
  try {
    chosen_();
    clear_bar();
    std::cout.flush();
    if (!std::cout) throw Error(ErrorCode::io, "standard output could not be written");
    return 0;
  } catch (const Error& e) {
    clear_bar();
    if (e.code() == ErrorCode::cancelled) {
      std::cerr << "lumihull: interrupted; the same command goes on from here\n";
      return 130;
    }
    std::cerr << "lumihull: " << e.what() << "\n";
    return e.code() == ErrorCode::invalid_argument ? 2 : 1;
  } catch (const std::filesystem::filesystem_error& e) {
    clear_bar();
    std::cerr << "lumihull: " << e.path1().string() << ": " << e.code().message() << "\n";
    return 1;
  } catch (const std::bad_alloc&) {
    clear_bar();
    std::cerr << "lumihull: out of memory\n";
    return 1;
  } catch (const std::exception& e) {
    clear_bar();
    std::cerr << "lumihull: defect: " << e.what() << "\n";
    return 1;
  }
}

StageFlags::StageFlags(CLI::App* verb, std::vector<std::string_view> stages) {
  for (const std::string_view stage : stages)
    for (const slf::OptionSpec& spec : slf::stage_options(stage)) {
      // `run` takes the flags of all stages: where two share a name, one flag sets both.
      const auto same = std::find_if(flags_.begin(), flags_.end(), [&](const auto& f) { return f->name == spec.name; });
      auto flag = std::make_unique<Flag>(Flag{stage, spec.name, {}, nullptr});
      if (same != flags_.end()) {
        flag->option = (*same)->option;
        flags_.push_back(std::move(flag));
        continue;
      }
      std::string help = spec.help + " [" + shown(spec.fallback) + "]";
      flag->option = verb->add_option(flag_name(spec.name), flag->text, help);
      if (std::holds_alternative<bool>(spec.fallback)) flag->option->expected(0, 1)->default_str("true");
      if (spec.several) flag->option->take_all();
      if (!spec.choices.empty()) {
        std::string choices;
        for (const std::string& c : spec.choices) choices += (choices.empty() ? "" : "|") + c;
        if (spec.path) choices += "|PATH";
        flag->option->type_name(choices);
      } else {
        constexpr const char* kTypes[] = {"[true|false]", "INTEGER", "NUMBER", "TEXT", "NUMBER,…"};
        flag->option->type_name(spec.word ? "WORD|FILE" : spec.path ? "PATH" : kTypes[spec.fallback.index()]);
      }
      flags_.push_back(std::move(flag));
    }
}

void StageFlags::store(Capture& capture) const {
  for (const auto& flag : flags_) {
    if (flag->option->count() == 0) continue;
    std::string text = flag->option->results().empty() ? "true" : flag->option->results().front();
    for (std::size_t i = 1; i < flag->option->results().size(); ++i) text += ";" + flag->option->results()[i];
    slf::set_option_text(capture, flag->stage, flag->name, text.empty() || text == "{}" ? "true" : text);
  }
}

namespace {

void say_result(Program& program, const slf::StageResult& result) {
  char line[160];
  if (result.skipped && result.record.finished.empty())
    std::snprintf(line, sizeof line, "%-10s -", result.stage.c_str());
  else if (result.skipped)
    std::snprintf(line, sizeof line, "%-10s nothing has changed since %s", result.stage.c_str(),
                  result.record.finished.c_str());
  else
    std::snprintf(line, sizeof line, "%-10s %s, at most %.0f MB", result.stage.c_str(),
                  duration(result.record.seconds).c_str(), double(result.record.peak_bytes) / 1e6);
  program.say(line);
  for (const std::string& said : result.said) program.say("           " + said);
}

std::string results_json(const std::vector<slf::StageResult>& results) {
  std::string text = "{\"stages\": {";
  for (const slf::StageResult& result : results) {
    text += std::string(&result == results.data() ? "" : ", ") + json_text(result.stage) +
            ": {\"skipped\": " + (result.skipped ? "true" : "false") +
            ", \"seconds\": " + std::to_string(result.record.seconds) +
            ", \"peak_bytes\": " + std::to_string(result.record.peak_bytes) + ", \"said\": [";
    for (std::size_t i = 0; i < result.said.size(); ++i) text += (i ? ", " : "") + json_text(result.said[i]);
    text += "]}";
  }
  return text + "}}";
}

}  // namespace

void add_stage_verb(Program& program, const std::string& stage, const std::string& help,
                    std::function<std::string(const Capture&)> json) {
  struct Arguments {
    std::string folder;
    bool force = false;
    std::unique_ptr<StageFlags> options;
    int hold_out = 0;
    CLI::Option* hold_out_given = nullptr;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.verb(stage, help, [&program, stage, a, json] {
    Capture capture = Capture::open(a->folder);
    a->options->store(capture);
    if (a->hold_out_given->count()) capture.set_hold_out(a->hold_out);
    std::vector<slf::StageResult> results;
    if (stage == "run")
      results = slf::run(capture, program.job(), a->force,
                         [&](const slf::StageResult& result) { say_result(program, result); });
    else
      say_result(program, results.emplace_back(slf::run_stage(capture, stage, program.job(), a->force)));
    if (stage == "run") program.say("report    " + (capture.folder() / "report.html").string());
    if (program.json) std::cout << (json ? json(capture) : results_json(results) + "\n");
  });
  verb->add_option("capture", a->folder, "folder of the capture")->required();
  verb->add_flag("--force", a->force, "do it even if nothing has changed");
  a->hold_out_given = verb->add_option("--hold-out", a->hold_out,
                                       "keep every Nth photograph (the first, the N+1st, …) out of training, hull and "
                                       "appearance; 0 = none");
  const auto all = slf::stage_names();
  a->options = std::make_unique<StageFlags>(
      verb, stage == "run" ? std::vector<std::string_view>(all.begin(), all.end())
                           : std::vector<std::string_view>{*std::find(all.begin(), all.end(), stage)});
}

std::vector<std::string> drawing_names(const std::string& folder, const std::vector<std::string>& photos) {
  namespace fs = std::filesystem;
  fs::create_directories(folder);
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const std::string& photo : photos) {
    const std::string stem = fs::path(photo).stem().string();
    std::string name = stem + ".png";
    for (int i = 2; !taken.insert(name).second; ++i) name = stem + "-" + std::to_string(i) + ".png";
    names.push_back((fs::path(folder) / name).string());
  }
  for (const std::string& name : names)
    for (const std::string& photo : photos)
      if (fs::exists(name) && fs::exists(photo) && fs::equivalent(name, photo))
        throw Error(ErrorCode::invalid_argument, "the drawing would replace the photograph; name another folder",
                    photo);
  return names;
}

std::string json_text(const std::string& s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", c);
      out += code;
    } else {
      out += c;
    }
  }
  return out + "\"";
}

}  // namespace lumihull::program
