#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace mocap::wire {

/// Only programs of this machine can reach it: ipc, or tcp on 127.x.x.x, ::1 or localhost.
bool is_local(std::string_view endpoint);

/// Says whether `endpoint` may be listened at; touches nothing. Fails with InvalidArgument when it is no
/// tcp://ADDRESS:PORT or ipc://PATH, or is not local while `allow_remote` is false.
Status check_endpoint(const std::string& endpoint, bool allow_remote);

/// Whether a program listens at this ipc endpoint now: ZeroMQ's own bind would push it aside without a word.
bool is_taken_ipc(const std::string& endpoint);

}  // namespace mocap::wire
