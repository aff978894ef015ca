#pragma once

#include <atomic>
#include <memory>
#include <stop_token>
#include <vector>

#include "model/description.h"
#include "module/node_server.h"
#include "runtime/camera/camera_worker.h"
#include "runtime/pausable.h"

namespace mocap::runtime {

/// The node's thread: sends the blobs of all cameras to fusion hosts and answers their calls. An image of a camera that
/// no host wants is dropped; an image of a recording waits for its host.
class NodeWorker : public Pausable {
 public:
  NodeWorker(std::unique_ptr<NodeServer> server, bool lossless);

  /// The cameras of a configuration, each with a `to_node` queue. The channels outlive the worker. Call while no thread
  /// is in `run`.
  void change(std::vector<CameraChannel*> cameras, const Description& description);

  /// The loop; returns when stopped.
  void run(const std::stop_token& stop);

  /// Whether the hosts have every image of all cameras; only in a replay, and not before every camera has ended.
  bool ended() const noexcept { return ended_.load(std::memory_order_acquire); }

  /// For the camera threads, when they pushed an image.
  WakeDescriptor& wake_descriptor() { return server_->wake(); }
  void wake() { server_->wake().signal(); }

 private:
  void look_at_cameras();
  bool send_waiting(CameraId camera);
  bool all_acknowledged() const;

  std::unique_ptr<NodeServer> server_;
  bool lossless_;
  std::vector<CameraChannel*> channels_;
  std::vector<NodeCamera> cameras_;  // by CameraId
  std::atomic<bool> ended_{false};
};

}  // namespace mocap::runtime
