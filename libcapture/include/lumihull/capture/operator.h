#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>

#include <cstdint>
#include <string>
#include <vector>

namespace lumihull::capture {

/// What only a person can tell, or must agree to.
struct Question {
  enum class About : std::uint8_t {
    motion,    ///< the robot would start to move: "move" or "stop"
    position,  ///< where the platform is: a stop's name, or "stop"
    doubt,     ///< what became of a shot: "again", "taken" or "stop"
    task,      ///< something to do by hand, e.g. "turn the table to 130°"
  };
  About about = About::task;
  std::string text;
  std::vector<std::string> choices;  ///< one of them is the answer; "stop" ends the session
};

/// Who is asked. A callback: a terminal, a window, a test's script.
class LUMIHULL_API Operator {
 public:
  virtual ~Operator();
  /// Returns one of question.choices. Errors: cancelled (job); invalid_argument where nobody is there to answer.
  virtual std::string ask(const Question& question, Job& job) = 0;
  /// Something to know that needs no answer.
  virtual void tell(const std::string& line) = 0;
};

/// Nobody is there: each question is Error{invalid_argument} that repeats it. With `agree_to_motion` the robot may
/// start by itself where it knows its position; doubts are never decided.
class LUMIHULL_API AbsentOperator : public Operator {
 public:
  explicit AbsentOperator(bool agree_to_motion = false) : agree_to_motion_(agree_to_motion) {}
  std::string ask(const Question& question, Job& job) override;
  void tell(const std::string&) override {}

 private:
  bool agree_to_motion_;
};

}  // namespace lumihull::capture
