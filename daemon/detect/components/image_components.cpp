#include "detect/components/image_components.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "base/loops.h"

namespace mocap::detect {
namespace {

// Bounds on the number of runs of an image and of a row. More runs are noise over the threshold, and the bounds limit
// the work. A marker of radius 4 px has 9 runs.
constexpr std::size_t kPixelsPerRun = 160;
constexpr std::size_t kMinMaxRuns = 8192;  // kMaxBlobs blobs of 16 rows
constexpr std::size_t kRowPixelsPerRun = 40;
constexpr std::size_t kMinRowRunBound = 32;
constexpr std::size_t kMinNoiseWords = 4;  // a noise row has more bright words, and more than 3/4 of its words

std::size_t max_runs(int width_px, int height_px) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  return std::max(kMinMaxRuns, pixels / kPixelsPerRun);
}

/// Writes the runs of the words, which are in the order of rows and x. Returns the number of runs.
std::size_t extract_runs(const WordPlaces& places, std::span<const BrightWord> words, Run* out) {
  Run* end = out;
  // The word in which the last run continues, if the first pixel of that word is bright.
  std::uint32_t goes_on_at = std::numeric_limits<std::uint32_t>::max();
  for (const BrightWord& each : words) {
    const auto y = static_cast<std::uint16_t>(places.y(each));
    const int x = places.x(each, y);
    std::uint64_t bits = each.bits;
    end -= (bits & 1U) != 0 && each.place == goes_on_at ? 1 : 0;
    bool is_new = each.place != goes_on_at || (bits & 1U) == 0;
    goes_on_at = (bits >> 63U) != 0 ? each.place + 1 : std::numeric_limits<std::uint32_t>::max();
    while (bits != 0) {
      const int begin = std::countr_zero(bits), length = std::countr_one(bits >> begin);
      *end = {y, is_new ? static_cast<std::uint16_t>(x + begin) : end->begin,
              static_cast<std::uint16_t>(x + begin + length)};
      ++end;
      is_new = true;
      bits &= bits + (1ULL << begin);
    }
  }
  return static_cast<std::size_t>(end - out);
}

/// The number of runs. Stops counting above `limit`: noise has too many runs to count.
MOCAP_BITS std::size_t runs_in(std::span<const BrightWord> words, std::size_t limit) {
  std::size_t runs = 0;
  BrightWord last;
  for (const BrightWord& each : words) {
    runs += runs_begun(last, each);
    last = each;
    if (runs > limit) break;
  }
  return runs;
}

using RunBounds = std::array<std::size_t, BrightWords::kParts>;

/// Shares the bound on the runs of an image among its parts so that the least share is as large as possible: a part
/// with fewer runs than an equal share leaves the rest to the others (max-min fairness: Bertsekas and Gallager, Data
/// Networks, 2nd ed. (1992), section 6.5.2). Noise in one part cannot take the share of another.
RunBounds share_of_runs(BrightWords& words, std::size_t max_runs) {
  RunBounds runs{};
  std::array<std::size_t, BrightWords::kParts> order{};
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = i;
    runs[i] = runs_in(words.part(static_cast<int>(i)), max_runs);
  }
  std::ranges::sort(order, {}, [&](std::size_t i) { return runs[i]; });
  std::size_t left = max_runs;
  for (std::size_t k = 0; k < order.size(); ++k) {
    std::size_t& bound = runs[order[k]];
    const std::size_t share = left / (order.size() - k);
    left -= std::min(bound, share);
    bound = share;
  }
  return runs;
}

std::span<BrightWord> first_row(const WordPlaces& places, std::span<BrightWord> words) {
  const std::uint32_t next_row = places.of(places.y(words.front()) + 1, 0);
  const auto end = std::ranges::find_if(words, [=](const BrightWord& each) { return each.place >= next_row; });
  return words.first(static_cast<std::size_t>(end - words.begin()));
}

std::uint32_t rows_of(const WordPlaces& places, std::span<BrightWord> words) {
  std::uint32_t rows = 0;
  for (; !words.empty(); ++rows) words = words.subspan(first_row(places, words).size());
  return rows;
}

/// A number that orders pixels by row, then x.
std::uint32_t pixel_place(int y, int x) { return static_cast<std::uint32_t>(y) << 16U | static_cast<std::uint32_t>(x); }

}  // namespace

ImageComponents::ImageComponents(int width_px, int height_px, std::span<const MaskPolygon> masks)
    : max_runs_(max_runs(width_px, height_px)),
      row_run_bound_(std::max(kMinRowRunBound, static_cast<std::size_t>(width_px) / kRowPixelsPerRun)),
      noise_words_(std::max(kMinNoiseWords, 3 * static_cast<std::size_t>(words_of(width_px)) / 4)),
      mask_(masks, width_px, height_px),
      word_room_(BrightWords::room_for(width_px, height_px)),
      words_(word_room_, width_px, height_px),
      walker_(width_px, height_px, max_runs_),
      joined_(max_runs_ + BrightWords::kParts * 32) {
  selected_.reserve(max_runs_);
}

void ImageComponents::join(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count) {
  rows_given_up_ = 0;
  for (int i = 0; i < BrightWords::kParts; ++i) {
    const std::span<BrightWord> words = words_.part(i);
    if (!mask_.empty()) mask_.clear_masked(words);
    if (words_.max_words_in_row() > noise_words_) reject_noise_rows(words);
    walker_.draw(words);
  }
  const RunBounds bounds = share_of_runs(words_, max_runs_);
  walker_.begin_image();
  std::size_t runs = 0;
  std::array<std::span<BrightWord>, BrightWords::kParts> left;
  for (int i = 0; i < BrightWords::kParts; ++i) {
    const auto walked = walker_.walk(words_.part(i), min_area_px2, bounds[static_cast<std::size_t>(i)]);
    rows_given_up_ += rows_of(words_.places(), walked.unread);
    runs += extract_runs(words_.places(), walked.left, joined_.room().data() + runs);
    left[static_cast<std::size_t>(i)] = walked.left;
  }
  for (const auto& of_part : left) walker_.wipe(of_part);
  joined_.join(runs, min_area_px2, max_area_px2, max_count);
  too_small_ = walker_.too_small() + joined_.too_small();
  too_large_ = joined_.too_large();
  dropped_ = joined_.dropped();
  merge(max_area_px2);
  keep_largest(max_count);
}

void ImageComponents::reject_noise_rows(std::span<BrightWord> words) {
  while (!words.empty()) {
    const std::span<BrightWord> row = first_row(words_.places(), words);
    words = words.subspan(row.size());
    if (row.size() <= noise_words_ || runs_in(row, row_run_bound_) <= row_run_bound_) continue;
    ++rows_given_up_;
    for (BrightWord& each : row) each.bits = 0;
  }
}

void ImageComponents::merge(std::uint32_t max_area_px2) {
  selected_.clear();
  std::uint32_t next = 0;  // index of the next component of joined_
  const auto add_joined_before = [&](std::uint64_t first_px) {
    for (; next < joined_.count(); ++next) {
      const std::uint32_t at = pixel_place(joined_.sums(next).begin_y, joined_.first_x(next));
      if (at >= first_px) break;
      selected_.push_back({at, next, false});
    }
  };
  const std::span<const PlainComponent> plain = walker_.found();
  for (std::uint32_t i = 0; i < plain.size(); ++i) {
    const std::uint32_t at = pixel_place(plain[i].sums.begin_y, plain[i].first_x);
    add_joined_before(at);
    if (plain[i].sums.n > max_area_px2) {
      ++too_large_;
    } else {
      selected_.push_back({at, i, true});
    }
  }
  add_joined_before(std::numeric_limits<std::uint64_t>::max());
}

void ImageComponents::keep_largest(std::size_t max_count) {
  if (selected_.size() <= max_count) return;
  dropped_ += static_cast<std::uint32_t>(selected_.size() - max_count);
  const auto comes_first = [](const SelectedComponent& a, const SelectedComponent& b) {
    return a.first_px < b.first_px;
  };
  const auto larger = [&](const SelectedComponent& a, const SelectedComponent& b) {
    return sums(a).n != sums(b).n ? sums(a).n > sums(b).n : comes_first(a, b);
  };
  const auto bound = selected_.begin() + static_cast<std::ptrdiff_t>(max_count);
  std::nth_element(selected_.begin(), bound, selected_.end(), larger);
  selected_.erase(bound, selected_.end());
  std::sort(selected_.begin(), selected_.end(), comes_first);
}

std::span<const Run> ImageComponents::runs(std::size_t i) {
  const SelectedComponent& selected = selected_[i];
  return selected.is_plain ? walker_.runs(walker_.found()[selected.index]) : joined_.runs(selected.index);
}

bool ImageComponents::touches_mask(std::size_t i) {
  const RunSums& box = sums(selected_[i]);
  return mask_.may_touch(box.begin_x, box.end_x, box.begin_y, box.end_y) &&
         std::ranges::any_of(runs(i), [this](const Run& run) { return mask_.touches(run); });
}

}  // namespace mocap::detect
