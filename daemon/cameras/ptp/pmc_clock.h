#pragma once

#include <memory>

#include "cameras/ptp/ptp_settings.h"
#include "module/ptp_clock.h"

namespace mocap::cameras {

/// The clock that ptp4l measures or disciplines: CLOCK_REALTIME with time stamps of software; with those of hardware
/// phc2sys must carry the time of the network card over to CLOCK_REALTIME. Each measurement runs `pmc` (linuxptp),
/// which asks ptp4l over its socket. measure() fails with NotFound (the socket does not exist, nobody answers there, no
/// master), Io (this user may not write to the socket), and as ChildProcess::output_of.
std::unique_ptr<PtpClock> make_pmc_clock(const PtpSettings& settings);

}  // namespace mocap::cameras
