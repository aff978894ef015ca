#include "solve/pose_collection.h"

#include <algorithm>
#include <limits>

namespace mocap::solve {

using bodyfit::BodyInstant;
using bodyfit::pose_distance;

void copy(const BodyInstant& from, BodyInstant& to) {
  std::copy(from.seen_m.begin(), from.seen_m.end(), to.seen_m.begin());
  std::copy(from.trust.begin(), from.trust.end(), to.trust.begin());
  std::copy(from.locals.begin(), from.locals.end(), to.locals.begin());
  std::copy(from.at_rest.begin(), from.at_rest.end(), to.at_rest.begin());
}

PoseCollection::PoseCollection(const MarkerSet& set, std::size_t capacity)
    : collected_(capacity, bodyfit::empty_instant(set)), distances_(capacity * capacity) {}

double PoseCollection::nearest(const BodyInstant& to) const {
  double least = std::numeric_limits<double>::infinity();
  for (const BodyInstant& one : collected()) least = std::min(least, pose_distance(one.locals, to.locals));
  return least;
}

bool PoseCollection::add_if_different(const BodyInstant& instant) {
  const double differs = nearest(instant);
  if (size_ < collected_.size()) {
    put(size_++, instant);
    return true;
  }
  std::size_t alike = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < size_; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (distances_[i * collected_.size() + j] < least) {
        least = distances_[i * collected_.size() + j];
        alike = i;
      }
    }
  }
  if (!(differs > least)) return false;
  put(alike, instant);
  return true;
}

void PoseCollection::archive(Archive& members) {
  size_ = members.count(size_, collected_.size());
  for (std::size_t i = 0; i < size_; ++i) {
    members(collected_[i]);
    for (std::size_t j = 0; j < i; ++j) members(distances_[i * collected_.size() + j]);
  }
}

void PoseCollection::put(std::size_t at, const BodyInstant& instant) {
  copy(instant, collected_[at]);
  for (std::size_t i = 0; i < size_; ++i) {
    const double distance = i == at ? 0.0 : pose_distance(collected_[i].locals, instant.locals);
    distances_[i * collected_.size() + at] = distances_[at * collected_.size() + i] = distance;
  }
}

}  // namespace mocap::solve
