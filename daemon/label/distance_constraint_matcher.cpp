#include "label/distance_constraint_matcher.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace mocap::label {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
// Skin: what a distance on the body is wrong by, beside a share of it.
constexpr double kTieSigma_m = 0.008;
constexpr double kTieSigmaShare = 0.02;
// A distance that is wrong by more is wrong; no two markers are told from each other by how much.
constexpr double kMostTieCost = 20.0;
// Bounds the time of a search; the best reading is among the first in all but a crowd.
constexpr int kMostSteps = 6000;

}  // namespace

TieReader::TieReader() { readings_.reserve(kMostReadings + 1); }

void TieReader::clear() {
  names_ = places_ = 0;
  readings_.clear();
}

bool TieReader::add_name(std::size_t marker) {
  if (names_ == kMostNames) return false;
  markers_[names_] = marker;
  costs_[names_].fill(kNever);
  ++names_;
  return true;
}

bool TieReader::add_place(const Eigen::Vector3d& at) {
  if (places_ == kMostPlaces) return false;
  at_[places_++] = at;
  return true;
}

void TieReader::allow(std::size_t name, std::size_t place, double cost) { costs_[name][place] = cost; }

double TieReader::cost_of(const identify::Tie& tie, double apart_m) {
  const double over = std::max({tie.least_m - apart_m, apart_m - tie.most_m, 0.0});
  const double sigmas = over / (kTieSigma_m + kTieSigmaShare * tie.most_m);
  return std::min(0.5 * sigmas * sigmas, kMostTieCost);
}

bool TieReader::open(std::size_t name, std::size_t place, double nowhere) const {
  if (!(costs_[name][place] < nowhere)) return false;
  return but_ == nullptr || but_->place_of[name] == kNowhere || but_->place_of[name] == static_cast<int>(place);
}

// Names whose ties to those before them tell most come first, so that what cannot be ends early.
void TieReader::prepare(const identify::MarkerTies& ties, double nowhere) {
  for (std::size_t a = 0; a < names_; ++a) {
    tie_[a].fill(nullptr);
    for (const identify::Tie& tie : ties.of(markers_[a])) {
      for (std::size_t b = 0; b < names_; ++b) {
        if (markers_[b] == static_cast<std::size_t>(tie.other)) tie_[a][b] = &tie;
      }
    }
    choice_count_[a] = 0;
    for (std::size_t p = 0; p < places_; ++p) {
      if (open(a, p, nowhere)) choices_[a][choice_count_[a]++] = {static_cast<std::int8_t>(p), costs_[a][p]};
    }
    std::stable_sort(choices_[a].begin(), choices_[a].begin() + static_cast<std::ptrdiff_t>(choice_count_[a]),
                     [](const Choice& x, const Choice& y) { return x.cost < y.cost; });
  }
  std::array<bool, kMostNames> ordered{};
  for (std::size_t i = 0; i < names_; ++i) {
    double best_score = -kNever;
    for (std::size_t n = 0; n < names_; ++n) {
      if (ordered[n]) continue;
      double score = -0.1 * static_cast<double>(choice_count_[n]);
      for (std::size_t k = 0; k < i; ++k) {
        const identify::Tie* tie = tie_[n][order_[k]];
        if (tie != nullptr) score += tie->rigid ? 1.0 : 0.25;
      }
      if (score > best_score) {
        best_score = score;
        order_[i] = n;
      }
    }
    ordered[order_[i]] = true;
  }
}

double TieReader::tied(std::size_t depth, std::size_t place) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < depth; ++k) {
    const std::size_t other = order_[k];
    const identify::Tie* tie = tie_[order_[depth]][other];
    if (tie == nullptr || now_[other] == kNowhere) continue;
    sum += cost_of(*tie, (at_[place] - at_[static_cast<std::size_t>(now_[other])]).norm());
  }
  return sum;
}

void TieReader::keep(double cost) {
  const auto at = std::upper_bound(readings_.begin(), readings_.end(), cost,
                                   [](double value, const Reading& other) { return value < other.cost; });
  readings_.insert(at, Reading{cost, now_});
  if (readings_.size() > most_) readings_.pop_back();
}

void TieReader::search(std::size_t depth, double cost, double nowhere) {
  if (--steps_left_ < 0) return;
  if (readings_.size() == most_ && cost >= readings_.back().cost) return;
  if (depth == names_) {
    keep(cost);
    return;
  }
  const std::size_t name = order_[depth];
  for (std::size_t c = 0; c < choice_count_[name]; ++c) {
    const Choice& choice = choices_[name][c];
    const auto place = static_cast<std::size_t>(choice.place);
    if (taken_[place]) continue;
    const double more = choice.cost + tied(depth, place);
    if (more > nowhere) continue;  // better nowhere
    taken_[place] = true;
    now_[name] = choice.place;
    search(depth + 1, cost + more, nowhere);
    taken_[place] = false;
  }
  now_[name] = kNowhere;
  search(depth + 1, cost + nowhere, nowhere);
}

std::span<const TieReader::Reading> TieReader::read(const identify::MarkerTies& ties, double nowhere) {
  readings_.clear();
  prepare(ties, nowhere);
  taken_.fill(false);
  now_.fill(kNowhere);
  steps_left_ = kMostSteps;
  search(0, 0.0, nowhere);
  return readings_;
}

std::span<const TieReader::Reading> TieReader::read_otherwise(const identify::MarkerTies& ties, double nowhere,
                                                              std::size_t name, const Reading& but, std::size_t most) {
  double& own = costs_[name][static_cast<std::size_t>(but.place_of[name])];
  const double cost = std::exchange(own, kNever);
  most_ = std::min(most, kMostReadings);
  but_ = &but;
  (void)read(ties, nowhere);
  but_ = nullptr;
  most_ = kMostReadings;
  own = cost;
  return readings_;
}

}  // namespace mocap::label
