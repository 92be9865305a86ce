// lumihull key CAPTURE: silhouettes of the photographs.

#include "program.h"

namespace lumihull::program {

void add_key(Program& program) {
  add_stage_verb(program, "key", "cut the object out of its coloured enclosure: masks/");
}

}  // namespace lumihull::program
