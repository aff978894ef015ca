#pragma once

namespace mocap {

/// Exit codes of all programs, as in sysexits.h, so that a service manager can distinguish a
/// fault that a restart cures from one that an operator must cure.
enum ExitCode : int {
  kExitOk = 0,
  kExitUsage = 64,        ///< the command line
  kExitData = 65,         ///< a recording, an image or a rig is refused
  kExitNoInput = 66,      ///< an input file does not exist
  kExitUnavailable = 69,  ///< a needed resource is missing or in use: a port, a camera
  kExitSoftware = 70,     ///< a bug
  kExitCannotWrite = 73,  ///< an output file cannot be written
  kExitNoPerm = 77,       ///< the role of the caller may not do this
  kExitConfig = 78,       ///< a configuration, rig or marker-set file
};

}  // namespace mocap
