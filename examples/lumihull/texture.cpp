// lumihull texture CAPTURE: the hull with its mean colour.

#include "program.h"

namespace lumihull::program {

void add_texture(Program& program) {
  add_stage_verb(program, "texture", "give the hull the photographs' mean colour: textured.glb");
}

}  // namespace lumihull::program
