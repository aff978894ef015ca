#pragma once

#include <compare>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"

namespace mocap::wire {

/// A node that announces itself in the network.
struct FoundNode {
  std::string name;
  std::string machine;   ///< as DNS-SD names it
  std::string endpoint;  ///< tcp://ADDRESS:PORT
  bool keys = false;     ///< it authenticates hosts

  auto operator<=>(const FoundNode&) const = default;
};

/// Asks Avahi for the nodes that announce themselves by DNS-SD over IPv4; returns after about a second, at most
/// `patience`, in the order of their names. Anybody in the network can announce a node: only its server key proves
/// that it is one. Fails as SystemBus::call.
Result<std::vector<FoundNode>> announced_nodes(Duration patience);

}  // namespace mocap::wire
