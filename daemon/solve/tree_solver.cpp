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

  const Poses& solve(Labels& labels, Timestamp at, std::span<const LabelledBearing> rays,
                     std::span<const AmbiguousObservation> ambiguous_observations) override {
    poses_.resize(labels.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      poses_[i].subject = labels[i].subject;
      poses_[i].bones.clear();
      if (labels[i].subject.value < subjects_.size())
        subjects_[labels[i].subject.value].solve(labels[i], rays, ambiguous_observations, at, poses_[i]);
    }
    return poses_;
  }

  void refit(const SubjectFit& fit) override {
    if (fit.subject.value < subjects_.size()) subjects_[fit.subject.value].refit(fit);
  }

  void predict(Timestamp at, Expected& into) const override {
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
      subjects_[i].predict(SubjectId{static_cast<std::uint32_t>(i)}, at, into);
    }
  }

 private:
  mutable std::vector<SubjectSolver> subjects_;  // predict uses their scratch
  Poses poses_;
};

}  // namespace

std::unique_ptr<SkeletonSolver> make_skeleton_solver(const SolveSettings& settings, std::vector<Subject> subjects) {
  return std::make_unique<TreeSolver>(settings, subjects);
}

}  // namespace mocap::solve
