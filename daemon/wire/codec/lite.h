#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace mocap::wire {

// Messages of the topics lite/NAME. proto/lite/README.md has the layout and the precision. Needs the C++ library alone:
// the client library in C compiles this file too.

inline constexpr std::size_t kLiteHeader_bytes = 37;
inline constexpr std::size_t kLiteFirstBone = 3;  ///< offset of the byte `first_bone`
inline constexpr std::size_t kLiteRotation_bytes = 6;
/// Bones of one message; a subject with more has several messages for each instant.
inline constexpr std::size_t kLiteBones = 27;
inline constexpr std::size_t kMaxLite_bytes = kLiteHeader_bytes + kLiteBones * kLiteRotation_bytes;
static_assert(kMaxLite_bytes <= 200);

/// The largest coordinate of the root, m.
inline constexpr double kLiteRange_m = 838.8607;

struct LiteBone {
  bool lost = true;  ///< no rotation
  std::array<double, 4> rotation_xyzw = {0.0, 0.0, 0.0, 1.0};
};

/// One message: a subject at one instant, or some of its bones.
struct Lite {
  std::uint8_t phase = 0;     ///< v1::SubjectPhase, 0 to 3
  bool out_of_range = false;  ///< the position of the root is farther from the origin than kLiteRange_m and was clamped
  bool off_rest = false;      ///< a joint is not at its rest offset from its parent
  std::uint8_t subject_bones = 0;  ///< of the subject in this instant; 0: it has no pose
  std::uint8_t first_bone = 0;     ///< index of bones[0] in the subject's skeleton
  std::uint32_t description_version = 0;
  std::uint32_t sequence = 0;
  std::uint64_t number = 0;
  std::int64_t exposed_at_utc_ns = 0;
  std::array<double, 3> root_m = {};
  std::size_t bone_count = 0;  ///< of the message, 0 to kLiteBones
  std::array<LiteBone, kLiteBones> bones = {};
};

/// Number of messages for a subject with so many bones; at least 1.
constexpr std::size_t lite_messages(std::size_t bones) {
  return bones == 0 ? 1 : (bones + kLiteBones - 1) / kLiteBones;
}

constexpr std::size_t lite_bytes(std::size_t bones) { return kLiteHeader_bytes + bones * kLiteRotation_bytes; }

/// Encodes a message and returns its size, which is lite_bytes(from.bone_count). Never allocates. A rotation is
/// normalised; one that is no rotation (a norm below 0.5, above 2, or not a number) makes the bone lost. A coordinate
/// that is out of range is clamped, one that is not a number becomes 0; both set out_of_range.
std::size_t encode_lite(const Lite& from, std::span<std::uint8_t, kMaxLite_bytes> into);

/// Decodes a message. Never allocates. Returns false, with `into` undefined, if the bytes are no such message. All
/// rotations are unit quaternions, positions are finite.
bool decode_lite(std::span<const std::uint8_t> from, Lite& into);

}  // namespace mocap::wire
