#include "wire/event_watch.h"

#include "wire/utf8.h"

namespace mocap::wire {
namespace {

constexpr std::size_t kMostUntold = 256;

bool is_gone(CameraPhase phase) { return phase == CameraPhase::Silent || phase == CameraPhase::Reopening; }

}  // namespace

v1::Event& EventWatch::add(v1::EventKind kind, Timestamp at) {
  if (untold_.size() == kMostUntold) untold_.pop_front();
  v1::Event& event = untold_.emplace_back();
  event.set_sequence(sequence_++);
  event.set_at_ns(to_ns(at));
  event.set_kind(kind);
  event.set_description_version(description_version_);
  return event;
}

void EventWatch::look_at(const Snapshot& snapshot) {
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

void EventWatch::look_at(const Description& description, Timestamp now) {
  const bool first = description_version_ == 0;
  description_version_ = description.version;
  subject_names_.clear();
  for (const Subject& subject : description.subjects) subject_names_.push_back(valid_utf8(subject.name));
  delivers_.resize(description.cameras.size(), true);
  if (!first) add(v1::EVENT_KIND_DESCRIPTION_CHANGED, now);
}

void EventWatch::look_at(const Health& health) {
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

}  // namespace mocap::wire
