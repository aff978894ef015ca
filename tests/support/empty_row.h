#pragma once

#include <memory>
#include <span>

#include "fusion/fusion.h"

namespace mocap::support {

/// A row that finds nothing: for tests of what is around it.
class EmptyMatcher : public Matcher {
 public:
  const Matches& match(const FrameSet&, const Expected&) override { return nothing_; }

 private:
  Matches nothing_;
};

class EmptyTriangulator : public Triangulator {
 public:
  const Markers& triangulate(const FrameSet&, const Matches&) override { return nothing_; }

 private:
  Markers nothing_;
};

class EmptyTracker : public MarkerTracker {
 public:
  void predict(Timestamp, Expected&) const override {}
  const TrackedMarkers& step(const Markers&, const Expected&, std::span<const BearingOnlyObservation>) override {
    return nothing_;
  }

 private:
  TrackedMarkers nothing_;
};

class EmptyLabeller : public Labeller {
 public:
  const Labels& label(const TrackedMarkers&, const Expected&) override { return nothing_; }
  std::span<const AmbiguousObservation> ambiguous_observations() const override { return {}; }
  std::optional<SubjectFit> take_fit() override { return std::nullopt; }
  void refit(const SubjectFit& /*fit*/) override {}

 private:
  Labels nothing_;
};

class EmptySolver : public SkeletonSolver {
 public:
  const Poses& solve(Labels&, Timestamp, std::span<const LabelledBearing>,
                     std::span<const AmbiguousObservation>) override {
    return nothing_;
  }
  void refit(const SubjectFit&) override {}
  void predict(Timestamp, Expected&) const override {}

 private:
  Poses nothing_;
};

inline fusion::FusionParts empty_row() {
  fusion::FusionParts parts;
  parts.matcher = std::make_unique<EmptyMatcher>();
  parts.triangulator = std::make_unique<EmptyTriangulator>();
  parts.tracker = std::make_unique<EmptyTracker>();
  parts.labeller = std::make_unique<EmptyLabeller>();
  parts.solver = std::make_unique<EmptySolver>();
  return parts;
}

}  // namespace mocap::support
