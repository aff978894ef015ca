#pragma once

namespace mocap::wire {

/// Rights of a client.
enum class Role {
  Viewer,    ///< receives the feed and may ask for the state
  Operator,  ///< may also change the state
};

const char* name_of(Role role) noexcept;

}  // namespace mocap::wire
