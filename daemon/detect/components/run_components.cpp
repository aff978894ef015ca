#include "detect/components/run_components.h"

#include <algorithm>

#include "base/expects.h"

namespace mocap::detect {
namespace {

constexpr std::uint32_t kNotKept = 0xFFFF'FFFF;

}  // namespace

RunComponents::RunComponents(std::size_t max_runs)
    : runs_(max_runs), label_of_(max_runs), labels_(max_runs), next_(max_runs), sorted_(max_runs) {
  selected_.reserve(max_runs);
  first_run_.reserve(max_runs + 1);
}

void RunComponents::join(std::size_t count, std::uint32_t min_area_px2, std::uint32_t max_area_px2,
                         std::size_t max_count) {
  MOCAP_EXPECTS(count <= runs_.size());
  run_count_ = count;
  selected_.clear();
  first_run_.clear();
  too_small_ = too_large_ = dropped_ = 0;
  join_all();
  choose(min_area_px2, max_area_px2, max_count);
}

void RunComponents::join_all() {
  const Run* const runs = runs_.data();
  const auto count = static_cast<std::uint32_t>(run_count_);
  std::uint32_t labels = 0;
  std::uint32_t above = 0;      // first run of the row above that may touch the current run
  std::uint32_t above_end = 0;  // end of the runs of the row above
  std::uint32_t row_begin = 0;
  std::uint32_t row_y = 0xFFFF'FFFE;  // no row
  for (std::uint32_t index = 0; index < count; ++index) {
    const Run run = runs[index];
    if (run.y != row_y) {
      above = run.y == row_y + 1 ? row_begin : index;
      above_end = row_begin = index;
      row_y = run.y;
    }
    // 8-connectivity: a run touches the pixels [begin - 1, end + 1) of the row above. A run above that ends before this
    // run begins cannot touch the next run either, but the last run above that touches this run may.
    while (above < above_end && runs[above].end < run.begin) ++above;
    std::uint32_t label;
    if (above < above_end && runs[above].begin <= run.end) {
      label = root_of(label_of_[above]);
      for (std::uint32_t i = above + 1; i < above_end && runs[i].begin <= run.end; ++i)
        label = unite(label, label_of_[i]);
    } else {
      label = labels++;
      labels_[label] = {label, 0, run.begin, {.begin_x = run.begin, .begin_y = run.y}};
    }
    labels_[label].sums.add(run);
    ++labels_[label].runs;
    label_of_[index] = label;
  }
  label_count_ = labels;
}

std::uint32_t RunComponents::root_of(std::uint32_t label) {
  while (labels_[label].parent != label) {
    labels_[label].parent = labels_[labels_[label].parent].parent;
    label = labels_[label].parent;
  }
  return label;
}

std::uint32_t RunComponents::unite(std::uint32_t a, std::uint32_t b) {
  b = root_of(b);
  if (a == b) return a;
  const std::uint32_t root = std::min(a, b), other = std::max(a, b);
  labels_[other].parent = root;
  labels_[root].sums.add(labels_[other].sums);
  labels_[root].runs += labels_[other].runs;
  return root;
}

void RunComponents::choose(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count) {
  for (std::uint32_t i = 0; i < label_count_; ++i) {
    if (labels_[i].parent != i) continue;
    if (labels_[i].sums.n < min_area_px2) {
      ++too_small_;
    } else if (labels_[i].sums.n > max_area_px2) {
      ++too_large_;
    } else {
      selected_.push_back(i);
    }
  }
  if (selected_.size() <= max_count) return;
  const auto larger = [this](std::uint32_t a, std::uint32_t b) {
    return labels_[a].sums.n != labels_[b].sums.n ? labels_[a].sums.n > labels_[b].sums.n : a < b;
  };
  const auto bound = selected_.begin() + static_cast<std::ptrdiff_t>(max_count);
  std::nth_element(selected_.begin(), bound, selected_.end(), larger);
  dropped_ += static_cast<std::uint32_t>(selected_.size() - max_count);
  selected_.erase(bound, selected_.end());
  std::sort(selected_.begin(), selected_.end());
}

void RunComponents::gather() {
  // Counting sort of the runs by component. The parent of a label is never larger than the label, so one pass finds all
  // roots.
  std::fill_n(next_.begin(), label_count_, kNotKept);
  std::uint32_t first = 0;
  for (const std::uint32_t root : selected_) {
    first_run_.push_back(first);
    next_[root] = first;
    first += labels_[root].runs;
  }
  first_run_.push_back(first);
  for (std::uint32_t i = 0; i < label_count_; ++i) labels_[i].parent = labels_[labels_[i].parent].parent;
  for (std::size_t i = 0; i < run_count_; ++i) {
    std::uint32_t& next = next_[labels_[label_of_[i]].parent];
    if (next != kNotKept) sorted_[next++] = runs_[i];
  }
}

std::span<const Run> RunComponents::runs(std::size_t i) {
  MOCAP_EXPECTS(i < count());
  if (first_run_.empty()) gather();
  return std::span(sorted_).subspan(first_run_[i], first_run_[i + 1] - first_run_[i]);
}

}  // namespace mocap::detect
