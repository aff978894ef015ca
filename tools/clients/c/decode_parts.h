#pragma once

#include <cmath>
#include <cstdint>
#include <exception>
#include <protozero/pbf_reader.hpp>
#include <string_view>

/// What the decoders share; for decode_*.cpp alone.
namespace mocap::client {

using protozero::pbf_reader;

// A field by its number and how it travels.
constexpr std::uint32_t whole(int number) { return tag_and_type(number, protozero::pbf_wire_type::varint); }
constexpr std::uint32_t part(int number) { return tag_and_type(number, protozero::pbf_wire_type::length_delimited); }
constexpr std::uint32_t single(int number) { return tag_and_type(number, protozero::pbf_wire_type::fixed32); }
constexpr std::uint32_t real(int number) { return tag_and_type(number, protozero::pbf_wire_type::fixed64); }

// The daemon's design bounds.
inline constexpr std::size_t kMaxSubjects = 16;
inline constexpr std::size_t kMaxBones = 128;
inline constexpr std::size_t kMaxMarkers = 1024;
inline constexpr std::size_t kMaxCameras = 64;

// Thrown within this file only: a message that does not hold what it should.
struct Fault {
  const char* what;
};

// No place, speed or turn is larger, and a hundred times as much (cm) is still a number.
inline constexpr double kMaxNumber = 1e9;

inline float finite(double value) {
  if (!(std::abs(value) <= kMaxNumber)) throw Fault{"a number that is not finite, or beyond all bounds"};
  return static_cast<float>(value);
}

template <typename Into, typename Read>
const char* guarded(std::string_view bytes, Into& into, Read read) {
  try {
    read(pbf_reader(bytes.data(), bytes.size()), into);
    return nullptr;
  } catch (const Fault& fault) {
    return fault.what;
  } catch (const protozero::exception&) {
    return "no Protobuf message";
  } catch (const std::exception&) {
    return "more than fits into memory";
  }
}

}  // namespace mocap::client
