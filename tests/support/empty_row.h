#pragma once

#include <memory>
#include <span>

#include "fusion/fusion.h"

namespace mocap::support {

/// Fusion parts that return empty results, for tests of the code around the fusion.
class EmptyMatcher : public Matcher {
 public:
  const Matches& match(const FrameSet&, const Predictions&) override { return nothing_; }

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
  const PredictedMarkers& predict(Timestamp) override { return no_predictions_; }
  const TrackedMarkers& step(const Markers&, const Predictions&, std::span<const BearingOnlyObservation>,
                             std::span<const CandidatePoint>) override {
    return nothing_;
  }

 private:
  PredictedMarkers no_predictions_;
  TrackedMarkers nothing_;
};

class EmptyLabeller : public Labeller {
 public:
  const Labelling& label(const TrackedMarkers&, const Predictions&) override { return nothing_; }
  void refit(const SubjectFit& /*fit*/) override {}

 private:
  Labelling nothing_;
};

class EmptySolver : public SkeletonSolver {
 public:
  const SolvedSubjects& solve(const Labels& labels, Timestamp, std::span<const LabelledBearing>,
                              std::span<const AmbiguousObservation>) override {
    nothing_.labels = labels;
    return nothing_;
  }
  void refit(const SubjectFit&) override {}
  const PredictedMarkers& predict(Timestamp) override { return no_predictions_; }

 private:
  PredictedMarkers no_predictions_;
  SolvedSubjects nothing_;
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
