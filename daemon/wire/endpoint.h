#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace mocap::wire {

/// Only programs of this machine can reach it: ipc, or tcp on 127.x.x.x, ::1 or localhost.
bool is_local(std::string_view endpoint);

/// Says whether `endpoint` may be listened at. Fails with InvalidArgument when it is no tcp://ADDRESS:PORT or
/// ipc://PATH, or is not local while `allow_remote` is false; with Busy when a program already listens at that ipc path
/// (ZeroMQ would push it aside without a word).
Status check_endpoint(const std::string& endpoint, bool allow_remote);

}  // namespace mocap::wire
