#include "calibrate/report_compare.h"

#include <fmt/format.h>

#include "base/exit_codes.h"
#include "calibrate/report_rig.h"
#include "calibrate/terminal.h"
#include "calibration/rig/compare_rigs.h"
#include "settings/rig/rig_file.h"

namespace mocap::calibrate {

void CompareCommand::add(cli::App& app) {
  command_ = app.add_subcommand("compare", "compare two rigs camera by camera");
  command_->examples(
      "  mocap-calibrate compare old.rig.toml new.rig.toml\n"
      "  mocap-calibrate compare --truth truth.rig.toml my.rig.toml --json");
  command_->add_option("old", old_, "the reference rig")->required()->type_name("OLD.toml");
  command_->add_option("new", new_, "the rig to compare")->required()->type_name("NEW.toml");
  command_->add_flag("--truth", truth_,
                     "OLD is the truth: align the frames over all cameras with equal weights; default: robustly, with "
                     "little weight for cameras that moved");
  command_->add_flag("--json", json_, "print one JSON object");
}

std::optional<int> CompareCommand::run() const {
  if (!command_->parsed()) return std::nullopt;
  const auto old_rig = settings::load_rig(old_);
  const auto new_rig = settings::load_rig(new_);
  for (const auto* rig : {&old_rig, &new_rig}) {
    if (*rig) continue;
    fmt::print(stderr, "{}\n", settings::to_text(rig->error()));
    return kExitConfig;
  }
  const auto change = calibration::compare_rigs(
      *old_rig, *new_rig, truth_ ? calibration::RigAlignment::AllCameras : calibration::RigAlignment::RobustToMoved);
  if (!change) {
    fmt::print(stderr, "mocap-calibrate: {} and {}: {}\n", old_.string(), new_.string(), change.error().message);
    return kExitData;
  }
  fmt::print("{}", json_ ? change_json(*change) : change_text(*change));
  return kExitOk;
}

}  // namespace mocap::calibrate
