#include "cameras/node/node_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "base/log.h"
#include "cameras/clock/ptp_offset.h"
#include "cameras/node/node_clock.h"
#include "wire/forward_request.h"
#include "wire/node_link.h"
#include "wire/node_protocol.h"

namespace mocap::cameras {
namespace {

// Module interface: start() may wait "some tenths of a second". A node answers within a few milliseconds.
constexpr Duration kAnswerPatience = std::chrono::milliseconds(300);
// Eight calls or more without an answer: also a node whose processors are all busy answers one of them.
constexpr Duration kNodeSilent = std::chrono::seconds(2);
// The node's camera restarts with the new values. Images wait meanwhile.
constexpr Duration kAdjustPatience = std::chrono::seconds(3);
// Images are left out while the clock is uncertain; if it stays so for this time, the camera fails with the reason.
constexpr Duration kUncertainFor = std::chrono::seconds(1);

class RemoteCamera final : public BlobCamera {
 public:
  RemoteCamera(CameraId id, std::string name, NodeCameraSettings settings, const CameraSurroundings& surroundings)
      : id_(id),
        name_(std::move(name)),
        settings_(std::move(settings)),
        counters_(surroundings.counters),
        window_(surroundings.window),
        ptp_(surroundings.ptp),
        clock_(surroundings.node_clocks != nullptr ? surroundings.node_clocks->of(settings_.endpoint) : own_clock_) {
    clock_.join();
  }
  ~RemoteCamera() override { clock_.leave(); }
  RemoteCamera(const RemoteCamera&) = delete;
  RemoteCamera& operator=(const RemoteCamera&) = delete;

  Status start() override;
  Result<Frame> next(Duration patience) override;
  void stop() noexcept override { running_ = false; }
  // The values of the node's camera are not known here, so no value is restored after a failure.
  std::optional<CameraAdjustment> adjustment() const override { return CameraAdjustment{}; }
  Status adjust(const CameraAdjustment& to) override;
  const Blobs& blobs() const override { return link_->image().blobs.blobs; }

 private:
  const std::string& name_on_node() const { return settings_.camera.empty() ? name_ : settings_.camera; }
  Result<wire::ClientKeys> keys() const {
    return wire::load_client_keys(settings_.server_key, settings_.secret_key.string());
  }
  Status open_link();
  Status find_node(Timestamp until);
  Status judge_echo() const;
  Result<bool> follow(wire::NodeNews news);
  void follow_echo();
  std::optional<MeasuredLine> by_ptp() const;
  void tell_source(PeerLineSource source);
  Result<bool> follow_image();
  bool map_times(BlobFrame& image);
  void map_tracks(Blobs& blobs);
  void count_lost(std::uint64_t until);
  bool clock_is_certain(Timestamp now) const;
  void call_when_due(Duration period);
  void waited_for(Duration span);
  void heard_something();
  Frame frame_of_image();
  std::string node() const;
  Error silent(ErrorCode code) const;
  Error uncertain(ErrorCode code) const;
  Error error(ErrorCode code, const std::string& what) const {
    return {code, fmt::format("camera '{}': {}", name_, what)};
  }

  CameraId id_;
  std::string name_;
  NodeCameraSettings settings_;
  StreamCounters* counters_;
  Duration window_;
  const PtpClock* ptp_;  // null: not used

  std::unique_ptr<wire::NodeLink> link_;  // stays open after stop(): it connects again meanwhile
  bool running_ = false;
  Timestamp called_at_;
  std::optional<Timestamp> heard_at_;  // last echo
  Duration waited_{};                  // of a recording: for the next message
  std::optional<std::uint64_t> session_;
  std::string node_name_;
  NodeCamera camera_;  // by the last echo
  bool recorded_ = false;
  std::string control_;  // by the last echo
  NodeClock own_clock_;  // unused if the surroundings have one
  NodeClock& clock_;
  PeerLineSource source_ = PeerLineSource::Echoes;
  std::optional<Timestamp> uncertain_since_;
  std::optional<std::uint64_t> next_sequence_;
  std::uint32_t track_base_ = 0;  // added to the ids of 2D tracks
  std::uint32_t next_track_ = 0;  // above all ids so far
  Timestamp last_exposed_ = Timestamp::min();
  std::vector<std::byte> black_;
};

std::string RemoteCamera::node() const {
  return node_name_.empty() ? fmt::format("the node at {}", settings_.endpoint)
                            : fmt::format("node '{}' at {}", node_name_, settings_.endpoint);
}

Error RemoteCamera::silent(ErrorCode code) const {
  std::string why = link_ ? link_->fault() : std::string{};
  if (why.empty()) why = "is mocapd running there, with a section [node]? Does the network reach it?";
  const bool was_heard = heard_at_ && host_now() - *heard_at_ >= kNodeSilent;
  const std::string span = was_heard ? fmt::format(" for more than {:.0f} s", to_s(kNodeSilent)) : "";
  return error(code, fmt::format("{} does not answer{}: {}", node(), span, why));
}

Error RemoteCamera::uncertain(ErrorCode code) const {
  const std::optional<NodeClockState> clock = clock_.state(session_.value_or(0), host_now());
  if (!clock) return error(code, fmt::format("the clock of {} is not known yet", node()));
  return error(
      code, fmt::format("the clock of {} is known within {:.0f} us only, expected at most {:.0f} us ([align] "
                        "window_us); its images stay out of the sets: shorten the network path (round trip {:.0f} us)",
                        node(), to_us(clock->uncertainty), to_us(window_), to_us(clock->round_trip)));
}

bool RemoteCamera::clock_is_certain(Timestamp now) const {
  const std::optional<NodeClockState> clock = clock_.state(session_.value_or(0), now);
  return clock && clock->uncertainty <= window_;
}

Status RemoteCamera::open_link() {
  const Result<wire::ClientKeys> own = keys();
  if (!own) return error(own.error().code, own.error().message);
  Result<std::unique_ptr<wire::NodeLink>> link = wire::NodeLink::open({settings_.endpoint, name_on_node(), *own});
  if (!link) return error(link.error().code, link.error().message);
  link_ = *std::move(link);
  return {};
}

Status RemoteCamera::start() {
  if (!link_) {
    if (Status opened = open_link(); !opened) return opened;
  }
  running_ = true;
  const Status found = find_node(host_now() + kAnswerPatience);
  running_ = found.has_value();
  if (found) log_info("camera " + name_, fmt::format("started driver=node, {}", node()));
  return found;
}

// Waits for an echo that came after the call of this function, and leaves out images of an earlier start. The node
// sends no image of a recording before the echo that tells its size, so there the first such echo counts, whenever it
// was called; images that are left out are counted as lost.
Status RemoteCamera::find_node(Timestamp until) {
  const Timestamp begun_at = host_now();
  called_at_ = Timestamp{};
  waited_ = Duration::zero();
  uncertain_since_.reset();
  if (!settings_.recorded) next_sequence_.reset();
  while (host_now() < until) {
    call_when_due(wire::kNodeCallEvery);
    const Result<wire::NodeNews> news = link_->next(std::min<Duration>(wire::kNodeCallEvery, until - host_now()));
    if (!news && news.error().code == ErrorCode::Timeout) continue;
    if (!news) return error(news.error().code, news.error().message);
    if (*news == wire::NodeNews::Refusal) return error(ErrorCode::NotFound, link_->refusal());
    if (*news == wire::NodeNews::Image && settings_.recorded) count_lost(link_->image().sequence + 1);
    if (*news != wire::NodeNews::Echo) continue;
    if (!settings_.recorded && link_->echo().called_at < begun_at) continue;
    follow_echo();
    if (judge_echo()) return {};
  }
  if (!heard_at_ || *heard_at_ < begun_at) {
    const bool wait = heard_at_ && host_now() - *heard_at_ < kNodeSilent;
    return silent(wait ? ErrorCode::Timeout : ErrorCode::NotFound);
  }
  return judge_echo();
}

Status RemoteCamera::adjust(const CameraAdjustment& to) {
  if (!to.exposure_us && !to.gain_db) return {};
  const Result<std::string> endpoint = wire::control_of_node(control_, settings_.endpoint);
  if (!endpoint) return error(endpoint.error().code, endpoint.error().message);
  const Result<wire::ClientKeys> own = keys();
  if (!own) return error(own.error().code, own.error().message);
  ControlRequest request;
  request.action = ControlAction::AdjustCamera;
  request.name = name_on_node();
  request.exposure_us = to.exposure_us;
  request.gain_db = to.gain_db;
  const Status done = wire::forward_request(*endpoint, *own, request, kAdjustPatience);
  if (!done) return error(done.error().code, fmt::format("{}: {}", node(), done.error().message));
  return {};
}

// Whether the camera can deliver images now.
Status RemoteCamera::judge_echo() const {
  if (camera_.width_px == 0 || (camera_.state != NodeCameraState::Delivering && !recorded_)) {
    return error(ErrorCode::NotFound,
                 fmt::format("{} has no images of its camera '{}'; see the log of mocapd there, or mocapctl status",
                             node(), name_on_node()));
  }
  if (recorded_ != settings_.recorded) {
    return error(ErrorCode::InvalidArgument, fmt::format("{} plays {}; set recorded = {} for this camera", node(),
                                                         recorded_ ? "a recording" : "no recording", recorded_));
  }
  if (!recorded_ && !clock_is_certain(host_now())) return uncertain(ErrorCode::NotFound);
  return {};
}

void RemoteCamera::call_when_due(Duration period) {
  const Timestamp now = host_now();
  if (now - called_at_ < period) return;
  called_at_ = now;
  link_->call();
}

void RemoteCamera::follow_echo() {
  const wire::NodeEcho& echo = link_->echo();
  heard_at_ = echo.arrived_at;
  if (session_ != echo.session) {
    session_ = echo.session;
    node_name_ = echo.node;
    // A recording begins with its first image; of a live camera, images went to other hosts before.
    next_sequence_ = echo.recorded ? std::optional<std::uint64_t>(0) : std::nullopt;
    track_base_ = next_track_;
    last_exposed_ = Timestamp::min();
  }
  camera_ = echo.camera;
  recorded_ = echo.recorded;
  control_ = echo.control;
  clock_.add(echo.session, {echo.called_at, echo.received_at, echo.sent_at, echo.arrived_at}, by_ptp());
  const std::optional<NodeClockState> clock = clock_.state(echo.session, host_now());
  if (recorded_ || !clock) return;
  tell_source(clock->source);
  if (counters_ == nullptr) return;
  const bool by_ptp = clock->source == PeerLineSource::Measured;
  counters_->clock_uncertainty_us.store(to_us(clock->uncertainty), std::memory_order_relaxed);
  counters_->clock_source.store(by_ptp ? ClockSource::Ptp : ClockSource::Receipts, std::memory_order_relaxed);
}

// The node's clock by PTP, at the instant of the last echo; empty if only one machine has PTP, or another grandmaster.
std::optional<MeasuredLine> RemoteCamera::by_ptp() const {
  const wire::NodeEcho& echo = link_->echo();
  const std::optional<PtpLine> host = ptp_ != nullptr && echo.ptp ? ptp_->line(echo.arrived_at) : std::nullopt;
  return host ? ptp_offset(*echo.ptp, *host) : std::nullopt;
}

void RemoteCamera::tell_source(PeerLineSource source) {
  if (source == std::exchange(source_, source)) return;
  if (source == PeerLineSource::Measured) log_info("camera " + name_, "the clock of " + node() + " is known by PTP");
  if (source == PeerLineSource::Contradicted) {
    log_warn("camera " + name_,
             fmt::format("PTP contradicts the echoes of {}, which are used: does CLOCK_REALTIME follow ptp4l there and "
                         "here (phc2sys, one UTC offset)?",
                         node()));
  }
}

Result<Frame> RemoteCamera::next(Duration patience) {
  if (!running_) return error(ErrorCode::DeviceLost, "not started");
  const Timestamp until = host_now() + patience;
  for (;;) {
    call_when_due(clock_.call_every());
    const Timestamp asked_at = host_now();
    const Duration left = std::clamp<Duration>(until - asked_at, Duration::zero(), wire::kNodeCallEvery);
    const Result<wire::NodeNews> news = link_->next(left);
    const bool silent_for_long = !recorded_ && host_now() - *heard_at_ > kNodeSilent;
    if (news) {
      heard_something();
      const Result<bool> delivered = follow(*news);
      if (!delivered) return delivered.error();
      if (*delivered) return frame_of_image();
    } else if (news.error().code != ErrorCode::Timeout) {
      if (counters_ != nullptr) counters_->failed_frames.fetch_add(1, std::memory_order_relaxed);
      // Malformed messages do not keep a node alive.
      running_ = !silent_for_long;
      return error(silent_for_long ? ErrorCode::DeviceLost : news.error().code, news.error().message);
    } else if (silent_for_long) {
      running_ = false;
      return silent(ErrorCode::DeviceLost);
    } else if (recorded_) {
      waited_for(host_now() - asked_at);
    }
    if (host_now() >= until) return Error{ErrorCode::Timeout, {}};
  }
}

// A recording may pause for any time, but its node answers calls. Only time in which this host waited counts: it may be
// busy for longer than the node waits.
void RemoteCamera::waited_for(Duration span) {
  const bool was_short = waited_ <= kNodeSilent;
  waited_ += span;
  if (!was_short || waited_ <= kNodeSilent) return;
  log_warn(
      "camera " + name_,
      fmt::format("{} does not answer for more than {:.0f} s; this camera waits for the rest of its recording: see the "
                  "log of mocapd there; if it has ended, stop this mocapd and start both again",
                  node(), to_s(kNodeSilent)));
}

void RemoteCamera::heard_something() {
  if (waited_ > kNodeSilent) log_info("camera " + name_, node() + " answers again");
  waited_ = Duration::zero();
}

// Uses one message. Returns whether it is an image to deliver.
Result<bool> RemoteCamera::follow(wire::NodeNews news) {
  if (news == wire::NodeNews::Refusal) return error(ErrorCode::DeviceLost, link_->refusal());
  if (news == wire::NodeNews::Image) return follow_image();
  follow_echo();
  if (camera_.state != NodeCameraState::Ended) return false;
  if (!recorded_) {
    return error(ErrorCode::DeviceLost,
                 fmt::format("{} has no images of its camera '{}' any more; see the log of mocapd there", node(),
                             name_on_node()));
  }
  link_->call(true);
  link_.reset();
  running_ = false;
  return error(ErrorCode::EndOfStream, "the recording of the node has ended");
}

Result<bool> RemoteCamera::follow_image() {
  wire::NodeImage& image = link_->image();
  count_lost(image.sequence);
  next_sequence_ = image.sequence + 1;
  map_tracks(image.blobs.blobs);
  if (recorded_ || map_times(image.blobs)) return true;
  if (counters_ != nullptr) counters_->failed_frames.fetch_add(1, std::memory_order_relaxed);
  const Timestamp now = host_now();
  if (!uncertain_since_) uncertain_since_ = now;
  // An image came, so the camera is not silent.
  return uncertain(now - *uncertain_since_ > kUncertainFor ? ErrorCode::DeviceLost : ErrorCode::Io);
}

// Counts the images from the next one on to the one before `until`: they are not delivered.
void RemoteCamera::count_lost(std::uint64_t until) {
  if (next_sequence_ && until > *next_sequence_ && counters_ != nullptr) {
    counters_->missing_packets.fetch_add(until - *next_sequence_, std::memory_order_relaxed);
  }
  next_sequence_ = until;
}

// Returns false if the clock is too uncertain for the sets. An image that came before its exposure shows that, too: one
// set with a time of the future would make all later images late.
bool RemoteCamera::map_times(BlobFrame& image) {
  const Timestamp now = host_now();
  const std::optional<NodeInstants> instants =
      clock_.to_host(session_.value_or(0), image.exposed_at, image.received_at, now);
  if (!instants || instants->uncertainty > window_ || instants->exposed_at > now + window_) return false;
  uncertain_since_.reset();
  image.exposed_at = std::max(instants->exposed_at, last_exposed_ + Duration{1});
  image.received_at = std::min(instants->received_at, now);
  last_exposed_ = image.exposed_at;
  return true;
}

void RemoteCamera::map_tracks(Blobs& blobs) {
  for (Blob& blob : blobs) {
    if (!blob.track.names_something()) continue;
    blob.track.value += track_base_;
    next_track_ = std::max(next_track_, blob.track.value + 1);
  }
}

Frame RemoteCamera::frame_of_image() {
  const BlobFrame& image = link_->image().blobs;
  if (counters_ != nullptr) counters_->completed_frames.fetch_add(1, std::memory_order_relaxed);
  const int width_px = static_cast<int>(camera_.width_px), height_px = static_cast<int>(camera_.height_px);
  black_.resize(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px), std::byte{0});
  return {id_,
          image.number,
          image.exposed_at,
          image.received_at,
          {black_, static_cast<std::size_t>(width_px), width_px, height_px, PixelFormat::Mono8}};
}

}  // namespace

Result<std::unique_ptr<BlobCamera>> make_node_camera(CameraId id, const std::string& name,
                                                     const NodeCameraSettings& settings,
                                                     const CameraSurroundings& surroundings) {
  return std::unique_ptr<BlobCamera>(std::make_unique<RemoteCamera>(id, name, settings, surroundings));
}

Result<std::unique_ptr<Camera>> open_node_camera(CameraId id, const std::string& name,
                                                 const NodeCameraSettings& settings,
                                                 const CameraSurroundings& surroundings) {
  return std::unique_ptr<Camera>(std::make_unique<RemoteCamera>(id, name, settings, surroundings));
}

}  // namespace mocap::cameras
