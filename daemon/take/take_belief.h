#pragma once

#include <optional>

#include "base/result.h"
#include "mocap/v1/take.pb.h"
#include "take/take_reader.h"

namespace mocap::take {

/// The attachment of a take with a `v1::Belief`.
inline constexpr const char* kBeliefFile = "belief.pb";
inline constexpr const char* kBeliefMediaType = "application/x-protobuf";

/// The belief that a take begins with, its state uncompressed; nothing if the take has none. Fails with InvalidArgument
/// (damaged).
Result<std::optional<v1::Belief>> belief_of(const TakeReader& take);

}  // namespace mocap::take
