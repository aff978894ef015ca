#pragma once

#include <cstdint>
#include <string>

#include "mocap_client.h"

namespace mocap::client {

/// The requests that only mocap_control_get_frame sends; numbers that enum mocap_request_kind does not have.
inline constexpr std::int32_t kDescriptionRequest = -1;
inline constexpr std::int32_t kSnapshotRequest = -2;

/// The request as a Protobuf message of control.proto. Empty if its kind is unknown.
std::string encode_request(const mocap_request& request, std::uint64_t id);

}  // namespace mocap::client
