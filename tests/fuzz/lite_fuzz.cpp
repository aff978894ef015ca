#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <string>

#include "base/expects.h"
#include "fuzz/damage.h"
#include "fuzz/fuzz_arguments.h"
#include "mocap_client.h"
#include "wire/codec/lite.h"

// Fuzzes the decoders of the messages lite/NAME: valid messages with damages, and random bytes. Each message is copied
// to a memory block of its exact size, so that the address sanitizer detects reads beyond its end. A decoded message
// has unit quaternions, finite positions and bones within the subject, and both decoders agree.
//
// usage: lite_fuzz [COUNT [SEED]]

namespace mocap::wire {
namespace {

std::string valid_message(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Lite lite;
  lite.phase = static_cast<std::uint8_t>(random() % 4);
  lite.number = random();
  lite.bone_count = random() % (kLiteBones + 1);
  lite.first_bone = static_cast<std::uint8_t>(random() % 100);
  lite.subject_bones = static_cast<std::uint8_t>(lite.first_bone + lite.bone_count);
  for (double& coordinate : lite.root_m) coordinate = 500.0 * normal(random);
  for (LiteBone& bone : lite.bones) {
    bone.lost = random() % 8 == 0;
    for (double& component : bone.rotation_xyzw) component = normal(random);
  }
  std::array<std::uint8_t, kMaxLite_bytes> bytes{};
  const std::size_t size = encode_lite(lite, bytes);
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
}

bool is_unit(const mocap_quat& q) { return std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0F) < 1e-5F; }

// Returns whether the bytes are a message.
bool decode(const std::string& message) {
  const std::unique_ptr<std::uint8_t[]> exact(new std::uint8_t[message.size()]);
  std::memcpy(exact.get(), message.data(), message.size());
  Lite lite;
  mocap_lite client;
  const bool decoded = decode_lite({exact.get(), message.size()}, lite);
  const int code = mocap_lite_decode(exact.get(), message.size(), MOCAP_AXES_UNREAL, &client, sizeof(client));
  MOCAP_EXPECTS(code == (decoded ? 1 : 0));
  if (!decoded) return false;
  MOCAP_EXPECTS(lite.bone_count <= kLiteBones && lite.first_bone + lite.bone_count <= lite.subject_bones);
  MOCAP_EXPECTS(client.bone_count == lite.bone_count && client.number == lite.number);
  for (const double coordinate : lite.root_m) MOCAP_EXPECTS(std::abs(coordinate) <= kLiteRange_m + 1e-3);
  for (std::size_t i = 0; i < lite.bone_count; ++i) {
    double squares = 0.0;
    for (const double component : lite.bones[i].rotation_xyzw) squares += component * component;
    MOCAP_EXPECTS(std::abs(squares - 1.0) < 1e-9 && is_unit(client.rotations[i]));
  }
  return true;
}

}  // namespace
}  // namespace mocap::wire

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  const fuzz::Arguments arguments(argc, argv);
  std::mt19937_64 random(arguments.seed);
  std::uint64_t read = 0;
  for (std::uint64_t tries = 0; tries < arguments.count; ++tries) {
    const bool random_bytes = random() % 8 == 0;
    const std::string valid = wire::valid_message(random);
    if (wire::decode(random_bytes ? fuzz::random_bytes(random) : fuzz::damaged(valid, random))) ++read;
  }
  arguments.print("messages");
  return read > 0 && read < arguments.count ? 0 : 1;
}
