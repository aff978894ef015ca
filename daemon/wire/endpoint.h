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

/// Binds a socket to `endpoint` for an instant. Fails as Listener::open does if this process could not listen there
/// once it has closed its endpoints `own`: nothing is tried at these, and at their ports only the address.
Status try_endpoint(const std::string& endpoint, const std::vector<std::string>& own);

/// Returns whether a program listens at this ipc endpoint now. ZeroMQ's bind would replace its socket file silently.
bool is_taken_ipc(const std::string& endpoint);

}  // namespace mocap::wire
