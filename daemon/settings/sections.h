#pragma once

#include <span>
#include <vector>

#include "base/key_visitor.h"
#include "settings/daemon_settings.h"

namespace mocap::settings {

/// A table [name] of the configuration. Its keys are declared beside the structs that they fill, in the folders of the
/// pipeline; a section says which of them belong together.
struct Section {
  const char* name;
  const char* help;  ///< comment beside [name] in config/mocapd.toml
  void (*declare)(KeyVisitor& keys, DaemonSettings& settings);
  std::vector<KeyFault> (*faults)(const DaemonSettings& settings);  ///< rules between keys; null: none
  const char* heading = nullptr;                                    ///< of the group of sections that begins here
};

/// Every section but [[camera]] and [[subject]], in the order of config/mocapd.toml.
std::span<const Section> sections();

}  // namespace mocap::settings
