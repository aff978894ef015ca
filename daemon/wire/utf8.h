#pragma once

#include <string>
#include <string_view>

namespace mocap::wire {

/// The text with each byte that is no UTF-8 replaced by '?': one such byte (a message of a driver) would make listeners
/// refuse the whole Protobuf message.
std::string valid_utf8(std::string_view text);

/// The same into a text that keeps its memory.
void assign_valid_utf8(std::string_view text, std::string& into);

}  // namespace mocap::wire
