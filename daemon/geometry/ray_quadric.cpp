#include "geometry/ray_quadric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/expects.h"
#include "base/loops.h"
#include "geometry/limits.h"
#include "model/bounds.h"

namespace mocap::geometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Four numbers in one SIMD register, or in two registers of half the size; the results are identical.
using Four = double __attribute__((vector_size(32)));

// A quadric, or the products of a point's coordinates by which the elements of a quadric are multiplied.
struct Form {
  Four squares{};   // xx yy zz 11
  Four products{};  // xy yz zx -
  Four ends{};      // x1 y1 z1 -
};

#define MOCAP_INLINE [[gnu::always_inline]] inline

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

MOCAP_INLINE Four load(const double* from) {
  Four four;
  __builtin_memcpy(&four, from, sizeof four);
  return four;
}

MOCAP_INLINE Form load(const RayQuadric& from) {
  return {load(from.q.data()), load(from.q.data() + 4), load(from.q.data() + 8)};
}

MOCAP_INLINE Form products_of(const Vector3d& p) {
  return {Four{p.x() * p.x(), p.y() * p.y(), p.z() * p.z(), 1.0},
          Four{2.0 * p.x() * p.y(), 2.0 * p.y() * p.z(), 2.0 * p.z() * p.x(), 0.0},
          Four{2.0 * p.x(), 2.0 * p.y(), 2.0 * p.z(), 0.0}};
}

MOCAP_INLINE double sum_of(const Four& four) { return (four[0] + four[1]) + (four[2] + four[3]); }

MOCAP_INLINE double times(const Form& quadric, const Form& products) {
  return sum_of(quadric.squares * products.squares + quadric.products * products.products +
                quadric.ends * products.ends);
}

MOCAP_INLINE Four homogeneous(const Vector3d& p) { return Four{p.x(), p.y(), p.z(), 1.0}; }

MOCAP_INLINE double depth_of(const QuadricSighting& sighting, const Four& h) {
  return sum_of(load(sighting.depth->data()) * h);
}

struct Solved {
  Vector3d point;
  Matrix3d covariance;
  bool is_observable = false;  // false: the rays are too nearly parallel
};

// The minimum of a quadratic form, and the inverse of its Hessian (without the factor 2).
MOCAP_INLINE Solved least_of(const Form& sum) {
  const double xx = sum.squares[0], yy = sum.squares[1], zz = sum.squares[2];
  const double xy = sum.products[0], yz = sum.products[1], xz = sum.products[2];
  const double c_xx = yy * zz - yz * yz;
  const double c_xy = xz * yz - xy * zz;
  const double c_xz = xy * yz - xz * yy;
  const double c_yy = xx * zz - xz * xz;
  const double c_yz = xy * xz - xx * yz;
  const double c_zz = xx * yy - xy * xy;
  const double determinant = xx * c_xx + xy * c_xy + xz * c_xz;
  Solved solved;
  // The determinant over the sum of the principal minors is a lower bound of the smallest eigenvalue, tight if that
  // eigenvalue is small.
  if (!(determinant > kMinInformation_1_m2 * (c_xx + c_yy + c_zz)) || !(determinant > 0.0)) return solved;
  const double inverse = 1.0 / determinant;
  solved.covariance << c_xx, c_xy, c_xz, c_xy, c_yy, c_yz, c_xz, c_yz, c_zz;
  solved.covariance *= inverse;
  solved.point.noalias() = -(solved.covariance * Vector3d(sum.ends[0], sum.ends[1], sum.ends[2]));
  solved.is_observable = true;
  return solved;
}

// The agreement of the sightings with a point.
struct Verdict {
  bool all_fit = true;      // no sighting is an outlier
  bool depths_hold = true;  // no depth differs from the depth of the weights by more than 1 %
  double sum_px2 = 0.0;     // sum of squared errors, with the depths of the weights
};

// The sighting with the largest error.
struct Worst {
  std::size_t index = 0;
  double excess2 = 0.0;  // its squared error over the squared limit
  double sum2 = 0.0;     // the same, summed over all sightings
};

// The sum of the quadrics of all sightings, each weighted by 1 / depth^2 at the start position.
class Sum {
 public:
  Sum(std::span<QuadricSighting> sightings, const Agreement& agreement)
      : sightings_(sightings),
        floor_px2_(agreement.floor_px * agreement.floor_px),
        sigmas2_(agreement.sigmas * agreement.sigmas) {}

  // Computes the sum for a start position. A camera that has the position behind it cannot see the point: its sighting
  // moves to the end of the span and is not counted.
  MOCAP_INLINE void add_up(std::size_t count, const Vector3d& at) {
    const Four h = homogeneous(at);
    Form total;
    count_ = 0;
    while (count_ < count) {
      const double depth = depth_of(sightings_[count_], h);
      if (!(depth > kMinDepth_m)) {
        std::swap(sightings_[count_], sightings_[--count]);
        continue;
      }
      depth_[count_] = depth;
      const double weight = 1.0 / (depth * depth);
      weight_[count_] = weight;
      const Form quadric = load(*sightings_[count_].quadric);
      total.squares += weight * quadric.squares;
      total.products += weight * quadric.products;
      total.ends += weight * quadric.ends;
      ++count_;
    }
    total_ = total;
  }

  std::size_t count() const { return count_; }
  Solved solve() const { return least_of(total_); }
  Solved solve_without(std::size_t i) const {
    const Form quadric = load(*sightings_[i].quadric);
    return least_of({total_.squares - weight_[i] * quadric.squares, total_.products - weight_[i] * quadric.products,
                     total_.ends - weight_[i] * quadric.ends});
  }

  // Tests all sightings against their limits without a division, because nearly all sightings pass.
  MOCAP_INLINE Verdict judge(const Vector3d& point) const {
    constexpr double kSmallChange = 0.01;
    const Form products = products_of(point);
    const Four h = homogeneous(point);
    Verdict verdict;
    for (std::size_t i = 0; i < count_; ++i) {
      const QuadricSighting& s = sightings_[i];
      const double sigma2 = s.sigma_px * s.sigma_px;
      const double depth = depth_of(s, h);
      // Rounding may give a small negative number.
      const double off2 = std::max(0.0, times(load(*s.quadric), products)) * sigma2;
      const bool fits = depth > kMinDepth_m && off2 <= (floor_px2_ + sigmas2_ * sigma2) * depth * depth;
      verdict.all_fit = verdict.all_fit && fits;
      verdict.depths_hold = verdict.depths_hold && std::abs(depth - depth_[i]) <= kSmallChange * depth_[i];
      verdict.sum_px2 += off2 * weight_[i];
    }
    return verdict;
  }

  // The sighting with the largest ratio of squared error to squared limit, among all except `without`.
  Worst worst(const Vector3d& point, std::size_t without) const {
    const Form products = products_of(point);
    const Four h = homogeneous(point);
    Worst worst;
    for (std::size_t i = 0; i < count_; ++i) {
      if (i == without) continue;
      const QuadricSighting& s = sightings_[i];
      const double sigma2 = s.sigma_px * s.sigma_px;
      const double depth = depth_of(s, h);
      const double off2 = std::max(0.0, times(load(*s.quadric), products)) * sigma2;
      const double excess2 =
          depth > kMinDepth_m ? off2 / ((floor_px2_ + sigmas2_ * sigma2) * depth * depth) : kInfinite;
      worst.sum2 += excess2;
      if (excess2 > worst.excess2) worst = {i, excess2, worst.sum2};
    }
    return worst;
  }

  // The sighting without which the others agree best. With few sightings an outlier moves the point so far that another
  // sighting may have the larger error, so each sighting is left out in turn.
  std::size_t best_left_out() const {
    std::size_t best = count_ - 1;
    double least2 = kInfinite;
    for (std::size_t i = 0; i < count_; ++i) {
      const Solved others = solve_without(i);
      if (!others.is_observable) continue;
      const double sum2 = worst(others.point, i).sum2;
      if (sum2 >= least2) continue;
      least2 = sum2;
      best = i;
    }
    return best;
  }

 private:
  std::span<QuadricSighting> sightings_;
  double floor_px2_, sigmas2_;
  Form total_;
  std::size_t count_ = 0;
  std::array<double, kMaxCameras> depth_;   // only the first count_ are set
  std::array<double, kMaxCameras> weight_;  // likewise
};

// Solves the point of the first `count` sightings; repeats, at most 3 times, until the depths are correct to 1 %.
MOCAP_INLINE std::pair<Solved, Verdict> settle(Sum& sum, std::size_t count, Vector3d at) {
  constexpr int kMaxSteps = 3;

  Solved solved;
  Verdict verdict;
  for (int step = 0; step < kMaxSteps; ++step) {
    sum.add_up(count, at);
    if (sum.count() < 2) return {};
    solved = sum.solve();
    if (!solved.is_observable) break;
    verdict = sum.judge(solved.point);
    if (verdict.depths_hold) break;
    count = sum.count();
    at = solved.point;
  }
  return {solved, verdict};
}

}  // namespace

CameraRows::CameraRows(const CameraFromWorld& camera_from_world) {
  const Matrix3d& r = camera_from_world.rotation;
  const Vector3d& t = camera_from_world.translation;
  x << r.row(0).transpose(), t.x();
  y << r.row(1).transpose(), t.y();
  depth << r.row(2).transpose(), t.z();
}

namespace {

// u and v: the linear forms of (X, 1) that give depth times the two components of the error, in standard deviations.
MOCAP_INLINE void write_quadric(const Four& u, const Four& v, RayQuadric& into) {
  using Order = long long __attribute__((vector_size(32)));
  const Order next{1, 2, 0, 3};
  const Four squares = u * u + v * v;
  const Four products = u * __builtin_shuffle(u, next) + v * __builtin_shuffle(v, next);
  const Four ends = u * u[3] + v * v[3];
  __builtin_memcpy(into.q.data(), &squares, sizeof squares);
  __builtin_memcpy(into.q.data() + 4, &products, sizeof products);
  __builtin_memcpy(into.q.data() + 8, &ends, sizeof ends);
}

}  // namespace

RayQuadric quadric_of(const CameraRows& camera, const Ray& ray, double sigma_px) {
  const double inverse = 1.0 / sigma_px;
  const Four depth = load(camera.depth.data());
  const Four along_x = load(camera.x.data()) - ray.point.v.x() * depth;
  const Four along_y = load(camera.y.data()) - ray.point.v.y() * depth;
  RayQuadric quadric;
  write_quadric(inverse * ray.px_from_ray(0, 0) * along_x + inverse * ray.px_from_ray(0, 1) * along_y,
                inverse * ray.px_from_ray(1, 0) * along_x + inverse * ray.px_from_ray(1, 1) * along_y, quadric);
  return quadric;
}

MOCAP_WIDE void quadrics_of(const CameraRows& camera, const RayColumns& rays, std::span<const double> sigma_px,
                            std::span<RayQuadric> into) {
  MOCAP_EXPECTS(into.size() >= sigma_px.size() && rays.x.size() >= sigma_px.size());
  const Four row_x = load(camera.x.data());
  const Four row_y = load(camera.y.data());
  const Four depth = load(camera.depth.data());
  for (std::size_t i = 0; i < sigma_px.size(); ++i) {
    const double inverse = 1.0 / sigma_px[i];
    const Four along_x = row_x - rays.x[i] * depth;
    const Four along_y = row_y - rays.y[i] * depth;
    write_quadric(inverse * rays.ux[i] * along_x + inverse * rays.uy[i] * along_y,
                  inverse * rays.vx[i] * along_x + inverse * rays.vy[i] * along_y, into[i]);
  }
}

MOCAP_WIDE Result<Agreed, TriangulationFailure> agree(std::span<QuadricSighting> sightings, const WorldPoint& start,
                                                      const Agreement& agreement) {
  // With at most this many sightings each one is left out in turn; with more, the outlier has the largest error.
  constexpr std::size_t kFew = 8;

  Sum sum(sightings, agreement);
  std::size_t count = sightings.size();
  TriangulationFailure failure = TriangulationFailure::TooFewSightings;
  while (count >= 2) {
    const auto [solved, verdict] = settle(sum, count, start.v);
    count = sum.count();
    if (count < 2) return TriangulationFailure::BehindACamera;
    if (solved.is_observable && verdict.all_fit) {
      const double rms_px = std::sqrt(verdict.sum_px2 / static_cast<double>(count));
      return Agreed{{{solved.point}, solved.covariance, rms_px}, count};
    }
    const Worst worst = solved.is_observable ? sum.worst(solved.point, kNone) : Worst{};
    failure = !solved.is_observable          ? TriangulationFailure::RaysNearlyParallel
              : std::isfinite(worst.excess2) ? TriangulationFailure::Disagreement
                                             : TriangulationFailure::BehindACamera;
    if (count == 2) break;
    const std::size_t wrong = !solved.is_observable || count <= kFew ? sum.best_left_out() : worst.index;
    std::swap(sightings[wrong], sightings[count - 1]);
    --count;
  }
  return failure;
}

}  // namespace mocap::geometry
