#pragma once

#include <filesystem>
#include <memory>

#include "base/result.h"
#include "runtime/pipeline.h"
#include "settings/daemon_settings.h"
#include "settings/state_folder.h"

namespace mocap {

/// The settings in force and their files.
struct Configuration {
  std::filesystem::path file;
  settings::StateFiles state;
  std::unique_ptr<settings::DaemonSettings> settings;
};

/// Loads a configuration with all files that it names, and checks what only the drivers and the keys know. Opens no
/// camera. Fails with all faults.
Result<settings::DaemonSettings, settings::Faults> load_checked(const std::filesystem::path& config,
                                                                const settings::StateFiles& state);

/// Executes an order: saves masks or a rig and adds the new subject, if any, then reloads the configuration.
/// Sets `answer` for the operator. Returns the new settings, or null if a step failed and the daemon keeps its
/// settings. If learnt masks of some cameras have no place in the rig file, the answer is a failure that names them,
/// and the new settings have the other masks. Main thread.
std::unique_ptr<settings::DaemonSettings> reload(const Configuration& now, const runtime::MainOrder& order,
                                                 runtime::MainDone& answer);

/// Logs the result of a reload that no operator waits for.
void log_reload(const runtime::MainDone& answer);

}  // namespace mocap
