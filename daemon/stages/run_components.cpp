#include "stages/run_components.h"

#include <algorithm>
#include <utility>

#include "base/expects.h"

namespace mocap::stages {
namespace {

constexpr std::uint32_t kNotKept = 0xFFFF'FFFF;

}  // namespace

RunComponents::RunComponents(std::size_t max_runs)
    : runs_(max_runs), parent_(max_runs), area_px2_(max_runs), sorted_(max_runs) {
  kept_.reserve(max_runs);
  first_run_.reserve(max_runs + 1);
}

void RunComponents::join(std::size_t count, std::uint32_t min_area_px2, std::uint32_t max_area_px2,
                         std::size_t max_count) {
  MOCAP_EXPECTS(count <= runs_.size());
  count_ = count;
  kept_.clear();
  first_run_.clear();
  too_small_ = too_large_ = dropped_ = 0;
  join_all();
  choose(min_area_px2, max_area_px2, max_count);
  gather();
}

void RunComponents::join_all() {
  std::uint32_t above = 0;      // the runs of the row above from here on may still touch
  std::uint32_t above_end = 0;  // and end where this row begins
  std::uint32_t row_begin = 0;
  for (std::uint32_t index = 0; index < count_; ++index) {
    const Run run = runs_[index];
    if (index == 0 || runs_[index - 1].y != run.y) {
      const bool next_row = index > 0 && runs_[index - 1].y + 1 == run.y;
      above = next_row ? row_begin : index;
      above_end = row_begin = index;
    }
    parent_[index] = index;
    area_px2_[index] = static_cast<std::uint32_t>(run.end - run.begin);
    // A corner touches: [begin - 1, end + 1) of this row against the runs above. Those that end before this run begins
    // cannot touch the next one either; the last that touches may.
    while (above < above_end && runs_[above].end < run.begin) ++above;
    for (std::uint32_t i = above; i < above_end && runs_[i].begin <= run.end; ++i) unite(index, i);
  }
}

std::uint32_t RunComponents::root_of(std::uint32_t run) {
  while (parent_[run] != run) {
    parent_[run] = parent_[parent_[run]];
    run = parent_[run];
  }
  return run;
}

void RunComponents::unite(std::uint32_t a, std::uint32_t b) {
  a = root_of(a);
  b = root_of(b);
  if (a == b) return;
  if (b < a) std::swap(a, b);
  parent_[b] = a;
  area_px2_[a] += area_px2_[b];
}

void RunComponents::choose(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count) {
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (parent_[i] != i) continue;
    if (area_px2_[i] < min_area_px2) {
      ++too_small_;
    } else if (area_px2_[i] > max_area_px2) {
      ++too_large_;
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
  std::fill_n(area_px2_.begin(), count_, kNotKept);
  for (std::uint32_t place = 0; place < kept_.size(); ++place) area_px2_[kept_[place]] = place;
  first_run_.assign(kept_.size() + 1, 0);
  for (std::uint32_t i = 0; i < count_; ++i) {
    parent_[i] = root_of(i);
    const std::uint32_t place = area_px2_[parent_[i]];
    if (place == kNotKept) continue;
    ++first_run_[place + 1];
  }
  for (std::size_t i = 1; i < first_run_.size(); ++i) first_run_[i] += first_run_[i - 1];
  for (std::uint32_t i = 0; i < count_; ++i) {
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
