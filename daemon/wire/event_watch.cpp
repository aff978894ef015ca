#include "wire/event_watch.h"

#include <algorithm>
#include <utility>

#include "wire/codec/utf8.h"

namespace mocap::wire {
namespace {

constexpr std::size_t kMaxUnsent = 256;

bool is_gone(CameraPhase phase) { return phase == CameraPhase::Silent || phase == CameraPhase::Reopening; }

}  // namespace

v1::Event& EventWatch::add(v1::EventKind kind, Timestamp at) {
  if (unsent_.size() == kMaxUnsent) unsent_.pop_front();
  v1::Event& event = unsent_.emplace_back();
  event.set_sequence(sequence_++);
  event.set_at_ns(to_ns(at));
  event.set_kind(kind);
  event.set_description_version(description_version_);
  return event;
}

void EventWatch::update(const Snapshot& snapshot) {
  for (const SubjectLabels& labels : snapshot.labels) {
    const std::uint32_t subject = labels.subject.value;
    if (subject >= kMaxSubjects) continue;
    const bool tracked = labels.phase == SubjectPhase::Tracking;
    if (tracked == tracked_[subject]) continue;
    tracked_[subject] = tracked;
    v1::Event& event =
        add(tracked ? v1::EVENT_KIND_SUBJECT_FOUND : v1::EVENT_KIND_SUBJECT_LOST, snapshot.instants.exposed_at);
    event.set_subject(subject);
    if (subject < subject_names_.size()) event.set_message(subject_names_[subject]);
  }
}

void EventWatch::update(const Description& description, Timestamp now) {
  const bool first = description_version_ == 0;
  description_version_ = description.version;
  std::vector<std::string> names;
  for (const Subject& subject : description.subjects) names.push_back(valid_utf8(subject.name));
  follow_subjects(std::move(names));
  std::vector<std::string> cameras;
  for (const CameraModel& camera : description.cameras) cameras.push_back(camera.name);
  follow_cameras(std::move(cameras));
  if (!first) add(v1::EVENT_KIND_DESCRIPTION_CHANGED, now);
}

// A tracked subject of the same name goes on being tracked under its new index.
void EventWatch::follow_subjects(std::vector<std::string> names) {
  std::array<bool, kMaxSubjects> tracked{};
  for (std::size_t i = 0; i < names.size() && i < tracked.size(); ++i) {
    const auto before = std::ranges::find(subject_names_, names[i]);
    if (before != subject_names_.end())
      tracked[i] = tracked_[static_cast<std::size_t>(before - subject_names_.begin())];
  }
  tracked_ = tracked;
  subject_names_ = std::move(names);
}

// A lost camera of the same name goes on being lost under its new index.
void EventWatch::follow_cameras(std::vector<std::string> names) {
  std::vector<bool> delivers(names.size(), true);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto before = static_cast<std::size_t>(std::ranges::find(camera_names_, names[i]) - camera_names_.begin());
    if (before < delivers_.size()) delivers[i] = delivers_[before];
  }
  delivers_ = std::move(delivers);
  camera_names_ = std::move(names);
}

void EventWatch::update(const Health& health) {
  follow_take(health);
  delivers_.resize(health.cameras.size(), true);
  for (std::uint32_t i = 0; i < health.cameras.size(); ++i) {
    const CameraHealth& camera = health.cameras[i];
    const bool lost = delivers_[i] && is_gone(camera.phase);
    const bool back = !delivers_[i] && camera.phase == CameraPhase::Streaming;
    if (!lost && !back) continue;
    delivers_[i] = back;
    v1::Event& event = add(back ? v1::EVENT_KIND_CAMERA_BACK : v1::EVENT_KIND_CAMERA_LOST, health.at);
    event.set_camera(i);
    event.set_message(valid_utf8(camera.name + (lost && !camera.last_error.empty() ? ": " + camera.last_error : "")));
  }
}

// A take that began and ended between two looks has both events. One that ended before the first look has none: the
// feed was opened again.
void EventWatch::follow_take(const Health& health) {
  const TakeHealth& take = health.take;
  const bool is_over =
      take.state == TakeState::Ended || take.state == TakeState::Failed || take.state == TakeState::Cancelled;
  if (!takes_ && is_over) take_ = take.state;
  const bool begun = takes_ ? take.takes > *takes_ : take.state == TakeState::Recording;
  const bool ended = is_over && (begun || take.state != take_);
  takes_ = take.takes;
  take_ = take.state;
  const std::string name = valid_utf8(std::string(text_of(take.name)));
  if (begun) add(v1::EVENT_KIND_TAKE_STARTED, health.at).set_message(name);
  if (ended && take.state == TakeState::Failed) {
    add(v1::EVENT_KIND_TAKE_FAILED, health.at)
        .set_message(name + ": " + valid_utf8(std::string(text_of(take.message))));
  }
  if (!ended || take.state == TakeState::Failed) return;
  const char* const words[] = {"unknown", "good", "look", "bad"};
  const std::string quality = take.state == TakeState::Cancelled ? "cancelled" : words[static_cast<int>(take.quality)];
  add(v1::EVENT_KIND_TAKE_ENDED, health.at).set_message(name + ": " + quality);
}

}  // namespace mocap::wire
