#pragma once

#include <string>

namespace mocap::watch {

struct DoctorOptions {
  std::string endpoint;
  std::string server_key;  ///< CURVE: the daemon's public key or a file with it; empty: none
  std::string key;         ///< our own, a file of mocapctl keys new
  double seconds = 4.0;    ///< how long it may look; ends sooner when the answer cannot change
};

struct DoctorWord {
  int exit_code = 0;     ///< 0: well; 10 and the number of enum mocap_diagnosis; 64: an option is wrong
  std::string sentence;  ///< what is wrong and what helps, in one line
};

/// Listens as a plugin would, through the C client, and says why it gets no data. Blocks.
DoctorWord ask_doctor(const DoctorOptions& options);

}  // namespace mocap::watch
