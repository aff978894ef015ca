#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace mocap::web {

/// Replaces %41 by A. Empty: a broken escape.
std::optional<std::string> percent_decoded(std::string_view text);

/// Names and values of a query such as "from_s=2&seconds=1", decoded; of a name that occurs twice the last value.
/// Empty: a broken escape.
std::optional<std::map<std::string, std::string>> read_query(std::string_view query);

/// Inverse of `percent_decoded`: all bytes but letters, digits and -_.~ are escaped.
std::string percent_encoded(std::string_view text);

}  // namespace mocap::web
