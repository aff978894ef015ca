#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <exception>
#include <protozero/pbf_reader.hpp>
#include <string>
#include <string_view>

#include "frame.h"

/// Common parts of decode_*.cpp. Other files do not include this header.
namespace mocap::client {

using protozero::pbf_reader;

// Tag of a field: its number and its wire type.
constexpr std::uint32_t whole(int number) { return tag_and_type(number, protozero::pbf_wire_type::varint); }
constexpr std::uint32_t part(int number) { return tag_and_type(number, protozero::pbf_wire_type::length_delimited); }
constexpr std::uint32_t single(int number) { return tag_and_type(number, protozero::pbf_wire_type::fixed32); }
constexpr std::uint32_t real(int number) { return tag_and_type(number, protozero::pbf_wire_type::fixed64); }

// The daemon's design bounds.
inline constexpr std::size_t kMaxSubjects = 16;
inline constexpr std::size_t kMaxBones = 128;
inline constexpr std::size_t kMaxMarkers = 1024;
inline constexpr std::size_t kMaxCameras = 64;

// Thrown by the decoders for an invalid message, and caught in guarded().
struct Fault {
  const char* what;
};

// Bound for positions, velocities and rotations. 100 times the bound (cm) is still a finite float.
inline constexpr double kMaxNumber = 1e9;

inline float finite(double value) {
  if (!(std::abs(value) <= kMaxNumber)) throw Fault{"a number that is not finite or out of range"};
  return static_cast<float>(value);
}

// A number of a report: NaN if it is not finite.
inline double finite_or_nan(double value) { return std::isfinite(value) ? value : std::nan(""); }

// Stores a text where a `const char*` of the C ABI may point to it. A deque does not move its elements.
inline const char* keep_text(pbf_reader& from, std::deque<std::string>& texts) {
  return texts.emplace_back(from.get_string()).c_str();
}

// Reads a health report; also a part of the status (decode_answer.cpp).
void read_health(pbf_reader from, Health& into);

// Calls `read` on the message. Returns nullptr, or the fault as text.
template <typename Into, typename Read>
const char* guarded(std::string_view bytes, Into& into, Read read) {
  try {
    read(pbf_reader(bytes.data(), bytes.size()), into);
    return nullptr;
  } catch (const Fault& fault) {
    return fault.what;
  } catch (const protozero::exception&) {
    return "not a Protobuf message";
  } catch (const std::exception&) {
    return "out of memory";
  }
}

}  // namespace mocap::client
