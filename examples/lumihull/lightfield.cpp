// lumihull lightfield CAPTURE: the surface light field, factored, in one file.

#include "program.h"

namespace lumihull::program {

void add_lightfield(Program& program) {
  add_stage_verb(program, "lightfield", "factor the object's appearance over all directions: light_field.glb");
}

}  // namespace lumihull::program
