#pragma once

#include <deque>
#include <optional>
#include <string>

#include "base/time.h"
#include "mocap/v1/take.pb.h"
#include "model/take/belief.h"
#include "take/recorder/edge_images.h"
#include "take/recorder/take_buffer.h"

namespace mocap::take {

/// The messages up to this long before a take are of use for it: the last belief comes within two periods, and the
/// images of the first set after it were exposed before it.
inline constexpr Duration kLongestLead = 2 * kBeliefPeriod + kLongestSet;

/// The data from just before a take: the last belief of the fusion, and all sets from then to the start of the
/// take. With it the take can be tracked again as it was (Belief in take.proto).
class LeadIn {
 public:
  /// A message from before the start of the take, in any order of kinds.
  void add(const BufferedMessage& message);

  /// The encoded Belief; empty: no belief came. `producer`: name and version of this program.
  std::optional<std::string> finish(const std::string& producer);

 private:
  struct Waiting {
    Timestamp at;
    std::string bytes;
  };

  void begin(const BufferedMessage& belief);

  std::optional<v1::Belief> belief_;
  std::deque<Waiting> sets_, images_;
};

}  // namespace mocap::take
