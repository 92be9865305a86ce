// lumihull evaluate CAPTURE: renders the photographs that were held out and compares.

#include <lumihull/base/files.h>

#include "program.h"

namespace lumihull::program {

void add_evaluate(Program& program) {
  add_stage_verb(program, "evaluate", "render the held-out photographs and compare: PSNR, SSIM, silhouettes",
                 [](const Capture& capture) { return read_file(capture.folder() / "evaluate" / "evaluation.json"); });
}

}  // namespace lumihull::program
