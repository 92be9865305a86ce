#include <lumihull/base/error.h>
#include <lumihull/capture/operator.h>

namespace lumihull::capture {

Operator::~Operator() = default;

std::string AbsentOperator::ask(const Question& question, Job&) {
  if (question.about == Question::About::motion && agree_to_motion_) return question.choices.front();
  throw Error(ErrorCode::invalid_argument, "an operator must answer, and nobody is there: " + question.text,
              "operator");
}

}  // namespace lumihull::capture
