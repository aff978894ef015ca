#include "calibrate/rig_output.h"

#include <fmt/chrono.h>

#include <ctime>

namespace mocap::calibrate {

int write_rig(const std::filesystem::path& path, const Rig& rig, settings::RigMetadata facts, const char* solved_by) {
  facts["solved_by"] = fmt::format("mocap-calibrate {}", solved_by);
  facts["solved_at_utc"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  const Status saved = settings::save_rig(path, rig, facts);
  if (!saved) {
    say("{}", saved.error().message);
    return kExitUnavailable;
  }
  fmt::print("{}: written; mocapd uses it when it is started again\n", path.string());
  return kExitOk;
}

}  // namespace mocap::calibrate
