#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "wire/curve_keys.h"
#include "wire/node_link.h"

namespace mocap::ctl {

struct NodeAddress {
  std::string endpoint;
  wire::ClientKeys keys = {};
};

/// The statement of a node about itself.
struct NodeAnswer {
  std::string endpoint;
  std::optional<wire::NodeEcho> echo;  ///< the one with the shortest round trip
  std::string fault;                   ///< why there is no echo, with the remedy
};

/// Time on the network of a call and its echo, without the time on the node.
Duration round_trip(const wire::NodeEcho& echo);

/// Calls all nodes at once, each several times; returns early when all have answered, at most after `patience`. Takes
/// no images, so a node that plays a recording keeps them for its host.
std::vector<NodeAnswer> probe_nodes(const std::vector<NodeAddress>& nodes, Duration patience);

}  // namespace mocap::ctl
