#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "cameras/driver_settings.h"

namespace mocap::cameras {

/// A camera of a node: another mocapd with a section [node]. Help, units and ranges: the table in node_settings.cpp.
struct NodeCameraSettings {
  static constexpr MakeName kMake{"node", "a camera of another mocapd, which detects and tracks its blobs", "remote"};

  std::string endpoint;
  std::string camera;                ///< empty: the same name
  std::string server_key;            ///< the key itself, or a file with it; empty: no keys
  std::filesystem::path secret_key;  ///< the file of the host's own key pair
  bool allow_remote = false;
  bool recorded = false;
  double rate_hz = 0.0;  ///< 0: unknown
};

void declare_keys(KeyVisitor& keys, NodeCameraSettings& camera);
std::vector<KeyFault> faults_of(const NodeCameraSettings& camera);
CameraFacts facts_of(const NodeCameraSettings& camera, const std::string& camera_name);

}  // namespace mocap::cameras
