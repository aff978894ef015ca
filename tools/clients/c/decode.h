#pragma once

#include <string_view>

#include "frame.h"

namespace mocap::client {

/// The decoders of the message schema (proto/mocap/v1). A message is untrusted. Each function returns nullptr, or a
/// short description of the fault; `into` is then undefined. The decoders refuse numbers that are not finite, columns
/// of different lengths, and counts beyond the daemon's design bounds. They skip unknown fields. Positions and
/// rotations stay in the axes of the feed. complete() adds local poses that the message omits. The decoders reuse the
/// memory of `into`.
const char* decode_snapshot(std::string_view bytes, Frame& into);

const char* decode_description(std::string_view bytes, Description& into);
const char* decode_health(std::string_view bytes, Health& into);
const char* decode_event(std::string_view bytes, Event& into);
const char* decode_answer(std::string_view bytes, Answer& into);

/// Computes the local poses that the feed omits, from the description to which the frame refers. Returns nullptr, or a
/// fault if frame and description do not match.
const char* complete(Frame& frame, const Description& description);

}  // namespace mocap::client
