#pragma once

#include <cstddef>

/// Register addresses of the simulated USB3 Vision camera.
namespace mocap::sim::usb3 {

// Technology agnostic bootstrap registers (GenCP 1.3, section 5).
inline constexpr std::size_t kVersion = 0x0000, kManufacturer = 0x0004, kModel = 0x0044, kFamily = 0x0084,
                             kDeviceVersion = 0x00c4, kSerial = 0x0144, kUserName = 0x0184, kCapability = 0x01c4,
                             kResponseTime_ms = 0x01cc, kManifest = 0x01d0, kSbrm = 0x01d8,
                             kTimestampIncrement_ns = 0x01fc;
// Technology specific ones (USB3 Vision 1.0.1, section 4).
inline constexpr std::size_t kSbrmAt = 0x1000, kU3vVersion = kSbrmAt, kMostCommand = kSbrmAt + 0x14,
                             kMostAcknowledge = kSbrmAt + 0x18, kStreamChannels = kSbrmAt + 0x1c,
                             kSirm = kSbrmAt + 0x20, kSirmBytes = kSbrmAt + 0x28, kSpeed = kSbrmAt + 0x40;
inline constexpr std::size_t kSirmAt = 0x1100, kStreamEnable = kSirmAt + 0x04, kNeedsPayload = kSirmAt + 0x08,
                             kNeedsLeader = kSirmAt + 0x10, kNeedsTrailer = kSirmAt + 0x14, kSirmEnd = kSirmAt + 0x30;
inline constexpr std::size_t kManifestAt = 0x1800;
// Device-specific features: 32 bits each, except rate, exposure and gain, which are doubles.
inline constexpr std::size_t kFeatures = 0x2000, kWidth = 0x2000, kHeight = 0x2004, kLeft = 0x2008, kTop = 0x200c,
                             kSensorWidth = 0x2010, kSensorHeight = 0x2014, kPixelFormat = 0x2018, kPayload = 0x201c,
                             kAcquisitionMode = 0x2020, kStart = 0x2024, kStop = 0x2028, kTriggerSelector = 0x202c,
                             kTriggerMode = 0x2030, kTriggerSource = 0x2034, kTriggerActivation = 0x2038,
                             kTriggerSoftware = 0x203c, kAcquiring = 0x2040, kTemperature = 0x2044, kRate_hz = 0x2050,
                             kExposure_us = 0x2058, kGain_db = 0x2060, kFeaturesEnd = 0x2068;
inline constexpr std::size_t kDescriptionAt = 0x10000;

inline constexpr std::size_t kLeaderBytes = 52, kTrailerBytes = 32;

}  // namespace mocap::sim::usb3
