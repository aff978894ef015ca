#pragma once

#include "export/clip/clip.h"

namespace mocap::exports {

inline bool known(const MarkerSample& sample) { return sample.state != LabelState::Lost; }
inline bool known(const BoneSample& sample) { return sample.state != BoneState::Lost; }

/// Known samples of one marker or bone on both sides of an instant. The samples before `from` and after `to`, one frame
/// away, may be null. `frames` is the distance of `from` and `to`.
template <class Sample>
struct Neighbours {
  const Sample* before = nullptr;
  const Sample* from = nullptr;
  const Sample* to = nullptr;
  const Sample* after = nullptr;
  double frames = 1.0;
};

/// The sample at the share `s` of the way, 0 to 1: positions by a cubic with the slopes of the parabolas through three
/// samples, or by a line where a neighbour is missing; rotations by slerp. Measured only if both ends are.
MarkerSample between(const Neighbours<MarkerSample>& known, double s);
BoneSample between(const Neighbours<BoneSample>& known, double s);

}  // namespace mocap::exports
