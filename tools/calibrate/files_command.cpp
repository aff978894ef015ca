#include "calibrate/files_command.h"

#include <fmt/format.h>

#include "base/exit_codes.h"
#include "calibrate/formats_rig.h"
#include "settings/replace_file.h"
#include "settings/rig_file.h"

namespace mocap::calibrate {
namespace {

constexpr int kExitData = 65;         // sysexits EX_DATAERR
constexpr int kExitCannotWrite = 73;  // sysexits EX_CANTCREAT

void say_notices(const std::vector<std::string>& notices) {
  for (const std::string& notice : notices) fmt::print(stderr, "mocap-calibrate: {}\n", notice);
}

int refuse(const settings::Faults& faults) {
  for (const settings::Fault& fault : faults.list) fmt::print(stderr, "{}\n", settings::to_text(fault));
  const std::size_t count = faults.list.size();
  fmt::print(stderr, "{}: {} fault{}, nothing written\n", faults.file.string(), count, count == 1 ? "" : "s");
  return kExitData;
}

int refuse(const Error& error) {
  fmt::print(stderr, "mocap-calibrate: {}\n", error.message);
  return error.code == ErrorCode::Io ? kExitCannotWrite : kExitUsage;
}

}  // namespace

void FilesCommands::add(cli::App& app) {
  export_ = app.add_subcommand("export", "write a rig as another program reads it");
  export_->add_option("--format", format_, "opencv, kalibr or pose2sim")
      ->required()
      ->check(cli::IsMember({"opencv", "kalibr", "pose2sim"}));
  export_->add_option("rig", from_, "the rig to read")->required()->type_name("RIG.toml");
  export_->add_option("out", to_, "the file to write")->required()->type_name("OUT");

  import_ = app.add_subcommand("import", "make a rig of another program's calibration");
  import_->add_option("--format", format_, "opencv, kalibr, pose2sim or qca; default: told by what the file says")
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
  if (!rig) return refuse(rig.error());
  const auto written = rig_text(*rig, *format_named(format_));
  if (!written) return refuse(written.error());
  if (const Status saved = settings::replace_file(to_, written->text); !saved) return refuse(saved.error());
  say_notices(written->notices);
  fmt::print("{}: written, {} cameras as {}\n", to_.string(), rig->size(), format_);
  return kExitOk;
}

int FilesCommands::run_import() const {
  const auto read = read_rig(from_, format_named(format_));
  if (!read) return refuse(read.error());
  const Status saved = settings::save_rig(to_, read->rig, {{"imported_from", from_.filename().string()}});
  if (!saved) return refuse(saved.error());
  say_notices(read->notices);
  fmt::print("{}: written, {} cameras\n", to_.string(), read->rig.size());
  return kExitOk;
}

}  // namespace mocap::calibrate
