#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/archive.h"
#include "bodyfit/body_offsets.h"
#include "bodyfit/instant_equations.h"
#include "bodyfit/offset_equations.h"
#include "model/skeleton.h"

namespace mocap::bodyfit {

/// Scale of the robust cost of a marker: at the start of a fit, when its offset is unknown, and the smallest value
/// later.
struct OutlierScale {
  double first_m = 0.08;
  double least_m = 0.02;
};

/// Fits the offsets of a body to several instants by alternating steps: optimise the pose of each instant for the
/// current offsets, gather the equations of the offsets, solve them. The steps can be spread over many calls.
///
/// The standard deviation of the markers is estimated from the residuals in each iteration; the weight of the priors
/// relative to the measurements follows from it.
///
/// Allocates in the constructor only.
class SubjectFitter {
 public:
  /// `file`: the marker set that is the mean of the priors.
  SubjectFitter(const MarkerSet& file, const OffsetPriors& priors, std::size_t max_instants,
                const OutlierScale& outliers = {});

  /// Replaces the priors. Call while no fit is in progress.
  void set_priors(const OffsetPriors& priors) { offset_equations_.set_priors(priors); }

  /// Begins a new fit at these offsets. The fit changes the poses of the instants, and the instants outlive the fit. At
  /// most `max_instants` instants.
  void begin(const BodyOffsets& offsets, double size, std::span<BodyInstant> instants);

  /// Does one step: about the work of solving a pose twice. Returns true when the fit has ended: it converged,
  /// reached its maximum number of iterations, or no step reduced the cost.
  bool work();

  /// Whether the last call of work() completed an iteration that reduced the cost.
  bool improved() const noexcept { return improved_; }
  /// The offsets of least cost so far.
  const BodyOffsets& offsets() const noexcept { return best_; }
  double size() const noexcept { return best_size_; }
  /// Estimated standard deviation of a marker.
  double sigma_m() const noexcept { return cost_.sigma_m; }
  const InstantCost& cost() const noexcept { return cost_; }
  int iterations() const noexcept { return iterations_; }
  /// Robust rms distance of the markers from the body.
  double rms_m() const noexcept { return rms_m_; }

  /// Lets the caller evaluate instants that are not part of the fit, between two calls of work().
  InstantEquations& equations() noexcept { return instant_equations_; }

  /// Writes the result of the last fit, or takes it over from a fitter that was built with the same settings (see
  /// Archive).
  void archive(Archive& members);
  /// The same for the fit in progress. `instants`: the caller's, of which the first are those of the fit.
  void archive_fit(Archive& members, std::span<BodyInstant> instants);

 private:
  enum class Stage { OptimisePoses, Gather, Solve, Done };

  void check_fit(Archive& members) const;

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
  std::size_t next_ = 0;  // instant of the next step
  std::size_t part_ = 0;  // next part of its equations
  int pose_passes_ = 0;   // steps spent on its pose
  InstantEquations::PoseCost sum_, best_sum_;
  double best_prior_ = 0.0;
  std::size_t seen_ = 0;  // measured coordinates
  double damping_ = 0.0;
  double changed_m_ = 0.0;
  double rms_m_ = 0.0;
  int iterations_ = 0;
  int rejections_ = 0;
  bool improved_ = false;
};

}  // namespace mocap::bodyfit
