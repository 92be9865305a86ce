#include <lumihull/base/error.h>
#include <lumihull/base/files.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <utility>

#include "stage.h"

namespace lumihull::slf {

namespace {

using Definition = const StageDefinition& (*)();
constexpr std::array<std::string_view, 7> kNames{"calibrate",  "key",      "hull",  "texture",
                                                 "lightfield", "evaluate", "report"};
constexpr std::array<Definition, 7> kDefinitions{calibrate_stage,  key_stage,      hull_stage,  texture_stage,
                                                 lightfield_stage, evaluate_stage, report_stage};

const StageDefinition& definition(std::string_view stage) {
  for (const Definition d : kDefinitions)
    if (d().name == stage) return d();
  throw Error(ErrorCode::invalid_argument,
              "expected one of calibrate, key, hull, texture, lightfield, evaluate, report", std::string(stage));
}

const OptionSpec& specification(std::string_view stage, std::string_view name) {
  std::string known;
  for (const OptionSpec& spec : definition(stage).options) {
    if (spec.name == name) return spec;
    known += (known.empty() ? "" : ", ") + spec.name;
  }
  throw Error(ErrorCode::invalid_argument,
              "no such option of stage " + std::string(stage) + "; it has " + (known.empty() ? "none" : known),
              std::string(name));
}

std::string number_text(double x) {
  if (x == std::floor(x) && std::abs(x) < 1e15) return std::to_string(std::int64_t(x));  // to_chars: 1e+06
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), x).ptr};
}

std::string expectation(const OptionSpec& spec) {
  constexpr std::array<const char*, 5> kKinds{"true or false", "an integer", "a number", "a text",
                                              "numbers, by commas"};
  std::string text = kKinds[spec.fallback.index()];
  if (!spec.choices.empty()) {
    text = "one of";
    for (const std::string& choice : spec.choices) text += (&choice == spec.choices.data() ? " " : ", ") + choice;
  }
  if (spec.path) text = spec.word ? "a word or a path" : spec.choices.empty() ? "a path" : text + ", or a path";
  constexpr double kMax = std::numeric_limits<double>::max();
  if (spec.low > -kMax && spec.high < kMax)
    text += " from " + number_text(spec.low) + " to " + number_text(spec.high);
  else if (spec.low > -kMax)
    text += " of at least " + number_text(spec.low);
  return text;
}

bool is_choice(const OptionSpec& spec, const std::string& value) {
  return std::find(spec.choices.begin(), spec.choices.end(), value) != spec.choices.end();
}

/// As TargetSet::from_text tells words from files.
bool is_word(const std::string& text) {
  std::error_code error;
  return !text.ends_with(".json") && !std::filesystem::exists(text, error);
}

/// The value as the option's own type. Error{invalid_argument} where it does not fit.
OptionValue checked(const OptionSpec& spec, OptionValue value) {
  const auto fail = [&] { throw Error(ErrorCode::invalid_argument, "expected " + expectation(spec), spec.name); };
  if (std::holds_alternative<double>(spec.fallback) && std::holds_alternative<std::int64_t>(value))
    value = double(std::get<std::int64_t>(value));
  if (value.index() != spec.fallback.index()) fail();
  const auto in_range = [&](double x) { return std::isfinite(x) && x >= spec.low && x <= spec.high; };
  if (const auto* i = std::get_if<std::int64_t>(&value); i && !in_range(double(*i))) fail();
  if (const auto* x = std::get_if<double>(&value); x && !in_range(*x)) fail();
  if (const auto* list = std::get_if<std::vector<double>>(&value))
    for (const double x : *list)
      if (!in_range(x)) fail();
  if (const auto* s = std::get_if<std::string>(&value);
      s && !spec.choices.empty() && !spec.path && !is_choice(spec, *s))
    fail();
  return value;
}

double parse_number(const OptionSpec& spec, std::string_view text) {
  double x = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
  if (error != std::errc() || end != text.data() + text.size())
    throw Error(ErrorCode::invalid_argument, "expected " + expectation(spec) + ", found \"" + std::string(text) + "\"",
                spec.name);
  return x;
}

std::string digest_of(const Capture& capture, const StageDefinition& stage) {
  InputDigest digest;
  digest.add("stage", std::string(stage.name) + " " + std::to_string(stage.version));
  for (const OptionSpec& spec : stage.options)
    digest.add(spec.name, option_text(effective_option(capture, stage.name, spec.name)));
  stage.inputs(capture, digest);
  return digest.hex();
}

std::string now_utc() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&now, &parts);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

}  // namespace

std::span<const std::string_view> stage_names() { return kNames; }

std::span<const OptionSpec> stage_options(std::string_view stage) { return definition(stage).options; }

void set_option(Capture& capture, std::string_view stage, std::string_view name, OptionValue value) {
  const OptionSpec& spec = specification(stage, name);
  value = checked(spec, std::move(value));
  // The next command may run in another folder.
  if (auto* s = std::get_if<std::string>(&value);
      s && spec.path && !s->empty() && !is_choice(spec, *s) && !(spec.word && is_word(*s)))
    *s = std::filesystem::absolute(*s).lexically_normal().string();
  capture.options[std::string(stage)][spec.name] = std::move(value);
}

void set_option_text(Capture& capture, std::string_view stage, std::string_view name, std::string_view text) {
  const OptionSpec& spec = specification(stage, name);
  if (text == "default") {
    if (const auto stored = capture.options.find(stage); stored != capture.options.end())
      stored->second.erase(spec.name);
    return;
  }
  OptionValue value = std::string(text);
  if (std::holds_alternative<bool>(spec.fallback)) {
    if (text != "true" && text != "false" && text != "1" && text != "0")
      throw Error(ErrorCode::invalid_argument, "expected true or false, found \"" + std::string(text) + "\"",
                  spec.name);
    value = text == "true" || text == "1";
  } else if (std::holds_alternative<std::int64_t>(spec.fallback)) {
    const double x = parse_number(spec, text);
    if (x != std::floor(x) || std::abs(x) > 9e15)
      throw Error(ErrorCode::invalid_argument,
                  "expected " + expectation(spec) + ", found \"" + std::string(text) + "\"", spec.name);
    value = std::int64_t(x);
  } else if (std::holds_alternative<double>(spec.fallback)) {
    value = parse_number(spec, text);
  } else if (std::holds_alternative<std::vector<double>>(spec.fallback)) {
    std::vector<double> list;
    while (!text.empty()) {
      const std::size_t comma = std::min(text.find(','), text.size());
      list.push_back(parse_number(spec, text.substr(0, comma)));
      text.remove_prefix(std::min(comma + 1, text.size()));
    }
    value = std::move(list);
  }
  set_option(capture, stage, name, std::move(value));
}

std::string option_text(const OptionValue& value) {
  struct Visitor {
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(std::int64_t v) const { return std::to_string(v); }
    std::string operator()(double v) const { return number_text(v); }
    std::string operator()(const std::string& v) const { return v; }
    std::string operator()(const std::vector<double>& v) const {
      std::string text;
      for (const double x : v) text += (text.empty() ? "" : ",") + number_text(x);
      return text;
    }
  };
  return std::visit(Visitor{}, value);
}

OptionValue effective_option(const Capture& capture, std::string_view stage, std::string_view name) {
  const OptionSpec& spec = specification(stage, name);
  const auto values = capture.options.find(stage);
  if (values == capture.options.end()) return spec.fallback;
  const auto value = values->second.find(name);
  if (value == values->second.end()) return spec.fallback;
  try {
    return checked(spec, value->second);
  } catch (const Error& e) {  // stored by hand or by another version: then it is the file that is wrong
    throw Error(ErrorCode::bad_input, "at /options/" + std::string(stage) + "/" + spec.name + ": " + e.message(),
                (capture.folder() / "capture.json").string());
  }
}

StageResult run_stage(Capture& capture, std::string_view name, Job& job, bool force) {
  const StageDefinition& stage = definition(name);
  StageResult result;
  result.stage = stage.name;
  capture.refresh_stamps(job);
  const std::string digest = digest_of(capture, stage);
  const auto last = capture.stages.find(name);
  if (!force && last != capture.stages.end() && last->second.digest == digest && stage.present(capture)) {
    result.skipped = true;
    result.record = last->second;
    capture.save();  // flags that were given are kept even where they change nothing
    return result;
  }

  reset_peak_memory();
  const auto start = std::chrono::steady_clock::now();
  result.said = stage.run(capture, job);
  result.record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.record.peak_bytes = peak_memory_bytes();
  result.record.finished = now_utc();
  // A stage may add to what it depends on (keying keeps masks that were drawn meanwhile): the digest is that of now.
  result.record.digest = digest_of(capture, stage);
  capture.stages[std::string(name)] = result.record;
  capture.save();
  return result;
}

std::vector<StageResult> run(Capture& capture, Job& job, bool force,
                             const std::function<void(const StageResult&)>& ended) {
  std::vector<StageResult> results;
  for (const Definition d : kDefinitions) {
    const StageDefinition& stage = d();
    std::string why;
    if (stage.needed(capture, why)) {
      results.push_back(run_stage(capture, stage.name, job, force));
    } else {
      StageResult left_out;
      left_out.stage = stage.name;
      left_out.skipped = true;
      left_out.said.push_back("left out: " + why);
      results.push_back(std::move(left_out));
    }
    if (ended) ended(results.back());
  }
  return results;
}

}  // namespace lumihull::slf
