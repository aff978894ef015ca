#pragma once

#include <string>
#include <vector>

#include "base/time.h"

namespace mocap::cameras {

/// A GigE Vision or USB3 Vision camera that answered.
struct DiscoveredCamera {
  std::string id;  ///< what Aravis calls it
  std::string serial;
  std::string address;
  std::string mac;  ///< of a GigE camera
  std::string vendor;
  std::string model;
  std::string bus;  ///< GigEVision, USB3Vision
};

/// Asks all networks and the USB who is there; takes a second, in which Aravis opens no camera either. Any thread, and
/// cheap for many at once: who waits while another asks shares the answer.
std::vector<DiscoveredCamera> discover_cameras();

/// "found DA1 (10.0.0.2), DA2 (10.0.0.3)", or "found none".
std::string listed(const std::vector<DiscoveredCamera>& cameras);

/// Whether a GigE Vision camera answers at an IPv4 address, asked by one GVCP discovery command, and again after a
/// third of `patience`. Aravis itself waits some seconds for a camera that is not there.
///
/// Source: GigE Vision 2.0, section 14.1 (DISCOVERY).
bool gige_camera_answers(const std::string& address, Duration patience);

}  // namespace mocap::cameras
