#include "lib/join/seam.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "lib/join/agreement.h"
#include "lib/join/chunk_snapshots.h"

namespace mocap::join {
namespace {

// A set about which both chunks agree.
struct AgreedSet {
  Timestamp at;
  int differing_labels = 0;
};

Seam seam_in(std::span<const AgreedSet> run) {
  const Timestamp middle = run.front().at + (run.back().at - run.front().at) / 2;
  const AgreedSet& best = *std::ranges::min_element(run, {}, [&](const AgreedSet& set) {
    return std::pair(set.differing_labels, std::chrono::abs(set.at - middle));
  });
  return Seam{.at = best.at, .agrees = true, .differing_labels = best.differing_labels};
}

// Compares the sets that both chunks have.
class Comparison {
 public:
  void add(const v1::Snapshot& earlier, const v1::Snapshot& later) {
    last_at_ = time_of(earlier);
    const Agreement agreement = agreement_of(earlier, later);
    if (!agreement.holds) {
      run_begin_ = agreed_.size();
      return;
    }
    agreed_.push_back({*last_at_, agreement.differing_labels});
    const std::size_t run_size = agreed_.size() - run_begin_;
    if (run_size <= longest_size_) return;
    longest_begin_ = run_begin_;
    longest_size_ = run_size;
  }

  Seam seam(Timestamp end) const {
    if (agreed_.empty()) return Seam{.at = last_at_.value_or(end)};
    return seam_in(std::span(agreed_).subspan(longest_begin_, longest_size_));
  }

 private:
  std::optional<Timestamp> last_at_;
  std::vector<AgreedSet> agreed_;
  std::size_t run_begin_ = 0;  // in agreed_: of the run that has the last set
  std::size_t longest_begin_ = 0, longest_size_ = 0;
};

}  // namespace

Result<Seam> find_seam(const ChunkTake& earlier, const ChunkTake& later, const retrack::Span& overlap) {
  Comparison comparison;
  ChunkSnapshots earlier_sets(earlier, overlap), later_sets(later, overlap);
  auto one = earlier_sets.next();
  auto other = later_sets.next();
  while (one && other && *one && *other) {
    const Timestamp one_at = time_of(**one), other_at = time_of(**other);
    if (one_at == other_at) comparison.add(**one, **other);
    if (one_at <= other_at) one = earlier_sets.next();
    if (other_at <= one_at) other = later_sets.next();
  }
  if (!one) return one.error();
  if (!other) return other.error();
  return comparison.seam(overlap.to);
}

}  // namespace mocap::join
