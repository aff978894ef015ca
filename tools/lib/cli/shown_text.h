#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mocap::cli {

/// A text of unknown origin for a terminal: each control character is a space (C0, DEL, and C1 in UTF-8), so that the
/// text cannot move the cursor or give the terminal an order. At most `bytes` of it, and no part of a character.
std::string shown(std::string_view text, std::size_t bytes = std::string::npos);

/// As shown(), for a message of several lines, such as all faults of a configuration: line breaks are kept.
std::string shown_lines(std::string_view text);

}  // namespace mocap::cli
