#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/time.h"

namespace mocap::bench {

/// Somebody who means harm to a feed on a loopback port, or does it by stalling. Lives until its destructor.
class Attack {
 public:
  virtual ~Attack() = default;

  /// As long as it takes, `until` at most.
  virtual void go_on(Timestamp until) = 0;
};

/// `name`: stalled, slow, huge_subscription, many_subscriptions, random_bytes or half_open.
std::unique_ptr<Attack> make_attack(const std::string& name, std::uint16_t port, std::uint64_t seed);

inline constexpr const char* kAttacks[] = {"stalled",      "slow",     "huge_subscription", "many_subscriptions",
                                           "random_bytes", "half_open"};

}  // namespace mocap::bench
