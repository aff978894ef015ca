#pragma once

#include <string>

namespace mocap::sim {

// Registers beside those of Aravis's fake camera.
inline constexpr unsigned kPtpEnable = 0x9000;
inline constexpr unsigned kPtpStatus = 0x9004;
inline constexpr unsigned kPtpOffset_ns = 0x9008;
inline constexpr unsigned kPtpLatch = 0x900c;
inline constexpr unsigned kTemperature = 0x9010;
inline constexpr unsigned kTriggerDelay_us = 0x9014;

// Values of kPtpStatus.
inline constexpr unsigned kPtpDisabled = 1;
inline constexpr unsigned kPtpSlave = 9;

/// Adds to the GenICam description of Aravis's fake camera what the registers above are.
std::string with_more_features(std::string xml);

}  // namespace mocap::sim
