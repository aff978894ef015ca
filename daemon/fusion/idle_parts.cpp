#include "fusion/idle_parts.h"

namespace mocap::fusion {
namespace {

class IdleMatcher final : public Matcher {
 public:
  const Matches& match(const FrameSet& /*frames*/, const Predictions& /*predicted*/) override { return none_; }

 private:
  Matches none_;
};

class IdleTriangulator final : public Triangulator {
 public:
  const Markers& triangulate(const FrameSet& /*frames*/, const Matches& /*matches*/) override { return none_; }

 private:
  Markers none_;
};

class IdleTracker final : public MarkerTracker {
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

class IdleLabeller final : public Labeller {
 public:
  const Labelling& label(const TrackedMarkers& /*tracked*/, const Predictions& /*predicted*/) override { return none_; }
  void refit(const SubjectFit& /*fit*/) override {}

 private:
  Labelling none_;
};

class IdleSolver final : public SkeletonSolver {
 public:
  const SolvedSubjects& solve(const Labels& /*labels*/, Timestamp /*at*/, std::span<const LabelledBearing> /*bearings*/,
                              std::span<const AmbiguousObservation> /*ambiguous*/) override {
    return solved_;
  }
  void refit(const SubjectFit& /*fit*/) override {}
  const PredictedMarkers& predict(Timestamp /*at*/) override { return predicted_; }

 private:
  SolvedSubjects solved_;
  PredictedMarkers predicted_;
};

}  // namespace

FusionParts make_idle_parts() {
  FusionParts parts;
  parts.matcher = std::make_unique<IdleMatcher>();
  parts.triangulator = std::make_unique<IdleTriangulator>();
  parts.tracker = std::make_unique<IdleTracker>();
  parts.labeller = std::make_unique<IdleLabeller>();
  parts.solver = std::make_unique<IdleSolver>();
  return parts;
}

}  // namespace mocap::fusion
