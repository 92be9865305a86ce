// lumihull hull CAPTURE: the visual hull as a mesh.

#include "program.h"

namespace lumihull::program {

void add_hull(Program& program) {
  add_stage_verb(program, "hull", "carve the visual hull from the silhouettes: hull.ply");
}

}  // namespace lumihull::program
