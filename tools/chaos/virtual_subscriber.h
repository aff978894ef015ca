#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "chaos/invariants.h"
#include "model/description.h"

namespace mocap::chaos {

/// A client of the feed: keeps the last description, and reads the snapshots that refer to it. A whole message that
/// cannot be read is a finding; a damaged one must be refused or read without harm.
class VirtualSubscriber {
 public:
  void receive_description(const std::string& bytes, bool damaged);
  void receive_snapshot(const std::string& bytes, bool damaged);

  /// A description was lost: the snapshots that refer to it cannot be read until the next one.
  void forget() { known_.reset(); }

  const Finding& finding() const { return finding_; }
  /// Whole snapshots whose description is known.
  std::uint64_t read_snapshots() const { return read_snapshots_; }

 private:
  void refuse(bool damaged, const std::string& why);
  void note(const Finding& finding);

  std::optional<Description> known_;
  Finding finding_;
  std::uint64_t read_snapshots_ = 0;
};

}  // namespace mocap::chaos
