#include "model/detection_counts.h"

#include <fmt/format.h>

#include <initializer_list>
#include <utility>

namespace mocap {

DetectionCounts DetectionCounts::since(const DetectionCounts& before) const noexcept {
  DetectionCounts span;
  span.blobs = blobs - before.blobs;
  span.too_small = too_small - before.too_small;
  span.too_large = too_large - before.too_large;
  span.not_round = not_round - before.not_round;
  span.too_dim = too_dim - before.too_dim;
  span.dropped = dropped - before.dropped;
  span.rows_given_up = rows_given_up - before.rows_given_up;
  return span;
}

std::string words_of_losses(const DetectionCounts& counts) {
  std::string text;
  for (const auto& [count, words] :
       std::initializer_list<std::pair<std::uint64_t, const char*>>{{counts.too_small, "too small"},
                                                                    {counts.too_large, "too large"},
                                                                    {counts.not_round, "not round"},
                                                                    {counts.too_dim, "too dim"},
                                                                    {counts.dropped, "over the bound of an image"},
                                                                    {counts.rows_given_up, "rows of noise"}}) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, words);
  }
  return text;
}

std::string why_no_blobs(std::uint64_t images, const DetectionCounts& counts, const DetectionLevels& levels) {
  if (images == 0 || counts.blobs > 0) return {};
  const std::string losses = words_of_losses(counts);
  return fmt::format("0 blobs in {} images: {} (threshold {:.0f} grey)", images,
                     losses.empty() ? "nothing is bright enough" : losses, levels.threshold_grey);
}

}  // namespace mocap
