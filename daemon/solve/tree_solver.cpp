#include "solve/tree_solver.h"

#include <vector>

#include "base/expects.h"
#include "solve/subject_solver.h"

namespace mocap::solve {
namespace {

class TreeSolver final : public SkeletonSolver {
 public:
  TreeSolver(const SolveSettings& settings, const std::vector<Subject>& subjects) {
    MOCAP_EXPECTS(subjects.size() <= kMaxSubjects);
    subjects_.reserve(subjects.size());
    for (const Subject& subject : subjects) subjects_.emplace_back(settings, subject);
  }

  const SolvedSubjects& solve(const Labels& given, Timestamp at, std::span<const LabelledBearing> rays,
                              std::span<const AmbiguousObservation> ambiguous_observations) override {
    auto& [labels, poses] = solved_;
    labels = given;
    poses.resize(labels.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      poses[i].subject = labels[i].subject;
      poses[i].bones.clear();
      if (labels[i].subject.value < subjects_.size())
        subjects_[labels[i].subject.value].solve(labels[i], rays, ambiguous_observations, at, poses[i]);
    }
    return solved_;
  }

  void refit(const SubjectFit& fit) override {
    if (fit.subject.value < subjects_.size()) subjects_[fit.subject.value].refit(fit);
  }

  const PredictedMarkers& predict(Timestamp at) override {
    predictions_.clear();
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
      subjects_[i].predict(SubjectId{static_cast<std::uint32_t>(i)}, at, predictions_);
    }
    return predictions_;
  }

  void adopt(SkeletonSolver& before, const Handover& handover) override {
    auto* same = dynamic_cast<TreeSolver*>(&before);
    if (same == nullptr) return;
    for (std::size_t i = 0; i < subjects_.size() && i < handover.subjects.size(); ++i) {
      const std::size_t from = handover.subjects[i].value;
      if (from >= same->subjects_.size()) continue;
      subjects_[i].adopt(same->subjects_[from]);
      if (!handover.poses) subjects_[i].end_track();
    }
  }

  void archive(Archive& members) override {
    for (SubjectSolver& subject : subjects_) members(subject);
  }

 private:
  std::vector<SubjectSolver> subjects_;
  SolvedSubjects solved_;
  PredictedMarkers predictions_;
};

}  // namespace

std::unique_ptr<SkeletonSolver> make_skeleton_solver(const SolveSettings& settings, std::vector<Subject> subjects) {
  return std::make_unique<TreeSolver>(settings, subjects);
}

}  // namespace mocap::solve
