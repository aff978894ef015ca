#include "corpus/replay.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "assemble.h"
#include "wire/codec/encode.h"

namespace mocap::corpus {
namespace {

constexpr Duration kLastPatience = std::chrono::milliseconds(500);  // the patience of the last sets
constexpr double kRight_m = 0.02;  // as mocap-eval: less than the distance of two markers
constexpr Duration kSameExposure = std::chrono::milliseconds(2);  // within it a walking marker moves by 4 mm at most

chaos::Episode episode_of(const Recording& recording) {
  chaos::Episode episode;
  episode.seed = recording.seed;
  episode.faults = recording.feed_faults;
  return episode;
}

}  // namespace

Replay::Replay(const Recording& recording, settings::DaemonSettings settings)
    : recording_(recording),
      episode_(episode_of(recording)),
      description_(describe(settings, "corpus")),
      daemon_(std::move(settings), recording.utc_stamps ? "utc" : "estimated",
              {[this](const BlobFrame& frame) { takes_.keep(frame); },
               [this](Snapshot& snapshot, const auto& fit, Timestamp now) { on_set(snapshot, fit, now); }}),
      feed_(episode_, description_),
      takes_(folder_.path() / "takes", description_, {}) {}

Figures Replay::run() {
  const auto& inputs = recording_.inputs;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    wait_until(inputs[i].at);
    handle(inputs[i]);
    // A host that wakes from a stall finds all images that came meanwhile.
    if (i + 1 < inputs.size() && inputs[i + 1].at <= now_) continue;
    daemon_.work(now_);
    takes_.work(now_);
  }
  wait_until(now_ + kLastPatience);
  daemon_.finish(now_);
  feed_.send(seconds(now_));
  takes_.finish(now_);
  Figures figures = figures_;
  const auto right = static_cast<double>(figures.judged - figures.wrong);
  figures.rms = right > 0.0 ? 1e3 * std::sqrt(squares_m2_ / right) : 0.0;
  figures.read = feed_.read_snapshots();
  figures.taken = takes_.taken_snapshots();
  figures.hash = hash_.value();
  figures.fault = fault();
  return figures;
}

std::string Replay::fault() const {
  if (feed_.finding()) return "feed: " + *feed_.finding();
  return takes_.finding().value_or("");
}

double Replay::seconds(Timestamp at) const { return to_s(at - kFirstExposure); }

// Fuses the sets whose patience ends before `until`.
void Replay::wait_until(Timestamp until) {
  for (auto due = daemon_.due(); due && *due < until; due = daemon_.due()) {
    now_ = std::max(now_, *due);
    daemon_.work(now_);
    if (daemon_.due() == due) break;
  }
  now_ = std::max(now_, until);
  daemon_.work(now_);
}

void Replay::handle(const Input& input) {
  if (const auto* arrival = std::get_if<chaos::Arrival>(&input.what)) {
    daemon_.receive(*arrival, now_);
  } else {
    follow(std::get<Order>(input.what));
  }
}

void Replay::follow(const Order& order) {
  switch (order.kind) {
    case OrderKind::Lose: return daemon_.lose(CameraId{order.target});
    case OrderKind::Reset: return daemon_.reset(SubjectId{order.target});
    case OrderKind::Away: return daemon_.set_away(SubjectId{order.target}, true);
    case OrderKind::Back: return daemon_.set_away(SubjectId{order.target}, false);
    case OrderKind::ReloadSame:
    case OrderKind::ReloadLabel:
    case OrderKind::ReloadAlign: return reload(order.kind);
    case OrderKind::TakeStart: return takes_.order(TakeAction::Start, from_s(order.amount), now_);
    case OrderKind::TakeStop: return takes_.order(TakeAction::Stop, {}, now_);
    case OrderKind::TakeNext: return takes_.order(TakeAction::Next, {}, now_);
    case OrderKind::TakeCancel: return takes_.order(TakeAction::Cancel, {}, now_);
    case OrderKind::TakeCut: return takes_.cut(order.amount);
    case OrderKind::DiskFull: return takes_.fill_disk(order.amount);
    case OrderKind::DiskFree: return takes_.free_disk();
    case OrderKind::FolderGone: return takes_.remove_folder();
  }
}

// All cameras and subjects continue. The description is that of Pipeline::describe_next.
void Replay::reload(OrderKind kind) {
  settings::DaemonSettings next = daemon_.settings();
  if (kind == OrderKind::ReloadLabel) next.label.search_every *= 2;
  if (kind == OrderKind::ReloadAlign) next.pipeline.align.patience += std::chrono::milliseconds(1);
  Handover handover;
  for (std::uint32_t i = 0; i < next.subject_models.size(); ++i) handover.subjects.push_back(SubjectId{i});
  for (std::uint32_t i = 0; i < next.rig.size(); ++i) handover.cameras.push_back(CameraId{i});
  handover.matching = handover.drift = true;
  for (const SubjectFit& fit : daemon_.fusion().fits()) description_ = with_fit(std::move(description_), fit);
  description_.version = daemon_.fusion().description_version() + 1;
  feed_.send(seconds(now_));
  daemon_.reload(std::move(next), handover);
  feed_.change(description_);
  takes_.describe(description_, now_);
}

void Replay::on_set(Snapshot& snapshot, const std::optional<SubjectFit>& fit, Timestamp now) {
  judge(snapshot);
  if (fit) takes_.learn(*fit);
  takes_.keep(snapshot);
  feed_.push(snapshot, fit);
  const double t_s = seconds(now);
  if (chaos::active_fault(episode_.faults, chaos::FaultKind::PublisherStalls, 0, t_s) == nullptr) feed_.send(t_s);
}

void Replay::judge(const Snapshot& snapshot) {
  ++figures_.sets;
  v1::Snapshot message;
  wire::encode(snapshot, message);
  hash_.add(message.SerializeAsString());
  const Truth* truth = truth_at(snapshot.instants.exposed_at);
  for (const scoring::NamedMarker& marker : scoring::frame_of(snapshot).markers) {
    if (marker.state == LabelState::Filled) ++figures_.filled;
    if (marker.state != LabelState::Measured) continue;
    ++figures_.labels;
    if (truth != nullptr) judge(marker, *truth);
  }
}

void Replay::judge(const scoring::NamedMarker& marker, const Truth& truth) {
  const auto own = std::ranges::find_if(truth.markers, [&](const TrueMarker& each) {
    return each.subject == marker.subject && each.marker == marker.marker;
  });
  ++figures_.judged;
  const double squared_m2 =
      own == truth.markers.end()
          ? HUGE_VAL
          : (marker.position_m - Eigen::Map<const Eigen::Vector3f>(own->position_m).cast<double>()).squaredNorm();
  if (squared_m2 >= kRight_m * kRight_m) {
    ++figures_.wrong;
  } else {
    squares_m2_ += squared_m2;
  }
}

const Truth* Replay::truth_at(Timestamp at) const {
  const auto same = std::ranges::find_if(recording_.truths, [&](const Truth& truth) {
    return at - truth.at < kSameExposure && truth.at - at < kSameExposure;
  });
  return same == recording_.truths.end() ? nullptr : &*same;
}

}  // namespace mocap::corpus
