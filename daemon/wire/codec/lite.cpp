#include "wire/codec/lite.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mocap::wire {
namespace {

constexpr std::uint8_t kLayout = 1;

// Bits of the byte `flags`.
constexpr unsigned kPhaseBits = 3U;
constexpr unsigned kOutOfRange = 4U;
constexpr unsigned kOffRest = 8U;

// Offsets of the fields.
constexpr std::size_t kFlags = 1, kSubjectBones = 2, kVersion = 4, kSequence = 8, kNumber = 12;
constexpr std::size_t kExposed = 20, kRoot = 28;
constexpr std::size_t kCoordinate_bytes = 3;

constexpr double kUnitsPerMetre = 1e4;  // a coordinate has steps of 0.1 mm
constexpr double kMostUnits = 8388607;  // 2^23 - 1

constexpr unsigned kComponentBits = 15U;
constexpr double kHalf = 16384;  // a component of 0
// The three components that are not the largest are within +-1/sqrt(2), which is +-16383 steps.
constexpr double kStepsPerUnit = 16383 * std::numbers::sqrt2;
constexpr unsigned kLargestShift = 3 * kComponentBits;
constexpr unsigned kLostShift = kLargestShift + 2;
constexpr std::uint64_t kLost = std::uint64_t{1} << kLostShift;

void put(std::uint64_t value, std::size_t bytes, std::uint8_t* to) {
  for (std::size_t i = 0; i < bytes; ++i) to[i] = static_cast<std::uint8_t>(value >> 8U * i);
}

std::uint64_t get(const std::uint8_t* from, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value |= std::uint64_t{from[i]} << 8U * i;
  return value;
}

std::uint64_t pack(const LiteBone& bone) {
  const std::array<double, 4>& q = bone.rotation_xyzw;
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (bone.lost || !(norm >= 0.5 && norm <= 2.0)) return kLost;
  std::size_t largest = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
  }
  const double scale = std::copysign(kStepsPerUnit / norm, q[largest]);  // q and -q are the same rotation
  std::uint64_t bits = std::uint64_t{largest} << kLargestShift;
  for (std::size_t i = 0, place = 0; i < 4; ++i) {
    if (i == largest) continue;
    const double steps = std::clamp(std::round(q[i] * scale), 1 - kHalf, kHalf - 1);
    bits |= static_cast<std::uint64_t>(steps + kHalf) << kComponentBits * place++;
  }
  return bits;
}

LiteBone unpack(std::uint64_t bits) {
  if ((bits & kLost) != 0) return {};
  LiteBone bone{.lost = false};
  const std::size_t largest = bits >> kLargestShift & 3U;
  double squares = 0.0;
  for (std::size_t i = 0, place = 0; i < 4; ++i) {
    if (i == largest) continue;
    const auto steps = static_cast<double>(bits >> kComponentBits * place++ & 0x7FFFU) - kHalf;
    bone.rotation_xyzw[i] = steps / kStepsPerUnit;
    squares += bone.rotation_xyzw[i] * bone.rotation_xyzw[i];
  }
  bone.rotation_xyzw[largest] = std::sqrt(std::max(0.0, 1.0 - squares));
  if (squares > 1.0) {  // not written by encode_lite
    for (double& component : bone.rotation_xyzw) component /= std::sqrt(squares);
  }
  return bone;
}

// In steps, clamped. Not a number: 0.
double units_of(double coordinate_m) {
  const double units = std::round(coordinate_m * kUnitsPerMetre);
  return std::isnan(units) ? 0.0 : std::clamp(units, -kMostUnits, kMostUnits);
}

bool in_range(double coordinate_m) { return std::abs(coordinate_m) * kUnitsPerMetre < kMostUnits + 0.5; }

double coordinate_m(std::uint64_t bits) {
  const auto shifted = static_cast<std::int32_t>(bits << 8U);  // the sign is in the highest bit
  return static_cast<double>(shifted / 256) / kUnitsPerMetre;
}

}  // namespace

std::size_t encode_lite(const Lite& from, std::span<std::uint8_t, kMaxLite_bytes> into) {
  bool out_of_range = from.out_of_range;
  for (std::size_t i = 0; i < 3; ++i) {
    out_of_range = out_of_range || !in_range(from.root_m[i]);
    const auto units = static_cast<std::int64_t>(units_of(from.root_m[i]));
    put(static_cast<std::uint64_t>(units), kCoordinate_bytes, &into[kRoot + kCoordinate_bytes * i]);
  }
  into[0] = kLayout;
  into[kFlags] = static_cast<std::uint8_t>((from.phase & kPhaseBits) | (out_of_range ? kOutOfRange : 0U) |
                                           (from.off_rest ? kOffRest : 0U));
  into[kSubjectBones] = from.subject_bones;
  into[kLiteFirstBone] = from.first_bone;
  put(from.description_version, 4, &into[kVersion]);
  put(from.sequence, 4, &into[kSequence]);
  put(from.number, 8, &into[kNumber]);
  put(static_cast<std::uint64_t>(from.exposed_at_utc_ns), 8, &into[kExposed]);
  for (std::size_t i = 0; i < from.bone_count; ++i) {
    put(pack(from.bones[i]), kLiteRotation_bytes, &into[lite_bytes(i)]);
  }
  return lite_bytes(from.bone_count);
}

bool decode_lite(std::span<const std::uint8_t> from, Lite& into) {
  if (from.size() < kLiteHeader_bytes || from.size() > kMaxLite_bytes || from[0] != kLayout) return false;
  const std::size_t bytes = from.size() - kLiteHeader_bytes;
  into.bone_count = bytes / kLiteRotation_bytes;
  into.subject_bones = from[kSubjectBones];
  into.first_bone = from[kLiteFirstBone];
  if (bytes % kLiteRotation_bytes != 0 || into.first_bone + into.bone_count > into.subject_bones) return false;
  into.phase = from[kFlags] & kPhaseBits;
  into.out_of_range = (from[kFlags] & kOutOfRange) != 0;
  into.off_rest = (from[kFlags] & kOffRest) != 0;
  into.description_version = static_cast<std::uint32_t>(get(&from[kVersion], 4));
  into.sequence = static_cast<std::uint32_t>(get(&from[kSequence], 4));
  into.number = get(&from[kNumber], 8);
  into.exposed_at_utc_ns = static_cast<std::int64_t>(get(&from[kExposed], 8));
  for (std::size_t i = 0; i < 3; ++i) {
    into.root_m[i] = coordinate_m(get(&from[kRoot + kCoordinate_bytes * i], kCoordinate_bytes));
  }
  for (std::size_t i = 0; i < into.bone_count; ++i) {
    into.bones[i] = unpack(get(from.data() + lite_bytes(i), kLiteRotation_bytes));
  }
  return true;
}

}  // namespace mocap::wire
