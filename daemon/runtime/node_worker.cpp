#include "runtime/node_worker.h"

#include <utility>

#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

// A host of a recording whose queue is full, or that has not called yet, is tried again after this time.
constexpr Duration kTryHostAgain = std::chrono::milliseconds(1);

NodeCameraState state_of(Delivery delivery) {
  switch (delivery) {
    case Delivery::NotYet: return NodeCameraState::NotYet;
    case Delivery::Delivering: return NodeCameraState::Delivering;
    case Delivery::Ended: return NodeCameraState::Ended;
  }
  return NodeCameraState::NotYet;
}

}  // namespace

NodeWorker::NodeWorker(std::unique_ptr<NodeServer> server, bool lossless)
    : server_(std::move(server)), lossless_(lossless) {}

void NodeWorker::change(std::vector<CameraChannel*> cameras, const Description& description) {
  channels_ = std::move(cameras);
  cameras_.clear();
  for (const CameraModel& camera : description.cameras) cameras_.push_back({.name = camera.name});
}

void NodeWorker::run(const std::stop_token& stop) {
  bool waits = false;
  while (!stop.stop_requested()) {
    look_at_cameras();
    server_->serve(cameras_, waits ? kTryHostAgain : kStopCheckPeriod);
    waits = false;
    for (std::uint32_t i = 0; i < channels_.size(); ++i) waits = !send_waiting(CameraId{i}) || waits;
    if (lossless_ && all_acknowledged()) ended_.store(true, std::memory_order_release);
  }
}

// A camera has ended for its hosts when they have all its images.
void NodeWorker::look_at_cameras() {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    CameraChannel& channel = *channels_[i];
    const Delivery delivery = channel.delivery.load(std::memory_order_acquire);
    const bool images_wait = channel.to_node->front() != nullptr;
    cameras_[i].width_px = channel.width_px.load(std::memory_order_acquire);
    cameras_[i].height_px = channel.height_px.load(std::memory_order_relaxed);
    cameras_[i].state = images_wait ? NodeCameraState::Delivering : state_of(delivery);
  }
}

// Returns false if images of a recording must wait.
bool NodeWorker::send_waiting(CameraId camera) {
  CameraChannel& channel = *channels_[camera.value];
  while (BlobFrame* oldest = channel.to_node->front()) {
    oldest->camera = camera;
    const NodeSend sent = server_->send(*oldest);
    if (lossless_ && sent != NodeSend::Done) return false;
    channel.to_node->pop();
    if (lossless_) channel.node_room.signal();
  }
  return true;
}

bool NodeWorker::all_acknowledged() const {
  for (std::uint32_t i = 0; i < cameras_.size(); ++i) {
    if (cameras_[i].state != NodeCameraState::Ended || !server_->acknowledged(CameraId{i})) return false;
  }
  return true;
}

}  // namespace mocap::runtime
