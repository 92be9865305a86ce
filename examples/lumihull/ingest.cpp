// lumihull ingest FOLDER CARD: pictures that stayed on a memory card, to the shots of a capture's journal.

#include <lumihull/base/error.h>
#include <lumihull/capture/land_card.h>

#include <iostream>

#include "program.h"

namespace lumihull::program {

namespace {

struct Arguments {
  std::string folder, card;
  double clock_offset_s = 0;
  CLI::Option* clock_known = nullptr;
  capture::LandOptions options;
};

void run(Program& program, Arguments& a) {
  if (a.clock_known->count() > 0) a.options.clock_offset_s = a.clock_offset_s;
  const capture::LandedCard found = capture::land_card(
      a.folder, a.card, a.options, [&](const std::string& line) { program.say(line); }, program.job());
  program.say(std::to_string(a.options.dry_run ? found.matched : found.landed) + " photographs" +
              (a.options.dry_run ? " would land, " : " landed, ") + std::to_string(found.missing) + " missing, " +
              std::to_string(found.alignment.extra.size()) + " of no shot, " +
              std::to_string(found.alignment.ambiguous.size()) + " places that fit in more than one way");
  if (program.json) std::cout << capture::describe_json(found) << '\n';
  if (!found.troubles.empty())
    throw Error(ErrorCode::bad_input, std::to_string(found.troubles.size()) + " pictures could not be landed", a.card);
}

}  // namespace

void add_ingest(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.verb("ingest", "copy pictures of a memory card to the shots of a capture",
                                [&program, a] { run(program, *a); });
  verb->add_option("capture", a->folder, "folder of a capture that was begun")->required();
  verb->add_option("card", a->card, "folder of the pictures: the card, or a copy of it")->required();
  verb->add_option("--camera", a->options.camera,
                   "whose card it is, by its name in the plan; needed where there are several");
  a->clock_known = verb->add_option("--clock-offset", a->clock_offset_s,
                                    "the camera's clock less UTC in seconds, known to half a minute; else it is found");
  verb->add_flag("--again", a->options.again, "shots without a picture are to be photographed again");
  verb->add_flag("--dry-run", a->options.dry_run, "say what would be done, and do nothing");
}

}  // namespace lumihull::program
