// lumihull simulate FOLDER: a capture by the virtual rig, as one would make it with the real one; the truth beside.

#include <lumihull/rig/simulate.h>

#include <iostream>
#include <map>
#include <numbers>

#include "program.h"

namespace lumihull::program {

namespace {

struct Arguments {
  std::string folder, plan;
  rig::SimulateOptions options;
  std::vector<int> unlit;
  std::string phi = "7..90";
  double robot_errors = 1;
  bool fast = false, no_noise = false, no_sheets = false, no_cables = false, ideal_lens = false, no_swing = false;
};

void run(Program& program, Arguments& a) {
  rig::SimulateOptions& o = a.options;
  if (!a.plan.empty()) o.plan = capture::read_plan(a.plan);
  if (a.unlit.size() == 3) o.unlit = {std::uint8_t(a.unlit[0]), std::uint8_t(a.unlit[1]), std::uint8_t(a.unlit[2])};
  if (a.fast) o.photo.reduce = 3;
  if (a.no_noise) o.photo.full_well = 0;
  if (a.ideal_lens) o.distortion = 0;
  o.sheets = !a.no_sheets, o.cables = !a.no_cables;
  rig::RobotErrors& e = o.errors;
  for (double* size :
       {&e.departure_m, &e.attachment_m, &e.offset_m, &e.gain, &e.winch_m, &e.common_m, &e.mount_m, &e.mount_rad,
        &e.bearing_rad, &e.table_m, &e.table_rad, &e.hand_m, &e.hand_rad, &e.swing_m, &e.swing_rad})
    *size *= a.robot_errors;
  if (a.no_swing) e.swing_m = e.swing_rad = 0;

  const rig::Simulated made =
      rig::simulate(a.folder, o, program.job(), [&](const std::string& line) { program.say(line); });
  program.say(a.folder + ": " + std::to_string(made.photographs) + " photographs, " + std::to_string(made.taken) +
              " taken now" +
              (made.with_cables ? "; a cable crosses " + std::to_string(made.with_cables) + " of them" : ""));
  if (!o.known_cameras && o.sheets)
    program.say("next: lumihull calibrate " + a.folder + " --targets " + a.folder + "/sheets.json; lumihull run " +
                a.folder);
  if (program.json)
    std::cout << "{\"photographs\": " << made.photographs << ", \"taken\": " << made.taken
              << ", \"sheets\": " << made.sheets << ", \"least_targets\": " << made.least_targets
              << ", \"with_cables\": " << made.with_cables << ", \"radius_m\": " << made.radius_m
              << ", \"carrier\": " << json_text(made.carrier) << "}\n";
}

}  // namespace

void add_simulate(Program& program) {
  const auto a = std::make_shared<Arguments>();
  rig::SimulateOptions& o = a->options;
  CLI::App* verb = program.verb("simulate", "photograph an object with the virtual rig, through a plan and a session",
                                [&program, a] { run(program, *a); });
  verb->add_option("folder", a->folder, "of the capture, new or begun by the same command")->required();
  verb->add_option("--object", o.object,
                   "vase, bust, statue, gate, snowmobile, deer, box, sphere, pebble, or a mesh file [bust]");
  verb->add_option("--size", o.size_m, "longest side of the object, m [as in the paper, or 0.6]");
  verb->add_flag("--matt", o.matt, "the object has no gloss");
  verb->add_flag("--uniform", o.uniform, "the object has one paint all over");
  verb->add_option("--unlit", a->unlit, "the object is R,G,B (0 to 255) in every photograph, whatever the light")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0, 255));
  verb->add_option("--photos", o.photos, "photographs of the object [48]");
  verb->add_option("--plan", a->plan, "what `lumihull plan` wrote, instead of a hemisphere of views")
      ->type_name("FILE");
  verb->add_option("--robot", o.carrier,
                   "what carries the camera: cables (the paper's mechanism), turntable, hand, ideal, or auto: cables "
                   "where they can, else ideal [auto]")
      ->transform(CLI::CheckedTransformer(std::map<std::string, rig::Carrier>{{"auto", rig::Carrier::automatic},
                                                                              {"cables", rig::Carrier::cables},
                                                                              {"turntable", rig::Carrier::turntable},
                                                                              {"hand", rig::Carrier::hand},
                                                                              {"ideal", rig::Carrier::ideal}}))
      ->option_text("WORD");
  verb->add_option("--radius", o.radius_m, "of the hemisphere, m [as in the paper, or where the object fills it]");
  verb->add_option("--robot-errors", a->robot_errors, "factor on how far the robot is from where it should be [1]")
      ->check(CLI::Range(0.0, 10.0));
  verb->add_flag("--no-swing", a->no_swing, "the robot hangs still at once");
  verb->add_flag("--no-cables", a->no_cables, "cables don't cross the picture");
  verb->add_option("--width", o.width, "of a photograph, px; the height is two thirds [1536]");
  verb->add_option("--focal-mm", o.focal_mm, "of the lens, on a sensor of 22.7 x 15.1 mm [18]");
  verb->add_flag("--no-distortion", a->ideal_lens, "an ideal lens");
  verb->add_option("--f-number", o.photo.f_number, "of the lens: what is out of focus is blurred; 0: nothing is [0]");
  verb->add_option("--blur", o.photo.blur_px, "of the lens, px (sigma) [0.6]");
  verb->add_flag("--bayer", o.photo.bayer, "one colour a pixel, demosaiced");
  verb->add_flag("--no-noise", a->no_noise, "an ideal sensor");
  verb->add_option("--exposure", o.photo.exposure, "brightness [1]");
  verb->add_option("--quality", o.jpeg_quality, "of the JPEGs, 1 to 100 [93]");
  verb->add_option("--rays", o.photo.rays, "n x n rays a pixel [2]");
  verb->add_flag("--fast", a->fast, "trace a third of the size and enlarge; sheets' edges and noise at full size");
  verb->add_option("--sheets", o.density, "density: share of walls and floor that sheets of targets cover [0.12]");
  verb->add_flag("--no-sheets", a->no_sheets, "no targets");
  verb->add_option("--target-px", o.circle_px, "diameter of the targets' circles in the photographs, px [9]");
  verb->add_option("--least-targets", o.least_targets, "more sheets where a view decodes fewer [5]");
  verb->add_option("--room-radius", o.room_radius_m, "from the middle to the panels, m [3, or what the views ask for]");
  verb->add_flag("--blue", o.blue, "a blue enclosure instead of a green one");
  verb->add_option("--empty", o.empty_photos, "photographs of the empty enclosure [8]");
  verb->add_option("--lens-photos", o.lens_photos, "photographs of a printed board, for `lumihull intrinsics` [12]");
  verb->add_flag("--known-cameras", o.known_cameras, "the capture is told the true cameras: nothing to calibrate");
  verb->add_flag("--depth", o.depth, "true depth of each photograph, too");
  verb->add_option("--test-views", o.test_views, "pictures along an arc for judging a renderer, into truth/");
  verb->add_option("--seed", o.seed, "of paint, noise, sheets and errors [1]");
  o.photo.blur_px = .6;
}

}  // namespace lumihull::program
