// mocap-eval: compares results of the daemon with the truth. See --help.
#include "eval/command.h"
#include "lib/cli/commands.h"
#include "score/command.h"

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  static constexpr cli::Command kCommands[] = {
      {"score", "as mocap-score: a stream of snapshots against the truth", score::run_score},
      {"labels", "as mocap-score labels", score::run_labels},
      {"skeleton", "as mocap-score skeleton", score::run_skeleton},
      {"scene", "score labels and skeletons in a simulated scene", eval::run_scene},
      {"points", "score the 3D markers of simulated cameras", eval::run_points},
      {"wand", "score a calibration from a simulated wand", eval::run_wand},
      {"drift", "score the detection and repair of a bumped camera", eval::run_drift},
      {"rigs", "score the diagnosis of cameras that do not fit the rig", eval::run_rigs},
      {"benchmark", "score labels of recordings with truth, with noise", eval::run_benchmark},
      {"paper", "rebuild the tracking study of 2009, with our trackers", eval::run_paper},
  };
  static constexpr const char* kExamples = R"(examples:
  mocap-eval scene config/scenes/handshake.toml
      two people whose hands meet
  mocap-eval points --markers 80 --seeds 3
      3D markers without a person
  mocap-eval wand --cameras 8 --seconds 60
      a calibration
  mocap-eval paper --markdown
      tables I to VII of the study of 2009)";
  static constexpr cli::Program kProgram{
      "mocap-eval", "compares labels, skeletons, markers and calibrations with the truth", kCommands, kExamples};
  return cli::run_command(kProgram, argc, argv);
}
