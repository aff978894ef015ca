#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace mocap::benchmark {

/// Figures of the labels of one run, counted by points. Null is the label of a point that is no marker, and of a point
/// without a label. A figure without data is absent.
struct LabelFigures {
  std::uint64_t frames = 0, points = 0;
  std::uint64_t unknown_points = 0;  ///< not counted in any other figure, because their true label is unknown
  /// Means over all labels and null, as far as they occur in the truth (Ghorbani and Black 2021 count so).
  std::optional<double> macro_f1, macro_precision, macro_recall;
  std::optional<double> accuracy;         ///< share of the points with the right label or rightly null
  std::optional<double> label_precision;  ///< share of the given labels that are right
  std::optional<double> label_recall;     ///< share of the markers' points that have their label
  /// Identity F1, over markers (Ristani et al., "Performance Measures and a Data Set for Multi-Target, Multi-Camera
  /// Tracking", 2016).
  std::optional<double> idf1;
  std::uint64_t wrong = 0;                 ///< labels on the point of another marker or of none
  std::uint64_t longest_wrong_frames = 0;  ///< longest run of frames in which one label is wrong
  std::optional<double> first_label_s;
};

/// Points of one marker, or of none, that had the label of another one.
struct Confusion {
  int given = 0;   ///< label
  int truth = -1;  ///< true label; -1: no marker
  std::uint64_t points = 0;
};

/// Counts the labels of a run, frame by frame.
class LabelTally {
 public:
  static constexpr int kNull = -1;
  static constexpr int kUnknown = -2;  ///< truth of a point that is not counted

  LabelTally(std::size_t markers, double rate_hz);

  /// Adds a frame: the true label (or kUnknown) and the given label of each point, kNull or the index of a marker. A
  /// given label occurs once.
  void add(std::span<const int> truth, std::span<const int> given);

  /// Whether a point had a label in any frame.
  bool has_label() const { return first_.has_value(); }

  LabelFigures figures() const;

  /// All wrong labels by label and true label, most frequent first.
  std::vector<Confusion> confusions() const;

 private:
  std::uint64_t& count(int truth, int given) { return counts_[index(truth) * classes_ + index(given)]; }
  std::uint64_t count(std::size_t truth, std::size_t given) const { return counts_[truth * classes_ + given]; }
  std::size_t index(int label) const { return label < 0 ? classes_ - 1 : static_cast<std::size_t>(label); }
  std::uint64_t truths(std::size_t label) const;
  std::uint64_t givens(std::size_t label) const;
  void add_macro(LabelFigures& into) const;
  double identity_f1() const;

  std::size_t classes_;  // markers and null, which is the last
  double rate_hz_;
  std::vector<std::uint64_t> counts_;     // by true label, then by given label
  std::vector<std::uint64_t> wrong_run_;  // by marker: frames up to now in which its label is wrong
  std::uint64_t frames_ = 0, unknown_points_ = 0, longest_wrong_ = 0;
  std::optional<std::uint64_t> first_;  // frame
};

}  // namespace mocap::benchmark
