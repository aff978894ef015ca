#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/time.h"

namespace mocap::bench {

/// A hostile or stalled peer of a feed on a loopback port. The attack ends with the destructor.
class Attack {
 public:
  virtual ~Attack() = default;

  /// Continues the attack. Returns when the attack is complete or at `until`.
  virtual void go_on(Timestamp until) = 0;
};

/// `name`: stalled, slow, huge_subscription, many_subscriptions, random_bytes or half_open.
std::unique_ptr<Attack> make_attack(const std::string& name, std::uint16_t port, std::uint64_t seed);

inline constexpr const char* kAttacks[] = {"stalled",      "slow",     "huge_subscription", "many_subscriptions",
                                           "random_bytes", "half_open"};

}  // namespace mocap::bench
