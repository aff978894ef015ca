#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "module/publisher.h"
#include "wire/wire_settings.h"

namespace mocap::wire {

/// The topics of the feed. A message is one part: topic, a zero byte, Protobuf (proto/mocap/v1).
inline constexpr const char* kSnapshotTopic = "snapshot";
inline constexpr const char* kDescriptionTopic = "description";
inline constexpr const char* kHealthTopic = "health";
inline constexpr const char* kEventTopic = "event";
inline constexpr const char* kMarkersTopic = "markers";
inline constexpr const char* kSubjectTopic = "subject/";  ///< and the subject's name

/// Sends the feed over a ZeroMQ XPUB socket. Listeners cost it a copy each and can never make it wait: what a slow one
/// does not take is dropped for it alone, and a hostile one is cut off (wire/listener.h). A topic that nobody listens
/// to is not made.
class ZmqPublisher final : public Publisher {
 public:
  /// Listens. Fails with InvalidArgument (an endpoint that is none, or that other machines can reach though there is no
  /// CURVE and `allow_remote` is false; a key file that is none), NotFound (no such address here, no such file), Busy
  /// (somebody else listens there) and Io.
  static Result<std::unique_ptr<ZmqPublisher>> open(const PublisherSettings& settings);

  /// Lets go of the endpoints; waits 100 ms at most for what is still on its way.
  ~ZmqPublisher() override;

  Status describe(const Description& description) override;
  Status publish(Snapshot& snapshot) override;
  Status report(const Health& health) override;
  void serve() override;
  FeedHealth feed() const override;

  /// Where it listens, with the true port: the first of them, and all.
  const std::string& endpoint() const;
  const std::vector<std::string>& endpoints() const;

 private:
  struct Impl;
  explicit ZmqPublisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// `ZmqPublisher::open` for those who need no more than a Publisher.
Result<std::unique_ptr<Publisher>> make_zmq_publisher(const PublisherSettings& settings);

}  // namespace mocap::wire
