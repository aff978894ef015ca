#include "cameras/ptp/ptp_settings.h"

namespace mocap::cameras {

void declare_keys(KeyVisitor& keys, PtpSettings& ptp) {
  keys.text("socket", ptp.socket,
            {.help = "socket of ptp4l (its uds_address), which pmc asks where it exists; \"\": PTP is not used"});
}

}  // namespace mocap::cameras
