#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "mocap/v1/event.pb.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// Tells what happened by what is different from before. Allocates only when something did. One thread.
class EventWatch {
 public:
  void look_at(const Snapshot& snapshot);
  void look_at(const Description& description, Timestamp now);
  void look_at(const Health& health);

  /// What happened and was not told yet, oldest first, numbered. Of more than 256 the oldest are left out.
  const std::deque<v1::Event>& untold() const { return untold_; }
  void oldest_is_told() { untold_.pop_front(); }

 private:
  v1::Event& add(v1::EventKind kind, Timestamp at);

  std::deque<v1::Event> untold_;
  std::uint64_t sequence_ = 0;
  std::uint32_t description_version_ = 0;
  std::vector<std::string> subject_names_;
  std::array<bool, kMaxSubjects> tracked_{};
  std::vector<bool> delivers_;  // by camera
};

}  // namespace mocap::wire
