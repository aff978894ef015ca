#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bodyfit/body_offsets.h"
#include "bodyfit/instant_equations.h"
#include "bodyfit/offset_equations.h"
#include "model/skeleton.h"

namespace mocap::bodyfit {

/// How far off a marker is that counts less and less, m: at first, when nobody knows where it sits, and in the end.
struct OutlierScale {
  double first_m = 0.08;
  double least_m = 0.02;
};

/// How a fit takes turns, one piece of work at a time: all poses to the offsets at hand, the equations of the offsets
/// from all poses, their solution, and again. So it may be spread over as many calls as one likes.
///
/// The noise of the markers is learnt from what is left: how much the priors count follows from it.
///
/// Allocates in the constructor only.
class SubjectFitter {
 public:
  /// `file`: what the priors are about, and where the fit starts.
  SubjectFitter(const MarkerSet& file, const OffsetPriors& priors, std::size_t max_instants,
                const OutlierScale& outliers = {});

  /// Begins anew at these offsets with these instants, which are borrowed until the fit has settled or begins anew;
  /// their poses are moved.
  void begin(const BodyOffsets& offsets, double size, std::span<BodyInstant> instants);

  /// Does a piece of the work: about as much as solving a pose twice. True when it has come to an end: the last turn
  /// changed nothing that matters, or it has had its turns.
  bool work();

  /// A turn just ended that made it better.
  bool improved() const noexcept { return improved_; }
  const BodyOffsets& offsets() const noexcept { return best_; }
  double size() const noexcept { return best_size_; }
  double sigma_m() const noexcept { return cost_.sigma_m; }
  const InstantCost& cost() const noexcept { return cost_; }
  int iterations() const noexcept { return iterations_; }
  /// rms of the markers from the body, m.
  double rms_m() const noexcept { return rms_m_; }

  /// For whoever judges instants that the fit did not see: between pieces of work.
  InstantEquations& equations() noexcept { return instant_equations_; }

 private:
  enum class Stage { OptimisePoses, Gather, Solve, Done };

  bool optimise_next_pose();
  void evaluate_iteration();
  void accept();
  void reject();
  void gather_next();
  void estimate_noise();

  InstantEquations instant_equations_;
  OffsetEquations offset_equations_;
  OutlierScale outliers_;
  InstantCost cost_;
  std::span<BodyInstant> instants_;
  BodyOffsets tried_, best_;
  double tried_size_ = 1.0, best_size_ = 1.0;
  std::vector<std::vector<Pose>> best_poses_;  // by instant
  Stage stage_ = Stage::Done;
  std::size_t next_ = 0;  // instant
  std::size_t part_ = 0;  // of its equations
  int pose_passes_ = 0;   // pieces of work for its pose
  InstantEquations::PoseCost sum_, best_sum_;
  double best_prior_ = 0.0;
  std::size_t seen_ = 0;  // coordinates of markers
  double damping_ = 0.0;
  double changed_m_ = 0.0;
  double rms_m_ = 0.0;
  int iterations_ = 0;
  int rejections_ = 0;
  bool improved_ = false;
};

}  // namespace mocap::bodyfit
