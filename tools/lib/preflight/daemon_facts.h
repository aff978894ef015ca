#pragma once

#include <filesystem>

#include "base/result.h"
#include "lib/preflight/preflight.h"
#include "wire/zmq_control.h"

namespace mocap::preflight {

/// Asks the daemon twice, two reports of health apart: takes 2.2 s. Fails with the reason of the daemon.
Result<PreflightFacts> ask_daemon(wire::ControlClient& client);

/// Adds what only files of this machine tell. An empty or unreadable path: the fact stays unknown.
void look_at_files(const std::filesystem::path& takes, const std::filesystem::path& rig_file, PreflightFacts& facts);

/// The finding about a daemon that does not answer.
Finding silent_daemon(const Error& error);

}  // namespace mocap::preflight
