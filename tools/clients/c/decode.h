#pragma once

#include <string_view>

#include "frame.h"

namespace mocap::client {

/// The only place that knows the schema (proto/mocap/v1). Each reads a message that may come from anybody and gives
/// nullptr, or what is wrong with it in a few words; then what was filled means nothing. Numbers that are not finite,
/// columns that do not fit, and more than the daemon's design bounds are refused; what is not known is passed over.

/// In the feed's axes. Local poses that are not sent are left for `complete`. Memory of `into` is used again.
const char* decode_snapshot(std::string_view bytes, Frame& into);

const char* decode_description(std::string_view bytes, Description& into);
const char* decode_health(std::string_view bytes, Health& into);

/// Puts the local poses in that the feed leaves out, by the description that the frame refers to. Fails where the two
/// do not fit.
const char* complete(Frame& frame, const Description& description);

}  // namespace mocap::client
