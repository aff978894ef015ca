#pragma once

#include <initializer_list>
#include <string>

namespace mocap {

// Values as literals of TOML, YAML and JSON.

/// The shortest text that reads back as the same bits, with a decimal point, so that every reader takes it as a float.
std::string number_text(double value);

/// In double quotes, with backslash escapes.
std::string quoted_text(const std::string& value);

/// "[1.0, 2.0]"
std::string list_text(std::initializer_list<double> values);

}  // namespace mocap
