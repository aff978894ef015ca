#pragma once

#include <span>

#include "fusion/fusion.h"

// Parts that find no marker and no skeleton: for a node, whose blobs another daemon fuses, and for tests of the code
// around the fusion.
namespace mocap::fusion {

class IdleMatcher : public Matcher {
 public:
  const Matches& match(const FrameSet& /*frames*/, const Predictions& /*predicted*/) override { return none_; }

 private:
  Matches none_;
};

class IdleTriangulator : public Triangulator {
 public:
  const Markers& triangulate(const FrameSet& /*frames*/, const Matches& /*matches*/) override { return none_; }

 private:
  Markers none_;
};

class IdleTracker : public MarkerTracker {
 public:
  const PredictedMarkers& predict(Timestamp /*at*/) override { return predicted_; }
  const TrackedMarkers& step(const Markers& /*markers*/, const Predictions& /*predicted*/,
                             std::span<const BearingOnlyObservation> /*bearing_only*/,
                             std::span<const CandidatePoint> /*candidates*/) override {
    return tracked_;
  }

 private:
  PredictedMarkers predicted_;
  TrackedMarkers tracked_;
};

class IdleLabeller : public Labeller {
 public:
  const Labelling& label(const TrackedMarkers& /*tracked*/, const Predictions& /*predicted*/) override { return none_; }
  void refit(const SubjectFit& /*fit*/) override {}

 private:
  Labelling none_;
};

class IdleSolver : public SkeletonSolver {
 public:
  const SolvedSubjects& solve(const Labels& labels, Timestamp /*at*/, std::span<const LabelledBearing> /*bearings*/,
                              std::span<const AmbiguousObservation> /*ambiguous*/) override {
    solved_.labels = labels;
    return solved_;
  }
  void refit(const SubjectFit& /*fit*/) override {}
  const PredictedMarkers& predict(Timestamp /*at*/) override { return predicted_; }

 private:
  SolvedSubjects solved_;
  PredictedMarkers predicted_;
};

/// All parts idle: a snapshot then has the views of its set and nothing else.
FusionParts make_idle_parts();

}  // namespace mocap::fusion
