#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "identify/distance_constraints.h"

namespace mocap::label {

/// Finds which of a few places are which of a few markers, by the distances that the body keeps: the cheapest readings
/// of a limb, mirrored ones among them, for somebody to judge who knows how joints turn.
///
/// Allocates in the constructor only.
class TieReader {
 public:
  static constexpr std::size_t kMostNames = 16;
  static constexpr std::size_t kMostPlaces = 40;
  static constexpr std::size_t kMostReadings = 6;
  static constexpr int kNowhere = -1;

  struct Reading {
    double cost = 0.0;
    std::array<std::int8_t, kMostNames> place_of{};  ///< by name in the order of `add_name`; kNowhere
  };

  TieReader();

  void clear();
  /// False when there are too many already.
  bool add_name(std::size_t marker);
  bool add_place(const Eigen::Vector3d& at);
  std::size_t names() const { return names_; }
  std::size_t places() const { return places_; }
  std::size_t marker(std::size_t name) const { return markers_[name]; }
  const Eigen::Vector3d& place(std::size_t place) const { return at_[place]; }

  /// What it costs, in half squared sigmas, that a name is at a place. A name may be nowhere else.
  void allow(std::size_t name, std::size_t place, double cost);

  /// The cheapest readings, best first; a name that is nowhere costs `nowhere`. Borrowed until the next call.
  std::span<const Reading> read(const identify::MarkerTies& ties, double nowhere);
  /// Who else may be where `but` has a name: the cheapest `most` readings in which it is nowhere, and all others as
  /// before, nowhere or, which were nowhere, anywhere.
  std::span<const Reading> read_otherwise(const identify::MarkerTies& ties, double nowhere, std::size_t name,
                                          const Reading& but, std::size_t most);

  /// What it costs that two markers so tied are `apart_m`.
  static double cost_of(const identify::Tie& tie, double apart_m);

 private:
  struct Choice {
    std::int8_t place = kNowhere;
    double cost = 0.0;
  };

  bool open(std::size_t name, std::size_t place, double nowhere) const;
  void prepare(const identify::MarkerTies& ties, double nowhere);
  void search(std::size_t depth, double cost, double nowhere);
  void keep(double cost);
  double tied(std::size_t depth, std::size_t place) const;

  std::size_t names_ = 0;
  std::size_t places_ = 0;
  std::array<std::size_t, kMostNames> markers_{};
  std::array<Eigen::Vector3d, kMostPlaces> at_;
  std::array<std::array<double, kMostPlaces>, kMostNames> costs_{};
  std::array<std::array<const identify::Tie*, kMostNames>, kMostNames> tie_{};  // null: none
  std::array<std::array<Choice, kMostPlaces>, kMostNames> choices_{};       // by name, cheapest first
  std::array<std::size_t, kMostNames> choice_count_{};
  std::array<std::size_t, kMostNames> order_{};
  std::array<bool, kMostPlaces> taken_{};
  std::array<std::int8_t, kMostNames> now_{};
  int steps_left_ = 0;
  std::size_t most_ = kMostReadings;
  const Reading* but_ = nullptr;  // names that are somewhere there have no other place
  std::vector<Reading> readings_;
};

}  // namespace mocap::label
