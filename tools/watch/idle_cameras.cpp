#include "watch/idle_cameras.h"

#include <fmt/core.h>

#include <vector>

#include "model/blob_use.h"

namespace mocap::watch {

std::string idle_cameras(const FeedState& feed) {
  if (!feed.health() || !feed.health_before()) return {};
  const auto& now = feed.health()->cameras;
  std::vector<BlobUse> use;
  for (std::size_t i = 0; i < now.size(); ++i)
    use.push_back(now[i].blob_use.since(feed.health_before()->cameras[i].blob_use));
  std::string text;
  for (std::size_t i = 0; i < use.size(); ++i) {
    const std::string why = why_no_markers(use, i);
    if (!why.empty()) text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", now[i].name, why);
  }
  return text.empty() ? text : fmt::format("{}; {}", text, kNoMarkersRemedy);
}

}  // namespace mocap::watch
