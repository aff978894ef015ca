#pragma once

#include <string>
#include <string_view>

namespace mocap::cli {

/// A text of unknown origin for a terminal: each control character is a space (C0, DEL, and C1 in UTF-8), so that the
/// text cannot move the cursor or give the terminal an order.
std::string shown(std::string_view text);

}  // namespace mocap::cli
