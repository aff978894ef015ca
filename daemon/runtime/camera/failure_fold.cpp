#include "runtime/camera/failure_fold.h"

#include <algorithm>

namespace mocap::runtime {
namespace {

constexpr Duration kFoldFor = std::chrono::minutes(1);

}  // namespace

bool FailureFold::is_news(const std::string& reason, Timestamp at) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto same = std::ranges::find(logged_, reason, &Logged::reason);
  if (same != logged_.end()) {
    if (at - same->at < kFoldFor) return false;
    same->at = at;
    return true;
  }
  if (logged_.size() == kMost) logged_.erase(std::ranges::min_element(logged_, {}, &Logged::at));
  logged_.push_back({reason, at});
  return true;
}

void FailureFold::end(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::erase_if(logged_, [&](const Logged& logged) { return logged.reason == reason; });
}

}  // namespace mocap::runtime
