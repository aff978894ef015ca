// mocap-calibrate: teaches a rig file what only the cameras know. See --help.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "base/exit_codes.h"
#include "calibrate/files_command.h"
#include "calibrate/mask_command.h"

namespace {

constexpr const char* kExamples = R"(examples:
  mocap-calibrate mask --config my.toml            learn what shines while nobody is there, write it into the rig
  mocap-calibrate mask --config my.toml --dry-run  only say what it would mask
  mocap-calibrate mask --config my.toml --clear    forget what was learnt
  mocap-calibrate import Calib.qca.txt my.rig.toml       make a rig of another program's calibration
  mocap-calibrate export --format kalibr my.rig.toml camchain.yaml

exit codes: 0 done, 64 wrong command line, 65 what was seen is refused and nothing is written, 69 a camera is missing or
taken, 78 wrong configuration)";

}  // namespace

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  CLI::App app{"mocap-calibrate: teaches a rig file what only the cameras know", "mocap-calibrate"};
  app.footer(kExamples);
  app.require_subcommand(1);
  calibrate::MaskOptions mask;
  calibrate::add_mask_command(app, mask);
  calibrate::FilesCommands files;
  files.add(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  try {
    if (const auto exit = files.run()) return *exit;
    return calibrate::run_mask(mask);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "mocap-calibrate: %s\n", exception.what());
    return kExitSoftware;
  }
}
