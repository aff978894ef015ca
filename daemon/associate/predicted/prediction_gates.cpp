#include "associate/predicted/prediction_gates.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/loops.h"

namespace mocap::associate {
namespace {

bool is_usable(const PredictedMarker& marker) {
  return marker.position.v.allFinite() && marker.covariance_m2.allFinite() &&
         (marker.covariance_m2.diagonal().array() >= 0.0).all();
}

}  // namespace

PredictionGates::PredictionGates(const MatchSettings& settings) : settings_(settings), gates_containing_(kMaxBlobs, 0) {
  for (auto& column : marker_columns_) column.resize(kMaxMarkers);
  predicted_.resize(kMaxMarkers);
  candidates_.resize(kMaxGateCandidates);
  nearby_.resize(8 * kMaxBlobs);
}

std::span<const GateCandidate> PredictionGates::candidates(const ViewRays& view) {
  project_markers(*view.camera);
  bins_.fill(view.places(), view.bounds(), view.typical_variance(), static_cast<float>(settings_.gate_sigmas));
  bound_gates(view.focal_px);
  std::fill_n(gates_containing_.begin(), view.size(), std::uint16_t{0});
  gather_candidates(view);
  return std::span(candidates_).first(candidate_count_);
}

void PredictionGates::set_predictions(const Predictions& predictions) {
  marker_count_ = predictions.markers.size();
  for (std::size_t m = 0; m < marker_count_; ++m) {
    const PredictedMarker& marker = predictions.markers.data()[m];
    const Eigen::Vector3f at = marker.position.v.cast<float>();
    const Eigen::Matrix3f spread = marker.covariance_m2.cast<float>();
    const float x = is_usable(marker) ? at.x() : std::numeric_limits<float>::quiet_NaN();
    const std::array<float, 9> row{
        x, at.y(), at.z(), spread(0, 0), spread(0, 1), spread(0, 2), spread(1, 1), spread(1, 2), spread(2, 2)};
    for (std::size_t column = 0; column < row.size(); ++column) marker_columns_[column][m] = row[column];
  }
}

// Projects mean and covariance (first order) of all markers into a view.
MOCAP_WIDE void PredictionGates::project_markers(const CameraModel& camera) {
  const Eigen::Matrix3f r = camera.camera_from_world.rotation.cast<float>();
  const Eigen::Vector3f t = camera.camera_from_world.translation.cast<float>();
  const float r00 = r(0, 0), r01 = r(0, 1), r02 = r(0, 2), r10 = r(1, 0), r11 = r(1, 1), r12 = r(1, 2);
  const float r20 = r(2, 0), r21 = r(2, 1), r22 = r(2, 2), t0 = t[0], t1 = t[1], t2 = t[2];
  const auto& e = marker_columns_;
  const float *px = e[0].data(), *py = e[1].data(), *pz = e[2].data(), *cxx = e[3].data(), *cxy = e[4].data(),
              *cxz = e[5].data(), *cyy = e[6].data(), *cyz = e[7].data(), *czz = e[8].data();
  float* const to_x = predicted_.x.data();
  float* const to_y = predicted_.y.data();
  float* const to_xx = predicted_.xx.data();
  float* const to_xy = predicted_.xy.data();
  float* const to_yy = predicted_.yy.data();
  float* const to_depth = predicted_.depth_m.data();
  const std::size_t count = marker_count_;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t m = 0; m < count; ++m) {
    const float depth = r20 * px[m] + r21 * py[m] + r22 * pz[m] + t2;
    const float inverse = 1.0F / depth;
    const float x = (r00 * px[m] + r01 * py[m] + r02 * pz[m] + t0) * inverse;
    const float y = (r10 * px[m] + r11 * py[m] + r12 * pz[m] + t1) * inverse;
    const float ax = (r00 - x * r20) * inverse, ay = (r01 - x * r21) * inverse, az = (r02 - x * r22) * inverse;
    const float bx = (r10 - y * r20) * inverse, by = (r11 - y * r21) * inverse, bz = (r12 - y * r22) * inverse;
    const float cax = cxx[m] * ax + cxy[m] * ay + cxz[m] * az;
    const float cay = cxy[m] * ax + cyy[m] * ay + cyz[m] * az;
    const float caz = cxz[m] * ax + cyz[m] * ay + czz[m] * az;
    const float cbx = cxx[m] * bx + cxy[m] * by + cxz[m] * bz;
    const float cby = cxy[m] * bx + cyy[m] * by + cyz[m] * bz;
    const float cbz = cxz[m] * bx + cyz[m] * by + czz[m] * bz;
    to_x[m] = x;
    to_y[m] = y;
    to_xx[m] = ax * cax + ay * cay + az * caz;
    to_xy[m] = bx * cax + by * cay + bz * caz;
    to_yy[m] = bx * cbx + by * cby + bz * cbz;
    to_depth[m] = depth;
  }
}

// Computes the bins that each gate covers.
MOCAP_WIDE void PredictionGates::bound_gates(double focal_px) {
  const auto [min_x, min_y, per_x, per_y, last] = bins_.scale();
  const auto floor = static_cast<float>(std::pow(settings_.gate_floor_px / focal_px, 2));
  const float floor_and_ray = floor + bins_.variance();
  const auto sigmas = static_cast<float>(settings_.gate_sigmas);
  constexpr float kRounding = RayBins::kRounding;
  const float *x = predicted_.x.data(), *y = predicted_.y.data();
  const float *xx = predicted_.xx.data(), *yy = predicted_.yy.data(), *depth = predicted_.depth_m.data();
  std::int32_t *left = predicted_.left.data(), *right = predicted_.right.data();
  std::int32_t *top = predicted_.top.data(), *bottom = predicted_.bottom.data();
  const auto bin = [most = last](float at) {
    const float low = at > 0.0F ? at : 0.0F;
    return static_cast<std::int32_t>(low < most ? low : most);
  };
  const std::size_t count = marker_count_;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t m = 0; m < count; ++m) {
    const float half_x = sigmas * std::sqrt(xx[m] + floor_and_ray);
    const float half_y = sigmas * std::sqrt(yy[m] + floor_and_ray);
    // The gate of a marker that is not in front of the camera is empty.
    const float width = depth[m] > kMinDepthSingle_m ? 1.0F : 0.0F;
    left[m] = bin((x[m] - half_x - min_x) * per_x - kRounding);
    right[m] = bin(width * ((x[m] + half_x - min_x) * per_x + kRounding + 1.0F));
    top[m] = bin((y[m] - half_y - min_y) * per_y - kRounding);
    bottom[m] = bin((y[m] + half_y - min_y) * per_y + kRounding + 1.0F);
  }
}

// Finds the rays in the bins of each gate, in blocks, then tests their distances. The processor cannot predict the
// number of rays in the bins; the first two rays are written without a branch, which covers most gates.
void PredictionGates::gather_candidates(const ViewRays& view) {
  candidate_count_ = 0;
  const bool one_word = bins_.has_one_word();
  std::size_t nearby_count = 0;
  const auto add = [&](std::uint32_t marker, std::size_t word, std::uint64_t bits) {
    const auto next = [&] {
      constexpr std::uint64_t kLast = std::uint64_t{1} << 63;
      nearby_[nearby_count] = {
          marker, static_cast<std::uint32_t>(64 * word) + static_cast<std::uint32_t>(std::countr_zero(bits | kLast))};
      nearby_count += bits != 0 ? 1 : 0;
      bits &= bits - 1;
    };
    next();
    next();
    while (bits != 0) next();
  };
  for (std::uint32_t m = 0; m < marker_count_; ++m) {
    const auto bin = [m](const std::vector<std::int32_t>& column) { return static_cast<std::size_t>(column[m]); };
    const RayBins::Gate gate{bin(predicted_.left), bin(predicted_.right), bin(predicted_.top), bin(predicted_.bottom)};
    if (one_word) {
      add(m, 0, bins_.only_word_of(gate));
    } else {
      bins_.visit_words(gate, [&](std::size_t word, std::uint64_t bits) { add(m, word, bits); });
    }
    if (nearby_count + kMaxBlobs + 2 * kMaxBlobs / 64 < nearby_.size()) continue;
    measure_candidates(view, nearby_count);
    nearby_count = 0;
  }
  measure_candidates(view, nearby_count);
}

// Keeps the nearby rays that are inside the gates.
void PredictionGates::measure_candidates(const ViewRays& view, std::size_t count) {
  const auto gate2 = static_cast<float>(settings_.gate_sigmas * settings_.gate_sigmas);
  const auto floor = static_cast<float>(std::pow(settings_.gate_floor_px / view.focal_px, 2));
  const float inverse_floor2 = 1.0F / (floor * floor);
  const float *ray_x = view.x_f.data(), *ray_y = view.y_f.data(), *ray_variance = view.variance_f.data();
  const float *at_x = predicted_.x.data(), *at_y = predicted_.y.data(), *at_xx = predicted_.xx.data(),
              *at_xy = predicted_.xy.data(), *at_yy = predicted_.yy.data();
  GateCandidate* next = candidates_.data() + candidate_count_;
  count = std::min(count, kMaxGateCandidates - candidate_count_);
  for (std::size_t i = 0; i < count; ++i) {
    const auto [m, ray] = nearby_[i];
    const float dx = ray_x[ray] - at_x[m];
    const float dy = ray_y[ray] - at_y[m];
    const float floor_and_ray = floor + ray_variance[ray];
    const float xx = at_xx[m] + floor_and_ray, xy = at_xy[m], yy = at_yy[m] + floor_and_ray;
    const float area2 = xx * yy - xy * xy;
    const float off2 = yy * dx * dx - 2.0F * xy * dx * dy + xx * dy * dy;
    const bool inside = off2 < gate2 * area2;
    *next = {m, ray, off2 / area2, area2 * inverse_floor2};
    next += inside ? 1 : 0;
    gates_containing_[ray] = static_cast<std::uint16_t>(gates_containing_[ray] + (inside ? 1 : 0));
  }
  candidate_count_ = static_cast<std::size_t>(next - candidates_.data());
}

}  // namespace mocap::associate
