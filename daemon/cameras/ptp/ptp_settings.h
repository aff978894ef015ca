#pragma once

#include <string>

#include "base/key_visitor.h"

namespace mocap::cameras {

/// [ptp]: the clocks of nodes and of their fusion host by PTP. Help: ptp_settings.cpp.
struct PtpSettings {
  std::string socket = "/run/ptp4l";  ///< empty: PTP is not used

  bool operator==(const PtpSettings&) const = default;
};

void declare_keys(KeyVisitor& keys, PtpSettings& ptp);

}  // namespace mocap::cameras
