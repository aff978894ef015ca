#include "wire/zmq_publisher.h"

#include <fmt/core.h>
#include <zmq.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <optional>
#include <span>
#include <vector>

#include "base/log.h"
#include "base/rate_limit.h"
#include "wire/codec/encode.h"
#include "wire/codec/lite_subject.h"
#include "wire/codec/snapshot_encoder.h"
#include "wire/event_watch.h"
#include "wire/listener.h"
#include "wire/subscriptions.h"

namespace mocap::wire {
namespace {

constexpr const char* kFeed = "feed";
// Time for the subscription messages of one call (decisions/0004): a flood neither delays the feed nor accumulates.
constexpr Duration kServeSubscribersFor = std::chrono::milliseconds(1);
constexpr int kServedPerLook = 64;  // messages between two readings of the clock

}  // namespace

// A message buffer: topic, zero byte, Protobuf. Allocates only when a message is larger than all before.
class Envelope {
 public:
  explicit Envelope(std::string_view topic) : head_(topic.size() + 1), bytes_(topic.begin(), topic.end()) {
    bytes_.push_back(0);
  }

  void set_message(const google::protobuf::MessageLite& message) {
    const std::size_t size = message.ByteSizeLong();
    // 64 spare bytes: varints of growing counters become longer.
    if (head_ + size > bytes_.capacity()) bytes_.reserve(std::bit_ceil(head_ + size + 64));
    bytes_.resize(head_ + size);
    message.SerializeWithCachedSizesToArray(bytes_.data() + head_);
  }
  void set_lite(const Lite& message) {
    bytes_.resize(head_ + kMaxLite_bytes);
    const auto body = std::span(bytes_).subspan(head_).first<kMaxLite_bytes>();
    bytes_.resize(head_ + encode_lite(message, body));
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  // The topic including its zero byte.
  std::string_view topic() const { return {reinterpret_cast<const char*>(bytes_.data()), head_}; }

 private:
  std::size_t head_;
  std::vector<std::uint8_t> bytes_;
};

// Indices of the topics in Subscriptions::set_topics. From kFirstSubject on there is one topic for each subject, then
// the lite topic of each subject, then one for each camera.
enum Topic : std::size_t { kDescription, kSnapshot, kHealth, kEvent, kMarkers, kSightings, kFirstSubject };

struct Channel {
  explicit Channel(std::string_view topic) : envelope(topic) {}
  Envelope envelope;
  std::uint64_t sequence = 0;
};

namespace {

// Length of the send queue of one peer: at least two messages of each topic (decisions/0005). ZeroMQ counts messages of
// all topics together and learns of delivered messages in steps of half a queue, so a shorter queue loses the last
// topics of a subscriber to all topics. The length is set once: ZeroMQ never sends again on a full queue whose length
// is raised.
int queue_for(const PublisherSettings& settings) {
  const std::size_t of_subject = 1 + lite_messages(kMaxBones);
  return std::max(settings.send_queue, static_cast<int>(2 * (kFirstSubject + of_subject * settings.subjects)));
}

v1::Synchronisation synchronisation_of(const Health& health) {
  for (const CameraHealth& camera : health.cameras) {
    if (!camera.synchronised) return v1::SYNCHRONISATION_SOME;
  }
  return v1::SYNCHRONISATION_ALL;
}

}  // namespace

struct ZmqPublisher::Impl {
  Listener listener{kFeed};
  Subscriptions subscriptions;
  EventWatch events;
  std::vector<Channel> channels;  // by Topic
  SnapshotEncoder encoder;
  v1::Health health;
  v1::Preview preview;
  v1::Sightings sightings;
  ZmqMessage request;
  std::int64_t utc_minus_host_ns = utc_minus_host().count();
  std::optional<v1::Synchronisation> synchronisation;
  std::optional<Description> described;
  bool velocities = false;
  RateLimit lite_rate;

  explicit Impl(const PublisherSettings& settings) : velocities(settings.velocities), lite_rate(settings.lite_hz) {}

  std::size_t subjects() const { return described ? described->subjects.size() : 0; }
  std::size_t first_lite() const { return kFirstSubject + subjects(); }
  std::size_t first_preview() const { return first_lite() + subjects(); }

  void name_topics() {
    std::vector<Channel> before(std::make_move_iterator(channels.begin() + kFirstSubject),
                                std::make_move_iterator(channels.end()));
    channels.erase(channels.begin() + kFirstSubject, channels.end());
    for (const Subject& subject : described->subjects) add_topic(kSubjectTopic + subject.name, before);
    for (const Subject& subject : described->subjects) add_topic(kLiteTopic + subject.name, before);
    for (const CameraModel& camera : described->cameras) add_topic(kPreviewTopic + camera.name, before);
    list_topics();
  }

  void add_topic(const std::string& topic, const std::vector<Channel>& before) {
    Channel& channel = channels.emplace_back(topic);
    const auto same =
        std::ranges::find(before, channel.envelope.topic(), [](const Channel& one) { return one.envelope.topic(); });
    if (same != before.end()) channel.sequence = same->sequence;  // the topic goes on
  }

  void list_topics() {
    std::vector<std::string> topics;
    for (const Channel& channel : channels) topics.emplace_back(channel.envelope.topic());
    subscriptions.set_topics(std::move(topics));
  }

  // Processes subscriptions and connection events. ZeroMQ delivers nothing, not even the welcome message, before this
  // call.
  void serve() {
    const Timestamp begun = host_now();
    listener.serve(begun);
    forget_gone();
    for (int i = 1; i % kServedPerLook != 0 || host_now() - begun < kServeSubscribersFor; ++i) {
      if (!request.receive(listener.socket())) {
        forget_gone();
        return listener.heard_all();
      }
      take_request();
    }
  }

  void forget_gone() {
    for (const int connection : listener.gone()) subscriptions.forget(connection);
  }

  void take_request() {
    int connection = request.connection();
    if (listener.gone().contains(connection)) connection = -1;
    if (connection >= 0) listener.note_user(connection, request.user());
    switch (subscriptions.take(request.bytes(), connection)) {
      case Subscriptions::Verdict::Fine: return;
      case Subscriptions::Verdict::TooMany: return listener.cut(connection, "it exceeds the limit of subscriptions");
      case Subscriptions::Verdict::NoSubscription:
        return listener.cut(connection, "it sent a message that is not a subscription");
    }
  }

  Status send(const Channel& channel) { return send(channel.envelope.bytes()); }

  Status send(std::span<const std::uint8_t> bytes) {
    if (zmq_send(listener.socket().get(), bytes.data(), bytes.size(), ZMQ_DONTWAIT) >= 0) return {};
    return zmq_failure("feed: cannot send");
  }

  // Omits what clients can compute from the description.
  Parts feed_parts(const Snapshot& from) const {
    Parts parts;
    parts.local_positions = !described || !stands_at_rest_offsets(from, *described);
    parts.velocities = velocities;
    return parts;
  }

  Status send_snapshot(const Snapshot& from, std::size_t topic, const Parts& parts) {
    Channel& channel = channels[topic];
    const std::uint64_t sequence = channel.sequence++;
    if (!subscriptions.wanted(topic)) return {};
    return send(encoder.encode(channel.envelope.topic(), from, parts, {sequence, utc_minus_host_ns, synchronisation}));
  }

  Status send_snapshots(const Snapshot& from) {
    const Parts whole = feed_parts(from);
    if (Status sent = send_snapshot(from, kSnapshot, whole); !sent) return sent;
    Parts markers = whole;
    markers.views = markers.bones = false;
    if (Status sent = send_snapshot(from, kMarkers, markers); !sent) return sent;
    if (Status sent = send_sightings(from); !sent) return sent;
    Parts one = whole;
    one.views = one.unlabelled = false;
    for (std::size_t topic = kFirstSubject; topic < first_lite(); ++topic) {
      one.subject = SubjectId{static_cast<std::uint32_t>(topic - kFirstSubject)};
      if (Status sent = send_snapshot(from, topic, one); !sent) return sent;
    }
    return {};
  }

  Status send_sightings(const Snapshot& from) {
    Channel& channel = channels[kSightings];
    const std::uint64_t sequence = channel.sequence++;
    if (!subscriptions.wanted(kSightings)) return {};
    encode(from, sightings);
    sightings.set_sequence(sequence);
    channel.envelope.set_message(sightings);
    return send(channel);
  }

  Status send_lites(const Snapshot& from) {
    if (!lite_rate.admits(from.instants.exposed_at)) return {};
    for (std::size_t i = 0; i < subjects(); ++i) {
      const LiteSubject subject(from, SubjectId{static_cast<std::uint32_t>(i)}, *described);
      if (Status sent = send_lite(subject, first_lite() + i); !sent) return sent;
    }
    return {};
  }

  Status send_lite(const LiteSubject& subject, std::size_t topic) {
    Channel& channel = channels[topic];
    for (std::size_t i = 0; i < subject.messages(); ++i) {
      const std::uint64_t sequence = channel.sequence++;
      if (!subscriptions.wanted(topic)) continue;
      Lite lite = subject.message(i, utc_minus_host_ns);
      lite.sequence = static_cast<std::uint32_t>(sequence);
      channel.envelope.set_lite(lite);
      if (Status sent = send(channel); !sent) return sent;
    }
    return {};
  }

  // Sends one event in each call, so that several events at once do not fill the send queue (decisions/0005).
  Status send_event() {
    if (events.unsent().empty()) return {};
    channels[kEvent].envelope.set_message(events.unsent().front());
    const Status sent = send(channels[kEvent]);
    if (sent) events.remove_oldest();
    return sent;
  }
};

ZmqPublisher::ZmqPublisher(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ZmqPublisher::~ZmqPublisher() = default;

const std::string& ZmqPublisher::endpoint() const { return impl_->listener.endpoints().front(); }
const std::vector<std::string>& ZmqPublisher::endpoints() const { return impl_->listener.endpoints(); }

Result<std::unique_ptr<ZmqPublisher>> ZmqPublisher::open(const PublisherSettings& settings, AuditTrail* audit) {
  if (settings.send_queue < 1 || settings.send_queue > 1000) {
    return Error{ErrorCode::InvalidArgument, fmt::format("send_queue is {}, expected 1 to 1000", settings.send_queue)};
  }
  auto impl = std::make_unique<Impl>(settings);
  for (const char* topic :
       {kDescriptionTopic, kSnapshotTopic, kHealthTopic, kEventTopic, kMarkersTopic, kSightingsTopic}) {
    impl->channels.emplace_back(topic);
  }
  impl->list_topics();
  ListenSettings listen;
  listen.endpoints = {settings.endpoint};
  listen.endpoints.insert(listen.endpoints.end(), settings.more_endpoints.begin(), settings.more_endpoints.end());
  listen.allow_remote = settings.allow_remote;
  listen.curve = settings.curve;
  listen.audit = audit;
  listen.max_connections = settings.max_connections;
  if (const Status listening = impl->listener.open(ZMQ_XPUB, queue_for(settings), listen); !listening) {
    return listening.error();
  }
  // Deliver every subscription, not only the first to a prefix, so that each connection's user is known.
  if (const Status set = impl->listener.socket().set(ZMQ_XPUB_VERBOSE, 1); !set) return set.error();
  return std::unique_ptr<ZmqPublisher>(new ZmqPublisher(std::move(impl)));
}

Status ZmqPublisher::describe(const Description& description) {
  Channel& channel = impl_->channels[kDescription];
  channel.envelope.set_message(encode(description));
  impl_->described = description;
  impl_->name_topics();
  const auto& bytes = impl_->channels[kDescription].envelope.bytes();
  if (zmq_setsockopt(impl_->listener.socket().get(), ZMQ_XPUB_WELCOME_MSG, bytes.data(), bytes.size()) != 0) {
    return zmq_failure("feed: cannot set the welcome message");
  }
  impl_->serve();
  impl_->events.update(description, host_now());
  if (Status sent = impl_->send(impl_->channels[kDescription]); !sent) return sent;
  return impl_->send_event();
}

Status ZmqPublisher::publish(Snapshot& snapshot) {
  impl_->serve();
  Instants& instants = snapshot.instants;
  if (instants.received_at && instants.detected_at && instants.fused_at) instants.sent_at = host_now();
  if (Status sent = impl_->send_snapshots(snapshot); !sent) return sent;
  if (Status sent = impl_->send_lites(snapshot); !sent) return sent;
  impl_->events.update(snapshot);
  return impl_->send_event();
}

Status ZmqPublisher::report(const Health& health) {
  impl_->utc_minus_host_ns = utc_minus_host().count();
  impl_->synchronisation = synchronisation_of(health);
  impl_->serve();
  impl_->subscriptions.refill();
  if (impl_->described) {
    if (Status sent = impl_->send(impl_->channels[kDescription]); !sent) return sent;
  }
  encode(health, impl_->health);
  impl_->health.set_utc_minus_host_ns(impl_->utc_minus_host_ns);
  impl_->channels[kHealth].envelope.set_message(impl_->health);
  if (Status sent = impl_->send(impl_->channels[kHealth]); !sent) return sent;
  impl_->events.update(health);
  return impl_->send_event();
}

void ZmqPublisher::serve() {
  impl_->serve();
  static_cast<void>(impl_->send_event());
}

bool ZmqPublisher::wants_preview(CameraId camera) const {
  const std::size_t topic = impl_->first_preview() + camera.value;
  return topic < impl_->channels.size() && impl_->subscriptions.wanted(topic);
}

Status ZmqPublisher::send_preview(const Preview& preview) {
  if (!wants_preview(preview.head.camera)) return {};
  Channel& channel = impl_->channels[impl_->first_preview() + preview.head.camera.value];
  encode(preview, impl_->preview);
  impl_->preview.set_sequence(channel.sequence++);
  channel.envelope.set_message(impl_->preview);
  return impl_->send(channel);
}

FeedHealth ZmqPublisher::feed() const {
  FeedHealth figures = impl_->listener.figures();
  figures.subscriptions = static_cast<std::uint32_t>(impl_->subscriptions.count());
  return figures;
}

Result<std::unique_ptr<Publisher>> make_zmq_publisher(const PublisherSettings& settings, AuditTrail* audit) {
  Result<std::unique_ptr<ZmqPublisher>> opened = ZmqPublisher::open(settings, audit);
  if (!opened) return opened.error();
  return std::unique_ptr<Publisher>(std::move(*opened));
}

}  // namespace mocap::wire
