#include "export/clip/interpolation.h"

#include <algorithm>

namespace mocap::exports {
namespace {

const Eigen::Vector3d& position(const MarkerSample& sample) { return sample.position_m; }
const Eigen::Vector3d& position(const BoneSample& sample) { return sample.parent_from_bone.position; }

// Slope at a sample in lengths per frame: that of the parabola through it, a neighbour one frame away and the other
// end.
Eigen::Vector3d slope(const Eigen::Vector3d& beside, const Eigen::Vector3d& across, double frames) {
  return (frames * beside + across) / (1.0 + frames);
}

template <class Sample>
Eigen::Vector3d position_between(const Neighbours<Sample>& known, double s) {
  const Eigen::Vector3d &a = position(*known.from), &b = position(*known.to);
  const Eigen::Vector3d across = (b - a) / known.frames;
  const Eigen::Vector3d at_a =
      known.before == nullptr ? across : slope(a - position(*known.before), across, known.frames);
  const Eigen::Vector3d at_b =
      known.after == nullptr ? across : slope(position(*known.after) - b, across, known.frames);
  const double r = 1.0 - s;  // cubic Hermite
  return r * r * (1.0 + 2.0 * s) * a + s * s * (1.0 + 2.0 * r) * b +
         known.frames * (r * r * s * at_a - s * s * r * at_b);
}

}  // namespace

MarkerSample between(const Neighbours<MarkerSample>& known, double s) {
  const bool measured = known.from->state == LabelState::Measured && known.to->state == LabelState::Measured;
  MarkerSample sample;
  sample.position_m = position_between(known, s);
  sample.state = measured && known.frames <= 1.0 ? LabelState::Measured : LabelState::Filled;
  if (sample.state == LabelState::Filled) return sample;
  sample.residual_m = static_cast<float>((1.0 - s) * known.from->residual_m + s * known.to->residual_m);
  sample.cameras = std::min(known.from->cameras, known.to->cameras);
  return sample;
}

BoneSample between(const Neighbours<BoneSample>& known, double s) {
  const bool measured = known.from->state == BoneState::Measured && known.to->state == BoneState::Measured;
  BoneSample sample;
  sample.parent_from_bone.position = position_between(known, s);
  sample.parent_from_bone.rotation =
      known.from->parent_from_bone.rotation.slerp(s, known.to->parent_from_bone.rotation);
  sample.state = measured && known.frames <= 1.0 ? BoneState::Measured : BoneState::Filled;
  return sample;
}

}  // namespace mocap::exports
