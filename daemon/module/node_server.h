#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/wake_descriptor.h"
#include "model/blob.h"
#include "model/ids.h"

namespace mocap {

/// Whether a camera of a node gives images.
enum class NodeCameraState {
  NotYet,
  Delivering,
  Ended,  ///< no more images come: stopped, failed, or at the end of its recording
};

/// One camera of a node, as its hosts learn it.
struct NodeCamera {
  std::string name;
  std::uint32_t width_px = 0;  ///< 0: no image came yet
  std::uint32_t height_px = 0;
  NodeCameraState state = NodeCameraState::NotYet;
};

enum class NodeSend {
  Done,    ///< to each host that wants the camera, or lost for a host whose queue is full
  NoHost,  ///< nobody wants the camera
  NoRoom,  ///< of a recording alone: the queue of the host is full, send it again later
};

/// Sends the blobs of the cameras of this daemon to fusion hosts.
///
/// The node thread owns a NodeServer and makes all calls; any thread may signal `wake`.
class NodeServer {
 public:
  virtual ~NodeServer() = default;

  /// Answers the calls of hosts; waits at most `patience` for one, or until `wake` is signalled. `cameras`: the state
  /// of each camera, by CameraId.
  virtual void serve(const std::vector<NodeCamera>& cameras, Duration patience) = 0;

  /// Sends one image to the hosts that want its camera.
  virtual NodeSend send(const BlobFrame& frame) = 0;

  /// Whether a host has acknowledged the end of this camera's recording.
  virtual bool acknowledged(CameraId camera) const = 0;

  virtual WakeDescriptor& wake() = 0;
};

}  // namespace mocap
