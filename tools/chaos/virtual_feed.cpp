#include "chaos/virtual_feed.h"

#include <fmt/format.h>

#include <utility>

#include "chaos/hash.h"
#include "chaos/virtual_subscriber.h"
#include "wire/codec/encode.h"

namespace mocap::chaos {
namespace {

constexpr std::size_t kQueueSnapshots = 8;  // [queues] publish_snapshots

// No reports: they would come by the clock of the host.
runtime::PublishWorkerSettings worker_settings() {
  runtime::PublishWorkerSettings settings;
  settings.report_every = std::chrono::hours(1000);
  return settings;
}

}  // namespace

class VirtualFeed::Link final : public Publisher {
 public:
  explicit Link(const Episode& episode) : episode_(episode), random_(scene::mixed(episode.seed) + 2) {}

  void set_time(double t_s) { t_s_ = t_s; }

  // PublishWorker repeats the description whenever it runs.
  Status describe(const Description& description) override {
    if (sent_ && sent_->version == description.version && sent_->session_id == description.session_id) return {};
    sent_ = description;
    if (const Finding lost = description_survives_wire(description); lost && !finding_) finding_ = lost;
    std::string bytes = wire::encode(description).SerializeAsString();
    hash_.add(bytes);
    if (loses()) {
      subscriber_.forget();
    } else {
      const bool damaged = cuts(bytes);
      if (damaged) subscriber_.forget();
      subscriber_.receive_description(bytes, damaged);
    }
    return {};
  }

  Status publish(Snapshot& snapshot) override {
    v1::Snapshot message;
    wire::encode(snapshot, message);
    std::string bytes = message.SerializeAsString();
    hash_.add(bytes);
    if (!sent_) {
      if (!finding_) finding_ = "a snapshot was sent before the description";
      return {};
    }
    if (loses()) return {};
    const bool damaged = cuts(bytes);
    subscriber_.receive_snapshot(bytes, damaged);
    return {};
  }

  Status report(const Health& /*health*/) override { return {}; }

  const Finding& finding() const { return finding_ ? finding_ : subscriber_.finding(); }
  std::uint64_t hash() const { return hash_.value(); }
  const Description& sent() const { return *sent_; }
  std::uint64_t read_snapshots() const { return subscriber_.read_snapshots(); }

 private:
  bool loses() {
    const Fault* fault = active_fault(episode_.faults, FaultKind::MessagesLost, 0, t_s_);
    return fault != nullptr && random_.uniform() < fault->amount;
  }
  // Returns whether the message was cut.
  bool cuts(std::string& bytes) {
    const Fault* fault = active_fault(episode_.faults, FaultKind::MessagesCut, 0, t_s_);
    if (fault == nullptr || random_.uniform() >= fault->amount) return false;
    bytes.resize(static_cast<std::size_t>(random_.uniform() * static_cast<double>(bytes.size())));
    return true;
  }

  const Episode& episode_;
  scene::Random random_;
  double t_s_ = 0.0;
  std::optional<Description> sent_;
  VirtualSubscriber subscriber_;
  Finding finding_;
  Hash hash_;
};

VirtualFeed::VirtualFeed(const Episode& episode, Description description)
    : channel_(kQueueSnapshots),
      owned_link_(std::make_unique<Link>(episode)),
      link_(owned_link_.get()),
      worker_(std::move(owned_link_), std::move(description), worker_settings(), links(), counters_) {
  worker_.pause();
}

VirtualFeed::~VirtualFeed() = default;

// The health of cameras is not published here.
runtime::PublishWorker::Links VirtualFeed::links() {
  runtime::PublishWorker::Links links;
  links.snapshots = &channel_;
  links.fusion = &fusion_;
  return links;
}

bool VirtualFeed::push(const Snapshot& snapshot, const std::optional<SubjectFit>& fit) {
  ++pushed_;
  if (fit && !channel_.fits.try_push(*fit) && !finding_) finding_ = "the queue of the fits is full";
  if (channel_.snapshots.try_push(snapshot)) return true;
  ++refused_;
  return false;
}

void VirtualFeed::send(double t_s) {
  link_->set_time(t_s);
  worker_.run();
  if (!finding_) finding_ = link_->finding();
  count();
}

void VirtualFeed::count() {
  const std::uint64_t known = counters_.sent.read() + counters_.failed.read() + counters_.passed_over.read() + refused_;
  if (known == pushed_ || finding_) return;
  finding_ = fmt::format("{} snapshots pushed, {} counted as sent, passed over or dropped", pushed_, known);
}

void VirtualFeed::change(Description description) {
  worker_.change(std::move(description), worker_settings(), links());
}

std::uint64_t VirtualFeed::hash() const { return link_->hash(); }
const Description& VirtualFeed::sent_description() const { return link_->sent(); }
std::uint64_t VirtualFeed::read_snapshots() const { return link_->read_snapshots(); }

}  // namespace mocap::chaos
