#pragma once

#include "settings/daemon_settings.h"
#include "settings/keys.h"

namespace mocap::settings {

/// A section [name] of the configuration: the keys it has, and the fields they fill.
struct Section {
  const char* name;
  void (*tell)(Keys& keys, DaemonSettings& settings);
};

/// Every section but [[camera]] and [[subject]], in the order of config/mocapd.toml.
std::span<const Section> sections();

}  // namespace mocap::settings
