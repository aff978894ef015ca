#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "module/audit_trail.h"
#include "module/publisher.h"
#include "wire/wire_settings.h"

namespace mocap::wire {

/// The topics of the feed. A message is one part: topic, a zero byte, Protobuf (proto/mocap/v1); of the topics
/// lite/NAME: topic, a zero byte, the layout of proto/lite.
inline constexpr const char* kSnapshotTopic = "snapshot";
inline constexpr const char* kDescriptionTopic = "description";
inline constexpr const char* kHealthTopic = "health";
inline constexpr const char* kEventTopic = "event";
inline constexpr const char* kMarkersTopic = "markers";
inline constexpr const char* kSightingsTopic = "sightings";
inline constexpr const char* kSubjectTopic = "subject/";  ///< followed by the subject's name
inline constexpr const char* kLiteTopic = "lite/";        ///< followed by the subject's name
inline constexpr const char* kPreviewTopic = "preview/";  ///< followed by the camera's name

/// Sends the feed over a ZeroMQ XPUB socket. Sending never blocks: messages that a slow subscriber does not receive are
/// dropped for this subscriber alone, and a hostile peer is disconnected (wire/listener.h). A topic without subscribers
/// is not encoded.
class ZmqPublisher final : public Publisher {
 public:
  /// Binds to the endpoints. Fails with InvalidArgument (a malformed endpoint or key file; an endpoint that other
  /// machines can reach without CURVE while `allow_remote` is false), NotFound (this machine has no such address; no
  /// such file), Busy (another program listens there) and Io.
  static Result<std::unique_ptr<ZmqPublisher>> open(const PublisherSettings& settings, AuditTrail* audit = nullptr);

  /// Closes the endpoints; waits at most 100 ms until queued messages are sent.
  ~ZmqPublisher() override;

  Status describe(const Description& description) override;
  Status publish(Snapshot& snapshot) override;
  Status report(const Health& health) override;
  void serve() override;
  bool wants_preview(CameraId camera) const override;
  Status send_preview(const Preview& preview) override;
  FeedHealth feed() const override;

  /// The first endpoint and all endpoints, with the port numbers in use.
  const std::string& endpoint() const;
  const std::vector<std::string>& endpoints() const;

 private:
  struct Impl;
  explicit ZmqPublisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Does the same as `ZmqPublisher::open`; returns the interface.
Result<std::unique_ptr<Publisher>> make_zmq_publisher(const PublisherSettings& settings, AuditTrail* audit = nullptr);

}  // namespace mocap::wire
