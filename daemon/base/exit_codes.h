#pragma once

namespace mocap {

/// How a program of ours ends: the kind of failure, as sysexits.h numbers it, so that a service manager can tell a
/// fault that a restart cures from one that an operator must cure.
enum ExitCode : int {
  kExitOk = 0,
  kExitUsage = 64,        ///< the command line
  kExitUnavailable = 69,  ///< something that we need is taken or not there: a port, a camera
  kExitSoftware = 70,     ///< we are wrong
  kExitConfig = 78,       ///< a configuration, rig or marker-set file
};

}  // namespace mocap
