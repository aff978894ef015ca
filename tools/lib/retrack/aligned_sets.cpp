#include "lib/retrack/aligned_sets.h"

namespace mocap::retrack {

AlignedSets::AlignedSets(const synchronise::AlignSettings& settings, std::uint32_t camera_count)
    : window_(settings.window), aligner_(settings, camera_count) {}

std::optional<TakeSet> AlignedSets::next(Timestamp read_up_to) {
  const std::optional<FrameSet> frames = next_frames(read_up_to);
  if (!frames) return std::nullopt;
  TakeSet set;
  set.frames = *frames;
  return set;
}

// The frames come by exposure, so a set has all its frames when a later one is there: no set waits for a camera.
std::optional<FrameSet> AlignedSets::next_frames(Timestamp read_up_to) {
  for (;;) {
    const Timestamp seen = frames_.empty() ? read_up_to : frames_.front().exposed_at;
    if (first_ && seen > *first_ + window_) {
      first_.reset();
      if (const std::optional<FrameSet> set = aligner_.take(Timestamp::max())) return set;
      continue;
    }
    if (frames_.empty()) return std::nullopt;
    aligner_.add(frames_.front());
    if (!first_) first_ = frames_.front().exposed_at;
    frames_.pop_front();
  }
}

}  // namespace mocap::retrack
