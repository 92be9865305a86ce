// lumihull info CAPTURE: what is in a capture.

#include <iostream>

#include "program.h"

namespace lumihull::program {

void add_info(Program& program) {
  const auto folder = std::make_shared<std::string>();
  CLI::App* verb = program.verb("info", "what is in a capture, as JSON",
                                [folder] { std::cout << slf::describe_json(Capture::open(*folder)) << "\n"; });
  verb->add_option("capture", *folder, "folder of the capture")->required();
}

}  // namespace lumihull::program
