#pragma once

#include <cstdint>

#include "model/description.h"
#include "model/snapshot.h"
#include "wire/codec/lite.h"

namespace mocap::wire {

/// One subject of a snapshot, for the messages of its topic lite/NAME.
class LiteSubject {
 public:
  /// `description`: that of the feed. Both must outlive this object.
  LiteSubject(const Snapshot& from, SubjectId subject, const Description& description);

  std::size_t messages() const { return lite_messages(bones()); }
  /// Message `index` of `messages()`, without its sequence number.
  Lite message(std::size_t index, std::int64_t utc_minus_host_ns) const;

 private:
  std::size_t bones() const { return pose_ == nullptr ? 0 : pose_->bones.size(); }

  const Snapshot& from_;
  const Description& description_;
  const SubjectLabels* labels_;
  const SubjectPose* pose_;
};

}  // namespace mocap::wire
