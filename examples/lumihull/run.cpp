// lumihull run CAPTURE: every stage that exists and is needed.

#include "program.h"

namespace lumihull::program {

void add_run(Program& program) {
  add_stage_verb(program, "run", "all the stages that are needed: calibrate, key, hull, texture, lightfield, evaluate, report");
}

}  // namespace lumihull::program
