#pragma once

#include <string>

namespace mocap::watch {

struct DoctorOptions {
  std::string endpoint;
  std::string server_key;  ///< CURVE: the daemon's public key or a file with it; empty: no encryption
  std::string secret_key;  ///< our own key pair, a file of mocapctl keys new
  double seconds = 4.0;    ///< longest observation; ends earlier if the answer cannot change
};

struct DoctorWord {
  int exit_code =
      0;  ///< 0: no fault; 10 + enum mocap_diagnosis; 40: a camera is idle; 41: no timecode; 64: an option is invalid
  std::string sentence;  ///< the fault and the remedy in one line
};

/// Subscribes with the C client, as a plugin does, and finds out why no data arrives, or which camera contributes
/// nothing to the 3D markers (idle_cameras). Blocks for up to `seconds`.
DoctorWord ask_doctor(const DoctorOptions& options);

}  // namespace mocap::watch
