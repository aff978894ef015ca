// Access to a frame through the C ABI.
#include "frame.h"

#include <algorithm>
#include <cstring>

#include "clock.h"
#include "feed.h"
#include "text.h"

using mocap::client::SubjectDescription;
using mocap::client::SubjectFrame;

namespace {

const SubjectFrame* subject_of(const mocap_frame* frame, std::size_t index) {
  if (frame == nullptr || index >= frame->frame.subjects.size()) return nullptr;
  return &frame->frame.subjects[index];
}

const SubjectDescription* description_of(const mocap_frame* frame, std::size_t index) {
  const SubjectFrame* subject = subject_of(frame, index);
  return subject == nullptr ? nullptr : &frame->frame.description->subjects[subject->subject];
}

const mocap_bone* bone_of(const mocap_frame* frame, std::size_t subject, std::size_t bone) {
  const SubjectDescription* known = description_of(frame, subject);
  return known == nullptr || bone >= known->bones.size() ? nullptr : &known->bones[bone];
}

template <typename Entry>
std::size_t copy(const std::vector<Entry>& from, Entry* into, std::size_t capacity) {
  const std::size_t count = std::min(capacity, from.size());
  if (into != nullptr && count > 0) std::memcpy(into, from.data(), count * sizeof(Entry));
  return from.size();
}

// The index of the entry with this name, or -1 with an explanation in `fault`.
template <typename Entry>
int32_t find(const std::vector<Entry>& entries, const char* kind, const std::string& owner, const std::string& name,
             char* fault, std::size_t fault_size) {
  std::vector<std::string> names;
  for (const Entry& entry : entries) {
    if (name == entry.name) return static_cast<int32_t>(names.size());
    names.emplace_back(entry.name);
  }
  mocap::client::copy_text(fault, fault_size, mocap::client::unknown_name(kind, name, "'" + owner + "'", names));
  return -1;
}

int32_t no_subject(char* fault, std::size_t fault_size) {
  mocap::client::copy_text(fault, fault_size, "the frame has no such subject");
  return -1;
}

}  // namespace

extern "C" {

void mocap_frame_get_info(const mocap_frame* frame, mocap_frame_info* into, size_t size) {
  if (into == nullptr) return;
  mocap_frame_info empty{};
  empty.exposed_at_ns = empty.received_at_ns = empty.detected_at_ns = empty.fused_at_ns = empty.sent_at_ns =
      empty.utc_minus_host_ns = MOCAP_ABSENT;
  const bool filled = frame != nullptr && frame->frame.serial != 0;
  std::memcpy(into, filled ? &frame->frame.info : &empty, std::min(size, sizeof(empty)));
}

int64_t mocap_frame_age_ns(const mocap_frame* frame) {
  return frame == nullptr ? MOCAP_ABSENT : mocap::client::age_of(frame->frame, mocap::client::now());
}

const char* mocap_frame_session(const mocap_frame* frame) {
  return frame == nullptr || !frame->frame.description ? "" : frame->frame.description->session.c_str();
}

const char* mocap_frame_producer(const mocap_frame* frame) {
  return frame == nullptr || !frame->frame.description ? "" : frame->frame.description->producer.c_str();
}

double mocap_frame_nominal_rate_hz(const mocap_frame* frame) {
  return frame == nullptr || !frame->frame.description ? 0.0 : frame->frame.description->nominal_rate_hz;
}

int32_t mocap_frame_get_subject(const mocap_frame* frame, size_t index, mocap_subject* into, size_t size) {
  const SubjectFrame* subject = subject_of(frame, index);
  if (subject == nullptr || into == nullptr) return 0;
  const SubjectDescription& known = *description_of(frame, index);
  const mocap_subject all{known.name.c_str(),      known.marker_set.c_str(), known.skeleton.c_str(),
                          subject->phase,          subject->residual_m,      subject->smoothing_delay_s,
                          known.bones.data(),      known.bones.size(),       subject->bones.data(),
                          subject->bones.size(),   known.markers.data(),     known.markers.size(),
                          subject->markers.data(), subject->markers.size()};
  std::memcpy(into, &all, std::min(size, sizeof(all)));
  return 1;
}

int32_t mocap_frame_find_subject(const mocap_frame* frame, const char* name) {
  if (frame == nullptr || name == nullptr) return -1;
  for (std::size_t i = 0; i < frame->frame.subjects.size(); ++i) {
    if (description_of(frame, i)->name == name) return static_cast<int32_t>(i);
  }
  return -1;
}

const mocap_point* mocap_frame_points(const mocap_frame* frame, size_t* count) {
  if (count != nullptr) *count = frame == nullptr ? 0 : frame->frame.points.size();
  return frame == nullptr ? nullptr : frame->frame.points.data();
}

size_t mocap_frame_copy_bone_poses(const mocap_frame* frame, size_t subject, mocap_bone_pose* into, size_t capacity) {
  const SubjectFrame* from = subject_of(frame, subject);
  return from == nullptr ? 0 : copy(from->bones, into, capacity);
}

size_t mocap_frame_copy_marker_poses(const mocap_frame* frame, size_t subject, mocap_marker_pose* into,
                                     size_t capacity) {
  const SubjectFrame* from = subject_of(frame, subject);
  return from == nullptr ? 0 : copy(from->markers, into, capacity);
}

size_t mocap_frame_copy_points(const mocap_frame* frame, mocap_point* into, size_t capacity) {
  return frame == nullptr ? 0 : copy(frame->frame.points, into, capacity);
}

size_t mocap_frame_bone_count(const mocap_frame* frame, size_t subject) {
  const SubjectDescription* known = description_of(frame, subject);
  return known == nullptr ? 0 : known->bones.size();
}

size_t mocap_frame_marker_count(const mocap_frame* frame, size_t subject) {
  const SubjectDescription* known = description_of(frame, subject);
  return known == nullptr ? 0 : known->markers.size();
}

const char* mocap_frame_subject_name(const mocap_frame* frame, size_t subject) {
  const SubjectDescription* known = description_of(frame, subject);
  return known == nullptr ? "" : known->name.c_str();
}

int32_t mocap_frame_subject_phase(const mocap_frame* frame, size_t subject) {
  const SubjectFrame* from = subject_of(frame, subject);
  return from == nullptr ? static_cast<int32_t>(MOCAP_PHASE_SEARCHING) : from->phase;
}

const char* mocap_frame_bone_text(const mocap_frame* frame, size_t subject, size_t bone, int32_t what) {
  const mocap_bone* known = bone_of(frame, subject, bone);
  if (known == nullptr) return "";
  switch (what) {
    case 0: return known->name;
    case 1: return known->unity_name;
    case 2: return known->unreal_name;
    case 3: return known->vrm_name;
    default: return "";
  }
}

int32_t mocap_frame_bone_parent(const mocap_frame* frame, size_t subject, size_t bone) {
  const mocap_bone* known = bone_of(frame, subject, bone);
  return known == nullptr ? -1 : known->parent;
}

void mocap_frame_bone_rest_offset(const mocap_frame* frame, size_t subject, size_t bone, mocap_vec3* into) {
  const mocap_bone* known = bone_of(frame, subject, bone);
  if (into != nullptr) *into = known == nullptr ? mocap_vec3{} : known->rest_offset;
}

const char* mocap_frame_marker_name(const mocap_frame* frame, size_t subject, size_t marker) {
  const SubjectDescription* known = description_of(frame, subject);
  return known == nullptr || marker >= known->markers.size() ? "" : known->markers[marker].name;
}

int32_t mocap_frame_find_bone(const mocap_frame* frame, size_t subject, const char* name, char* fault,
                              size_t fault_size) {
  const SubjectDescription* known = description_of(frame, subject);
  if (known == nullptr) return no_subject(fault, fault_size);
  return find(known->bones, "bone", known->name, mocap::client::text_of(name), fault, fault_size);
}

int32_t mocap_frame_find_marker(const mocap_frame* frame, size_t subject, const char* name, char* fault,
                                size_t fault_size) {
  const SubjectDescription* known = description_of(frame, subject);
  if (known == nullptr) return no_subject(fault, fault_size);
  return find(known->markers, "marker", known->name, mocap::client::text_of(name), fault, fault_size);
}

}  // extern "C"
