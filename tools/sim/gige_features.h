#pragma once

#include <cstdint>
#include <string>

namespace mocap::sim {

// Registers of the standard that Aravis's fake camera does not implement.
inline constexpr unsigned kActionDeviceKey = 0x090c;
inline constexpr unsigned kTimestampLatch = 0x0944;
inline constexpr unsigned kTimestampHigh = 0x0948;
inline constexpr unsigned kTimestampLow = 0x094c;
inline constexpr unsigned kActionGroupKey = 0x9800;
inline constexpr unsigned kActionGroupMask = 0x9804;

// Own registers, at addresses that Aravis's fake camera does not use.
inline constexpr unsigned kPtpEnable = 0x9000;
inline constexpr unsigned kPtpStatus = 0x9004;
inline constexpr unsigned kPtpOffset_ns = 0x9008;
inline constexpr unsigned kPtpLatch = 0x900c;
inline constexpr unsigned kTemperature = 0x9010;
inline constexpr unsigned kTriggerDelay_us = 0x9014;
inline constexpr unsigned kChunkMode = 0x9020;
inline constexpr unsigned kChunkBytes = 0x9024;         ///< number of chunk bytes behind each image
inline constexpr unsigned kChunkTimestamp = 0x9030;     ///< 1: the chunk is enabled
inline constexpr unsigned kChunkExposureTime = 0x9034;  ///< 1: the chunk is enabled
inline constexpr unsigned kChunkFrameId = 0x9038;

// Values of kPtpStatus.
inline constexpr unsigned kPtpDisabled = 1;
inline constexpr unsigned kPtpListening = 4;
inline constexpr unsigned kPtpSlave = 9;

// Chunk ids.
inline constexpr std::uint32_t kTimestampChunk = 0x2001;
inline constexpr std::uint32_t kExposureChunk = 0x2002;
inline constexpr std::uint32_t kFrameIdChunk = 0x2003;

// Value of the trigger source, after Line0 and Software of Aravis's fake camera.
inline constexpr unsigned kTriggeredByAction = 2;

/// Adds the features of the registers above to the GenICam description of Aravis's fake camera.
std::string with_more_features(std::string xml);

}  // namespace mocap::sim
