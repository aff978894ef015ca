#include "calibration/bundle_problem.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <cmath>

namespace mocap::calibration {
namespace {

// A marker nearer to the camera's plane is as far outside its image as one can be.
constexpr double kNearest_m = 0.01;

// x, y on the plane z = 1 to pixels; `lens`: fx fy cx cy, then the five of model/camera_model.h.
template <class T>
void bend(LensKind kind, const T* lens, const T& x, const T& y, T* px) {
  const T* k = lens + 4;
  const T r2 = x * x + y * y;
  if (kind == LensKind::Fisheye) {
    using std::atan2;
    using std::sqrt;
    const T r = sqrt(r2 + 1e-24);
    const T angle = atan2(r, T(1.0));
    const T a2 = angle * angle;
    const T share = angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) / r;
    px[0] = lens[0] * x * share + lens[2];
    px[1] = lens[1] * y * share + lens[3];
    return;
  }
  const T radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  px[0] = lens[0] * (x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x)) + lens[2];
  px[1] = lens[1] * (y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y) + lens[3];
}

struct Reprojection {
  LensKind kind;
  double along_m;  // of the marker, from the wand's middle
  Eigen::Vector2d px;
  double sigma_px;

  template <class T>
  bool operator()(const T* pose, const T* lens, const T* place, T* residual) const {
    const T point[3] = {place[0] + along_m * place[3], place[1] + along_m * place[4], place[2] + along_m * place[5]};
    T in_camera[3];
    ceres::AngleAxisRotatePoint(pose, point, in_camera);
    for (int i = 0; i < 3; ++i) in_camera[i] += pose[3 + i];
    const T depth = in_camera[2] < kNearest_m ? T(kNearest_m) : in_camera[2];
    T at[2];
    bend<T>(kind, lens, in_camera[0] / depth, in_camera[1] / depth, at);
    residual[0] = (at[0] - px.x()) / sigma_px;
    residual[1] = (at[1] - px.y()) / sigma_px;
    return true;
  }
};

// What is known of any lens: the image's centre is near its optical one, its terms are small.
struct LensPrior {
  std::array<double, BundleProblem::kLens> usual;
  std::array<double, BundleProblem::kLens> sigma;

  template <class T>
  bool operator()(const T* lens, T* residual) const {
    for (std::size_t i = 0; i < usual.size(); ++i) residual[i] = (lens[i] - usual[i]) / sigma[i];
    return true;
  }
};

LensPrior prior_of(const CameraModel& camera, const std::array<double, BundleProblem::kLens>& start) {
  const double half = 0.05 * camera.width_px;
  LensPrior prior{start, {0.2 * start[0], 0.2 * start[1], half, half, 0.3, 0.3, 0.01, 0.01, 0.3}};
  if (camera.lens.kind == LensKind::Fisheye) prior.sigma[6] = prior.sigma[7] = 0.3;
  return prior;
}

}  // namespace

std::vector<int> free_lens_parts(LensFreedom freedom, LensKind kind) {
  switch (freedom) {
    case LensFreedom::Fixed: return {};
    case LensFreedom::Focal: return {0, 1};
    case LensFreedom::Rough: return {0, 1, 4};
    case LensFreedom::All: break;
  }
  if (kind == LensKind::Fisheye) return {0, 1, 2, 3, 4, 5, 6, 7};
  return {0, 1, 2, 3, 4, 5, 6, 7, 8};
}

BundleProblem::BundleProblem(const Bundle& bundle, const BundleSettings& settings)
    : poses_(bundle.rig.size()),
      lenses_(bundle.rig.size()),
      places_(bundle.places.size()),
      camera_used_(bundle.rig.size()),
      place_used_(bundle.places.size()),
      problem_(std::make_unique<ceres::Problem>()) {
  for (std::size_t c = 0; c < poses_.size(); ++c) {
    const CameraModel& camera = bundle.rig[c];
    ceres::RotationMatrixToAngleAxis(camera.camera_from_world.rotation.data(), poses_[c].data());
    std::copy_n(camera.camera_from_world.translation.data(), 3, poses_[c].data() + 3);
    lenses_[c] = {camera.lens.fx_px, camera.lens.fy_px, camera.lens.cx_px, camera.lens.cy_px};
    std::copy_n(camera.lens.distortion.data(), 5, lenses_[c].data() + 4);
  }
  for (std::size_t p = 0; p < places_.size(); ++p) {
    std::copy_n(bundle.places[p].middle_m.data(), 3, places_[p].data());
    std::copy_n(bundle.places[p].along.data(), 3, places_[p].data() + 3);
  }
  ceres::LossFunction* const loss =
      settings.outlier_sigmas > 0.0 ? new ceres::CauchyLoss(settings.outlier_sigmas) : nullptr;
  for (const Sight& sight : bundle.sights) {
    const auto c = static_cast<std::size_t>(sight.camera);
    const auto p = static_cast<std::size_t>(sight.place);
    auto* const error = new Reprojection{
        bundle.rig[c].lens.kind, bundle.wand.marks_m[static_cast<std::size_t>(sight.mark)] - bundle.wand.middle_m(),
        sight.px, sight.sigma_px};
    problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<Reprojection, 2, kPose, kLens, kPlace>(error), loss,
                               pose(c), lens(c), place(p));
    camera_used_[c] = true;
    place_used_[p] = true;
  }
  if (bundle.sights.empty()) delete loss;
  for (std::size_t c = 0; c < poses_.size(); ++c) {
    const bool held = settings.hold_rig || (settings.hold_first && c == 0);
    if (held && camera_used_[c]) problem_->SetParameterBlockConstant(pose(c));
  }
  free_lenses(bundle, settings.hold_rig ? LensFreedom::Fixed : settings.lens);
  for (std::size_t p = 0; p < places_.size(); ++p) {
    if (!place_used_[p]) continue;
    problem_->SetManifold(place(p),
                          new ceres::ProductManifold<ceres::EuclideanManifold<3>, ceres::SphereManifold<3>>());
  }
}

BundleProblem::~BundleProblem() = default;

void BundleProblem::free_lenses(const Bundle& bundle, LensFreedom freedom) {
  for (std::size_t c = 0; c < lenses_.size(); ++c) {
    if (!camera_used_[c]) continue;
    const std::vector<int> free = free_lens_parts(freedom, bundle.rig[c].lens.kind);
    if (free.empty()) {
      problem_->SetParameterBlockConstant(lens(c));
      continue;
    }
    if (free.size() < kLens) {
      std::vector<int> held;
      for (int i = 0; i < kLens; ++i) {
        if (std::ranges::find(free, i) == free.end()) held.push_back(i);
      }
      problem_->SetManifold(lens(c), new ceres::SubsetManifold(kLens, held));
    }
    problem_->AddResidualBlock(
        new ceres::AutoDiffCostFunction<LensPrior, kLens, kLens>(new LensPrior(prior_of(bundle.rig[c], lenses_[c]))),
        nullptr, lens(c));
  }
}

std::shared_ptr<ceres::OrderedGroups<double*>> BundleProblem::places_first() {
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t p = 0; p < places_.size(); ++p) {
    if (place_used_[p]) ordering->AddElementToGroup(place(p), 0);
  }
  for (std::size_t c = 0; c < poses_.size(); ++c) {
    if (!camera_used_[c]) continue;
    ordering->AddElementToGroup(pose(c), 1);
    ordering->AddElementToGroup(lens(c), 1);
  }
  return ordering;
}

void BundleProblem::write_back(Bundle& bundle) const {
  for (std::size_t c = 0; c < poses_.size(); ++c) {
    CameraModel& camera = bundle.rig[c];
    ceres::AngleAxisToRotationMatrix(poses_[c].data(), camera.camera_from_world.rotation.data());
    std::copy_n(poses_[c].data() + 3, 3, camera.camera_from_world.translation.data());
    camera.lens.fx_px = lenses_[c][0];
    camera.lens.fy_px = lenses_[c][1];
    camera.lens.cx_px = lenses_[c][2];
    camera.lens.cy_px = lenses_[c][3];
    std::copy_n(lenses_[c].data() + 4, 5, camera.lens.distortion.data());
  }
  for (std::size_t p = 0; p < places_.size(); ++p) {
    std::copy_n(places_[p].data(), 3, bundle.places[p].middle_m.data());
    std::copy_n(places_[p].data() + 3, 3, bundle.places[p].along.data());
    bundle.places[p].along.normalize();
  }
}

}  // namespace mocap::calibration
