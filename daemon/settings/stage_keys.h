#pragma once

#include <span>

#include "base/key_visitor.h"
#include "settings/daemon_settings.h"

namespace mocap::settings {

/// A section [name] of the configuration: the keys it has, and the fields they fill.
struct Section {
  const char* name;
  void (*tell)(KeyVisitor& keys, DaemonSettings& settings);
};

/// Every section but [[camera]] and [[subject]], in the order of config/mocapd.toml.
std::span<const Section> sections();

}  // namespace mocap::settings
