#include "calibrate/rig_output.h"

#include <fmt/chrono.h>

#include <ctime>

namespace mocap::calibrate {

int write_rig(const std::filesystem::path& path, const Rig& rig, settings::RigMetadata facts, const char* subcommand) {
  facts["solved_by"] = fmt::format("mocap-calibrate {}", subcommand);
  facts["solved_at_utc"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  const Status saved = settings::save_rig(path, rig, facts);
  if (!saved) {
    print_message("{}", saved.error().message);
    return kExitUnavailable;
  }
  fmt::print("{}: written; restart mocapd to use it\n", path.string());
  return kExitOk;
}

}  // namespace mocap::calibrate
