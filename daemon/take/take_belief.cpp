#include "take/take_belief.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "model/take/belief.h"
#include "take/mcap/compression.h"

namespace mocap::take {

Result<std::optional<v1::Belief>> belief_of(const TakeReader& take) {
  Result<std::string> bytes = take.file(kBeliefFile);
  if (!bytes && bytes.error().code == ErrorCode::NotFound) return std::optional<v1::Belief>();
  if (!bytes) return bytes.error();
  v1::Belief belief;
  if (!belief.ParseFromString(*bytes) || belief.state_size() > kMostBeliefBytes) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("'{}': its attachment '{}' is damaged", take.mcap().path(), kBeliefFile)};
  }
  Result<std::string> state = mcap::uncompress("zstd", belief.state(), belief.state_size());
  if (!state) return state.error();
  belief.set_state(*std::move(state));
  return std::optional(std::move(belief));
}

}  // namespace mocap::take
