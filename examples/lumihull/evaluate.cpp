// lumihull evaluate CAPTURE: renders the photographs that were held out and compares.

#include <lumihull/slf/results.h>

#include "program.h"

namespace lumihull::program {

void add_evaluate(Program& program) {
  add_stage_verb(program, "evaluate", "render the held-out photographs and compare: PSNR, SSIM, silhouettes",
                 [](const Capture& capture) { return slf::read_evaluation(capture); });
}

}  // namespace lumihull::program
