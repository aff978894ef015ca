#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "mocap/v1/event.pb.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// Derives events (subject found or lost, camera lost or back, description changed) from the differences between
/// successive snapshots, descriptions and health messages. Allocates only for an event. One thread.
class EventWatch {
 public:
  void update(const Snapshot& snapshot);
  void update(const Description& description, Timestamp now);
  void update(const Health& health);

  /// The numbered events that were not sent yet, oldest first. At most 256 are kept; the oldest are discarded.
  const std::deque<v1::Event>& unsent() const { return unsent_; }
  void remove_oldest() { unsent_.pop_front(); }

 private:
  v1::Event& add(v1::EventKind kind, Timestamp at);
  void follow_take(const Health& health);
  void follow_subjects(std::vector<std::string> names);
  void follow_cameras(std::vector<std::string> names);

  std::deque<v1::Event> unsent_;
  std::uint64_t sequence_ = 0;
  std::uint32_t description_version_ = 0;
  std::vector<std::string> subject_names_;
  std::array<bool, kMaxSubjects> tracked_{};
  TakeState take_ = TakeState::None;    // at the last look
  std::optional<std::uint64_t> takes_;  // empty: before the first look
  std::vector<std::string> camera_names_;
  std::vector<bool> delivers_;  // by camera: delivered images at the last look
};

}  // namespace mocap::wire
