#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace mocap::settings {

/// The fault of a TOML file that cannot be parsed, in the words of an operator: a missing quote, a text without quotes,
/// a heading with the wrong brackets, one [camera] too many. `description`: the message of the parser for `line` (from
/// 1) of `text`; it is returned if the cause is another.
std::string explain_syntax(std::string_view text, std::uint32_t line, std::string_view description);

}  // namespace mocap::settings
