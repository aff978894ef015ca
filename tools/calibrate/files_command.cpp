#include "calibrate/files_command.h"

#include <fmt/format.h>

#include "base/exit_codes.h"
#include "base/replace_file.h"
#include "calibrate/rig_import.h"
#include "calibrate/terminal.h"
#include "calibration/formats/rig_format.h"
#include "settings/rig/rig_file.h"

namespace mocap::calibrate {
namespace {

void print_notices(const std::vector<std::string>& notices) {
  for (const std::string& notice : notices) fmt::print(stderr, "mocap-calibrate: {}\n", notice);
}

int print_error(const settings::Faults& faults) {
  for (const settings::Fault& fault : faults.list) fmt::print(stderr, "{}\n", settings::to_text(fault));
  const std::size_t count = faults.list.size();
  fmt::print(stderr, "{}: {} fault{}, nothing written\n", faults.file.string(), count, count == 1 ? "" : "s");
  return kExitData;
}

int print_error(const Error& error, int refused = kExitUsage) {
  fmt::print(stderr, "mocap-calibrate: {}\n", error.message);
  return error.code == ErrorCode::Io ? kExitCannotWrite : refused;
}

}  // namespace

void FilesCommands::add(cli::App& app) {
  export_ = app.add_subcommand("export", "write a rig in the file format of another program");
  export_->examples("  mocap-calibrate export --format kalibr my.rig.toml camchain.yaml");
  export_->add_option("--format", format_, "opencv, kalibr or pose2sim")
      ->required()
      ->check(cli::IsMember({"opencv", "kalibr", "pose2sim"}));
  export_->add_option("rig", from_, "the rig to read")->required()->type_name("RIG.toml");
  export_->add_option("out", to_, "the file to write")->required()->type_name("OUT");

  import_ = app.add_subcommand("import", "make a rig file from a calibration file of another program");
  import_->examples(
      "  mocap-calibrate import Calib.qca.txt my.rig.toml\n"
      "  mocap-calibrate import --format opencv cameras.yml my.rig.toml");
  import_->add_option("--format", format_, "opencv, kalibr, pose2sim or qca; default: by the content of the file")
      ->check(cli::IsMember({"opencv", "kalibr", "pose2sim", "qca"}));
  import_->add_option("file", from_, "the file to read")->required()->type_name("FILE");
  import_->add_option("out", to_, "the rig to write")->required()->type_name("OUT.toml");
}

std::optional<int> FilesCommands::run() const {
  if (export_->parsed()) return run_export();
  if (import_->parsed()) return run_import();
  return std::nullopt;
}

int FilesCommands::run_export() const {
  const auto rig = settings::load_rig(from_);
  if (!rig) return print_error(rig.error());
  const auto written = calibration::rig_text(*rig, *calibration::format_named(format_));
  if (!written) return print_error(written.error());
  if (const Status saved = replace_file(to_, written->text); !saved) return print_error(saved.error());
  print_notices(written->notices);
  fmt::print("{}: written, {} cameras as {}\n", to_.string(), rig->size(), format_);
  return kExitOk;
}

int FilesCommands::run_import() const {
  const auto read = read_rig(from_, calibration::format_named(format_));
  if (!read) return print_error(read.error());
  const Status saved = settings::save_rig(to_, read->rig, {{"imported_from", from_.filename().string()}});
  if (!saved) return print_error(saved.error(), kExitData);
  print_notices(read->notices);
  fmt::print("{}: written, {} cameras\n", to_.string(), read->rig.size());
  return kExitOk;
}

}  // namespace mocap::calibrate
