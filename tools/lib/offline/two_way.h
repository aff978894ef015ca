#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "lib/offline/ages.h"
#include "model/skeleton.h"
#include "model/snapshot.h"

namespace mocap::offline {

/// A snapshot and the ages of its labels and bones.
struct Pass {
  Snapshot snapshot;
  Ages ages;
};

/// Joins what the forward and the backward pass found in the same set. Sets come from the last to the first.
///
/// The forward pass is right wherever it measured. A subject that the forward pass does not track is taken over from
/// the backward pass if both passes agreed where the forward pass found it, and the backward pass tracked it since; the
/// only subject of a take also if the backward pass found it before the forward pass did. In between observations, a
/// label or a bone that both passes predict is blended linearly in time.
class TwoWay {
 public:
  explicit TwoWay(const std::vector<Subject>& subjects) : subjects_(subjects) {}

  Snapshot join(const Pass& forward, const Pass& backward);

 private:
  // Whether the subject of the backward pass is that of the forward pass.
  bool judge(const SubjectLabels& forward, const SubjectLabels& backward);
  void start_subject(std::size_t index, const Pass& backward, std::size_t from, Snapshot& into) const;
  void fill_labels(const SubjectLabels& from, const std::vector<float>& forward_ages,
                   const std::vector<float>& backward_ages, SubjectLabels& into, Snapshot& all) const;
  void fill_bones(const SubjectPose& from, const std::vector<float>& forward_ages,
                  const std::vector<float>& backward_ages, SubjectPose& into) const;

  const std::vector<Subject>& subjects_;
  std::map<std::uint32_t, bool> trusted_;  // by subject: the result of judge() while the backward pass tracks it
};

}  // namespace mocap::offline
