#pragma once

#include <string>
#include <string_view>

namespace mocap::wire {

/// Returns `text` with each byte that is not valid UTF-8 replaced by '?'. Protobuf rejects a whole message because of
/// one invalid byte, for example in the error text of a camera driver.
std::string valid_utf8(std::string_view text);

/// Does the same as `valid_utf8`; `into` keeps its memory.
void assign_valid_utf8(std::string_view text, std::string& into);

}  // namespace mocap::wire
