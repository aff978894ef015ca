#include <algorithm>
#include <cstring>
#include <span>

#include "axes.h"
#include "mocap_client.h"
#include "wire/codec/lite.h"

namespace {

using namespace mocap;  // NOLINT: the interface in C

static_assert(MOCAP_LITE_BONES == wire::kLiteBones);

mocap_lite lite_of(const wire::Lite& from, const client::Axes& axes) {
  mocap_lite into{};
  into.number = from.number;
  into.exposed_at_utc_ns = from.exposed_at_utc_ns;
  into.description_version = from.description_version;
  into.sequence = from.sequence;
  into.phase = from.phase;
  if (from.phase != MOCAP_PHASE_TRACKING && from.phase != MOCAP_PHASE_LOST) into.phase = MOCAP_PHASE_SEARCHING;
  into.subject_bones = from.subject_bones;
  into.first_bone = from.first_bone;
  into.bone_count = static_cast<std::uint32_t>(from.bone_count);
  into.out_of_range = from.out_of_range ? 1 : 0;
  into.off_rest = from.off_rest ? 1 : 0;
  const auto single = [](double value) { return static_cast<float>(value); };
  into.root_position = axes.place({single(from.root_m[0]), single(from.root_m[1]), single(from.root_m[2])});
  for (std::size_t i = 0; i < wire::kLiteBones; ++i) {
    const wire::LiteBone bone = i < from.bone_count ? from.bones[i] : wire::LiteBone{};
    const auto& q = bone.rotation_xyzw;
    into.rotations[i] = axes.turn({single(q[0]), single(q[1]), single(q[2]), single(q[3])});
    into.lost[i] = bone.lost ? 1 : 0;
  }
  return into;
}

}  // namespace

extern "C" int32_t mocap_lite_decode(const void* bytes, size_t byte_count, int32_t axes, mocap_lite* into,
                                     size_t size) {
  if (bytes == nullptr || into == nullptr || !client::Axes::known(axes)) return -1;
  wire::Lite lite;
  if (!wire::decode_lite(std::span(static_cast<const std::uint8_t*>(bytes), byte_count), lite)) return 0;
  const mocap_lite all = lite_of(lite, client::Axes(axes));
  std::memcpy(into, &all, std::min(size, sizeof(all)));
  return 1;
}
