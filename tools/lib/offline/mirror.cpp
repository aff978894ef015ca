#include "lib/offline/mirror.h"

#include "synchronise/frame_aligner.h"

namespace mocap::offline {

FrameSet OwnedSet::set() const {
  FrameSet set;
  set.number = number;
  set.expected_views = expected_views;
  for (const BlobFrame& image : images) set.views.push_back(&image);
  set.exposed_at = synchronise::mean_exposure(set);
  return set;
}

OwnedSet Mirror::mirrored(OwnedSet set) const {
  set.number = ~set.number;
  for (BlobFrame& image : set.images) {
    const Duration to_received = image.received_at - image.exposed_at;
    const Duration to_detected = image.detected_at - image.exposed_at;
    image.number = ~image.number;
    image.exposed_at = mirrored(image.exposed_at);
    image.received_at = image.exposed_at + to_received;
    image.detected_at = image.exposed_at + to_detected;
  }
  return set;
}

void Mirror::unmirror(Poses& poses) {
  for (SubjectPose& pose : poses) {
    for (BonePose& bone : pose.bones) {
      bone.velocity_m_s = -bone.velocity_m_s;
      bone.spin_rad_s = -bone.spin_rad_s;
    }
  }
}

}  // namespace mocap::offline
