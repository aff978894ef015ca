#pragma once

#include <string>

#include "base/result.h"
#include "base/time.h"
#include "model/control.h"
#include "wire/curve_keys.h"

namespace mocap::wire {

/// The endpoint at which this machine reaches the requests of a node. `control`: as the node has bound it; `node`: its
/// [node] endpoint as this machine reaches it. Fails with Unsupported, with the remedy, if the node receives no
/// requests or none of this machine.
Result<std::string> control_of_node(const std::string& control, const std::string& node);

/// Sends a request to the daemon at `endpoint` and waits at most `patience` for its answer. Fails with the daemon's
/// message if it does not carry out the request, and as ControlClient::ask. Opens a connection for the request alone.
Status forward_request(const std::string& endpoint, const ClientKeys& keys, const ControlRequest& request,
                       Duration patience);

}  // namespace mocap::wire
