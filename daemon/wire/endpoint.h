#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace mocap::wire {

/// Returns whether only programs on this machine can reach `endpoint`: ipc, or tcp on 127.x.x.x, ::1, lo or localhost.
bool is_local(std::string_view endpoint);

/// Checks whether the daemon may listen at `endpoint`; opens nothing. Fails with InvalidArgument if `endpoint` is
/// neither tcp://ADDRESS:PORT nor ipc://PATH, or if it is not local and `allow_remote` is false.
Status check_endpoint(const std::string& endpoint, bool allow_remote);

/// Binds a socket to all `endpoints` for an instant. Fails as Listener::open does if this process could not listen
/// there once it has closed its endpoints `own`: nothing is tried at these, at their ports only the address, and of an
/// ipc endpoint whether nobody listens there and this process may write in its folder. Fails with Busy if two of the
/// endpoints are the same place.
Status try_endpoints(const std::vector<std::string>& endpoints, const std::vector<std::string>& own);

/// Returns whether a program listens at this ipc endpoint now. ZeroMQ's bind would replace its socket file silently.
bool is_taken_ipc(const std::string& endpoint);

}  // namespace mocap::wire
