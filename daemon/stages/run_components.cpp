#include "stages/run_components.h"

#include <algorithm>
#include <utility>

#include "base/expects.h"

namespace mocap::stages {
namespace {

constexpr std::uint32_t kNotKept = 0xFFFF'FFFF;

}  // namespace

RunComponents::RunComponents(std::size_t max_runs) : max_runs_(max_runs) {
  runs_.reserve(max_runs);
  parent_.reserve(max_runs);
  area_px2_.reserve(max_runs);
  kept_.reserve(max_runs);
  sorted_.reserve(max_runs);
  first_run_.reserve(max_runs + 1);
}

void RunComponents::clear() {
  runs_.clear();
  parent_.clear();
  area_px2_.clear();
  kept_.clear();
  sorted_.clear();
  first_run_.clear();
  row_begin_ = above_ = above_end_ = 0;
  filtered_ = dropped_ = 0;
}

void RunComponents::add(Run run) {
  if (runs_.size() == max_runs_) {
    ++dropped_;
    return;
  }
  if (runs_.empty() || runs_.back().y != run.y) {
    const bool next_row = !runs_.empty() && runs_.back().y + 1 == run.y;
    above_ = next_row ? row_begin_ : runs_.size();
    above_end_ = runs_.size();
    row_begin_ = runs_.size();
  }
  const auto index = static_cast<std::uint32_t>(runs_.size());
  runs_.push_back(run);
  parent_.push_back(index);
  area_px2_.push_back(static_cast<std::uint32_t>(run.end - run.begin));
  // A corner touches: [begin - 1, end + 1) of this row against the runs above. Those that end before this run ends
  // cannot touch the next one, which begins a pixel further at least; the last may.
  while (above_ < above_end_ && runs_[above_].end < run.begin) ++above_;
  for (std::size_t i = above_; i < above_end_ && runs_[i].begin <= run.end; ++i) {
    join(index, static_cast<std::uint32_t>(i));
  }
}

std::uint32_t RunComponents::root_of(std::uint32_t run) {
  while (parent_[run] != run) {
    parent_[run] = parent_[parent_[run]];
    run = parent_[run];
  }
  return run;
}

void RunComponents::join(std::uint32_t a, std::uint32_t b) {
  a = root_of(a);
  b = root_of(b);
  if (a == b) return;
  if (b < a) std::swap(a, b);
  parent_[b] = a;
  area_px2_[a] += area_px2_[b];
}

void RunComponents::finish(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count) {
  choose(min_area_px2, max_area_px2, max_count);
  gather();
}

void RunComponents::choose(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count) {
  for (std::uint32_t i = 0; i < runs_.size(); ++i) {
    if (parent_[i] != i) continue;
    if (area_px2_[i] < min_area_px2 || area_px2_[i] > max_area_px2) {
      ++filtered_;
    } else {
      kept_.push_back(i);
    }
  }
  if (kept_.size() <= max_count) return;
  const auto larger = [this](std::uint32_t a, std::uint32_t b) {
    return area_px2_[a] != area_px2_[b] ? area_px2_[a] > area_px2_[b] : a < b;
  };
  const auto bound = kept_.begin() + static_cast<std::ptrdiff_t>(max_count);
  std::nth_element(kept_.begin(), bound, kept_.end(), larger);
  dropped_ += static_cast<std::uint32_t>(kept_.size() - max_count);
  kept_.erase(bound, kept_.end());
  std::sort(kept_.begin(), kept_.end());
}

void RunComponents::gather() {
  // Counting sort of the runs by component; the area's slot of a root becomes its place among those kept.
  std::fill(area_px2_.begin(), area_px2_.end(), kNotKept);
  for (std::uint32_t place = 0; place < kept_.size(); ++place) area_px2_[kept_[place]] = place;
  first_run_.assign(kept_.size() + 1, 0);
  std::size_t total = 0;
  for (std::uint32_t i = 0; i < runs_.size(); ++i) {
    parent_[i] = root_of(i);
    const std::uint32_t place = area_px2_[parent_[i]];
    if (place == kNotKept) continue;
    ++first_run_[place + 1];
    ++total;
  }
  for (std::size_t i = 1; i < first_run_.size(); ++i) first_run_[i] += first_run_[i - 1];
  sorted_.resize(total);
  for (std::uint32_t i = 0; i < runs_.size(); ++i) {
    const std::uint32_t place = area_px2_[parent_[i]];
    if (place != kNotKept) sorted_[first_run_[place]++] = runs_[i];
  }
  for (std::size_t i = first_run_.size() - 1; i > 0; --i) first_run_[i] = first_run_[i - 1];
  first_run_[0] = 0;
}

std::span<const Run> RunComponents::component(std::size_t i) const {
  MOCAP_EXPECTS(i < count());
  return std::span(sorted_).subspan(first_run_[i], first_run_[i + 1] - first_run_[i]);
}

}  // namespace mocap::stages
