#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/time.h"
#include "model/snapshot.h"

namespace mocap::offline {

/// The time, s, since each label and each bone of a snapshot was measured; infinite: not since its subject was found.
/// In the order of the snapshot's labels and poses.
struct Ages {
  std::vector<std::vector<float>> labels;  ///< by subject and marker
  std::vector<std::vector<float>> bones;   ///< by subject and bone
};

/// Follows the ages from snapshot to snapshot, whose times rise.
class AgeWatch {
 public:
  Ages next(const Snapshot& snapshot);

 private:
  using Key = std::pair<std::uint32_t, std::size_t>;  // subject, marker or bone

  std::map<Key, Timestamp> labels_, bones_;  // last measured
};

/// The share of the forward value in a value between two observations: linear in time.
double forward_share(float forward_age_s, float backward_age_s);

/// As bytes, and back. `snapshot`: that of the ages. Empty: the bytes do not belong to it.
std::string encode(const Ages& ages);
std::optional<Ages> decode_ages(std::string_view bytes, const Snapshot& snapshot);

}  // namespace mocap::offline
