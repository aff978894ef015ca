#include "lib/offline/snapshot_record.h"

#include <cstdint>

#include "base/expects.h"
#include "mocap/v1/snapshot.pb.h"
#include "wire/codec/decode.h"
#include "wire/codec/encode.h"

namespace mocap::offline {

void put(std::string_view part, std::string& record) {
  const auto size = static_cast<std::uint32_t>(part.size());
  record.append(reinterpret_cast<const char*>(&size), sizeof size);  // NOLINT: bytes
  record.append(part);
}

std::string_view next_part(std::string_view& record) {
  std::uint32_t size = 0;
  MOCAP_EXPECTS(record.size() >= sizeof size);
  record.copy(reinterpret_cast<char*>(&size), sizeof size);  // NOLINT: bytes
  MOCAP_EXPECTS(record.size() >= sizeof size + size);
  const std::string_view part = record.substr(sizeof size, size);
  record.remove_prefix(sizeof size + size);
  return part;
}

std::string bytes_of(const Snapshot& snapshot) {
  v1::Snapshot message;
  wire::encode(snapshot, message);
  return message.SerializeAsString();
}

Result<Snapshot> snapshot_of(std::string_view bytes) {
  v1::Snapshot message;
  MOCAP_EXPECTS(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  return wire::decode(message);
}

}  // namespace mocap::offline
