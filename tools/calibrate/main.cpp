// mocap-calibrate: calibrates cameras and writes rig files. See --help.
#include <cstdio>
#include <exception>

#include "base/exit_codes.h"
#include "calibrate/files_command.h"
#include "calibrate/floor_command.h"
#include "calibrate/lens_command.h"
#include "calibrate/mask_command.h"
#include "calibrate/report_compare.h"
#include "calibrate/verify_command.h"
#include "calibrate/wand_command.h"
#include "lib/cli/app.h"

namespace {

constexpr const char* kExamples = R"(examples:
  mocap-calibrate wand --config my.toml --wand 500           wave a wand of 500 mm; writes the rig when complete
  mocap-calibrate wand --blobs take.blobs --fov 60 --out rig.toml   from a recording, without lens files
  mocap-calibrate floor --config my.toml --frame 600,400     a floor frame is at the origin
  mocap-calibrate verify --config my.toml                    move markers: do all cameras agree with the rig?
  mocap-calibrate refine --config my.toml                    repair a rig after a camera was bumped
  mocap-calibrate mask --config my.toml            learn the lights in the empty volume, write masks into the rig
  mocap-calibrate mask --config my.toml --dry-run  only report the masks
  mocap-calibrate mask --config my.toml --clear    remove all learned masks
  mocap-calibrate lens --config my.toml --columns 8 --rows 6 --square-mm 40   show a ChArUco board to each camera
  mocap-calibrate lens --images shots --board chessboard --columns 9 --rows 7 --square-mm 25 --rig my.rig.toml
  mocap-calibrate import Calib.qca.txt my.rig.toml       make a rig from a file of another program
  mocap-calibrate compare old.rig.toml new.rig.toml      camera by camera: what moved
  mocap-calibrate export --format kalibr my.rig.toml camchain.yaml

exit codes: 0 done, 64 wrong command line, 65 recording or images refused, or verify found a fault (no rig file is
changed), or wand cannot compare the new rig with --truth, 66 recording or images cannot be read, 69 a camera is missing
or busy, 70 a bug, 73 a file cannot be written, 78 wrong configuration)";

}  // namespace

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  cli::App app{"mocap-calibrate: calibrates cameras and writes rig files", "mocap-calibrate"};
  app.footer(kExamples);
  app.require_subcommand(1);
  calibrate::MaskOptions mask;
  calibrate::add_mask_command(app, mask);
  calibrate::WandOptions wand;
  calibrate::add_wand_command(app, wand);
  calibrate::FloorOptions floor;
  calibrate::add_floor_command(app, floor);
  calibrate::VerifyOptions verify;
  calibrate::add_verify_command(app, verify);
  calibrate::RefineOptions refine;
  calibrate::add_refine_command(app, refine);
  calibrate::FilesCommands files;
  files.add(app);
  calibrate::LensCommand lens;
  lens.add(app);
  calibrate::CompareCommand compare;
  compare.add(app);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  try {
    if (app.got_subcommand("wand")) return calibrate::run_wand(wand);
    if (app.got_subcommand("floor")) return calibrate::run_floor(floor);
    if (app.got_subcommand("verify")) return calibrate::run_verify(verify);
    if (app.got_subcommand("refine")) return calibrate::run_refine(refine);
    if (const auto exit = files.run()) return *exit;
    if (const auto exit = lens.run()) return *exit;
    if (const auto exit = compare.run()) return *exit;
    return calibrate::run_mask(mask);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "mocap-calibrate: %s\n", exception.what());
    return kExitSoftware;
  }
}
