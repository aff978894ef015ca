#pragma once

#include <string>

namespace mocap::settings {

/// The text of config/mocapd.toml: every key with its default, its range or choices and its help, taken from the tables
/// of keys. A key without a default is shown with an example.
std::string example_config();

}  // namespace mocap::settings
