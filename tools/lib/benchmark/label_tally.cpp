#include "lib/benchmark/label_tally.h"

#include <algorithm>
#include <functional>

#include "geometry/assignment.h"

namespace mocap::benchmark {
namespace {

std::optional<double> ratio(std::uint64_t part, std::uint64_t of) {
  if (of == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(of);
}

}  // namespace

LabelTally::LabelTally(std::size_t markers, double rate_hz)
    : classes_(markers + 1), rate_hz_(rate_hz), counts_(classes_ * classes_), wrong_run_(markers) {}

void LabelTally::add(std::span<const int> truth, std::span<const int> given) {
  std::vector<bool> wrong(wrong_run_.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i] == kUnknown) {
      ++unknown_points_;
      continue;
    }
    ++count(truth[i], given[i]);
    if (given[i] == kNull) continue;
    if (!first_) first_ = frames_;
    wrong[static_cast<std::size_t>(given[i])] = given[i] != truth[i];
  }
  for (std::size_t m = 0; m < wrong.size(); ++m) {
    wrong_run_[m] = wrong[m] ? wrong_run_[m] + 1 : 0;
    longest_wrong_ = std::max(longest_wrong_, wrong_run_[m]);
  }
  ++frames_;
}

std::uint64_t LabelTally::truths(std::size_t label) const {
  std::uint64_t sum = 0;
  for (std::size_t given = 0; given < classes_; ++given) sum += count(label, given);
  return sum;
}

std::uint64_t LabelTally::givens(std::size_t label) const {
  std::uint64_t sum = 0;
  for (std::size_t truth = 0; truth < classes_; ++truth) sum += count(truth, label);
  return sum;
}

void LabelTally::add_macro(LabelFigures& into) const {
  double f1 = 0.0, precision = 0.0, recall = 0.0, labels = 0.0;
  for (std::size_t label = 0; label < classes_; ++label) {
    const std::uint64_t right = count(label, label), of = truths(label), said = givens(label);
    if (of == 0) continue;
    labels += 1.0;
    f1 += 2.0 * static_cast<double>(right) / static_cast<double>(of + said);
    precision += ratio(right, said).value_or(0.0);
    recall += ratio(right, of).value_or(0.0);
  }
  if (labels == 0.0) return;
  into.macro_f1 = f1 / labels;
  into.macro_precision = precision / labels;
  into.macro_recall = recall / labels;
}

// The one-to-one mapping of true to given identities with most common points.
double LabelTally::identity_f1() const {
  const std::size_t markers = classes_ - 1;
  std::uint64_t most = 1, of = 0;
  for (std::size_t truth = 0; truth < markers; ++truth) {
    of += truths(truth) + givens(truth);
    for (std::size_t given = 0; given < markers; ++given) most = std::max(most, count(truth, given) + 1);
  }
  std::vector<geometry::AllowedPair> pairs;
  for (std::uint32_t truth = 0; truth < markers; ++truth) {
    for (std::uint32_t given = 0; given < markers; ++given) {
      if (const std::uint64_t common = count(truth, given); common > 0)
        pairs.push_back({truth, given, static_cast<double>(most - common)});
    }
  }
  geometry::Assigner assigner(markers, markers, std::max<std::size_t>(1, pairs.size()));
  const auto givens_of = assigner.assign(markers, markers, pairs, static_cast<double>(most));
  std::uint64_t common = 0;
  for (std::size_t truth = 0; truth < markers; ++truth) {
    if (givens_of[truth] != geometry::Assigner::kUnassigned) common += count(truth, givens_of[truth]);
  }
  return of == 0 ? 1.0 : 2.0 * static_cast<double>(common) / static_cast<double>(of);
}

std::vector<Confusion> LabelTally::confusions() const {
  std::vector<Confusion> all;
  for (std::size_t truth = 0; truth < classes_; ++truth) {
    for (std::size_t given = 0; given + 1 < classes_; ++given) {
      if (truth == given || count(truth, given) == 0) continue;
      all.push_back(
          {static_cast<int>(given), truth + 1 == classes_ ? kNull : static_cast<int>(truth), count(truth, given)});
    }
  }
  std::ranges::stable_sort(all, std::ranges::greater{}, &Confusion::points);
  return all;
}

LabelFigures LabelTally::figures() const {
  LabelFigures figures;
  figures.frames = frames_;
  figures.unknown_points = unknown_points_;
  std::uint64_t all_right = 0, labels_right = 0, labels = 0, markers = 0;
  for (std::size_t label = 0; label < classes_; ++label) {
    figures.points += truths(label);
    all_right += count(label, label);
    if (label + 1 == classes_) continue;
    labels_right += count(label, label);
    labels += givens(label);
    markers += truths(label);
  }
  add_macro(figures);
  figures.accuracy = ratio(all_right, figures.points);
  figures.label_precision = ratio(labels_right, labels);
  figures.label_recall = ratio(labels_right, markers);
  if (markers > 0) figures.idf1 = identity_f1();
  figures.wrong = labels - labels_right;
  figures.longest_wrong_frames = longest_wrong_;
  if (first_) figures.first_label_s = static_cast<double>(*first_) / rate_hz_;
  return figures;
}

}  // namespace mocap::benchmark
