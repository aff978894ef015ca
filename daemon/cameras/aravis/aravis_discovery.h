#pragma once

#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "base/time.h"

namespace mocap::cameras {

/// A GigE Vision or USB3 Vision camera that answered.
struct DiscoveredCamera {
  std::string id;  ///< Aravis's identifier
  std::string serial;
  std::string address;
  std::string mac;  ///< of a GigE camera
  std::string vendor;
  std::string model;
  std::string bus;  ///< GigEVision, USB3Vision
};

/// Searches all networks and the USB. Takes about 1 s, during which Aravis opens no camera. Any thread; a call that
/// waits for another thread's search returns the result of that search.
std::vector<DiscoveredCamera> discover_cameras();

/// The cameras of discover_cameras() as CameraMake::discover returns them: bus, serial, address, mac, vendor and model.
std::vector<KeyPairs> find_aravis_cameras();

/// "found DA1 (10.0.0.2), DA2 (10.0.0.3)", or "found none".
std::string listed(const std::vector<DiscoveredCamera>& cameras);

/// Returns whether a GigE Vision camera answers at an IPv4 address. Sends one GVCP discovery command, and a second one
/// after a third of `patience`. Aravis itself waits some seconds for an absent camera.
///
/// Source: GigE Vision 2.0, section 14.1 (DISCOVERY).
bool gige_camera_answers(const std::string& address, Duration patience);

}  // namespace mocap::cameras
