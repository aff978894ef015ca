#include "associate/predicted/prediction_gates.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "support/marker_world.h"

namespace mocap::associate {
namespace prediction_gates_test {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using namespace mocap::test;

// Four cameras that see `count` markers, and their predictions with errors of 1 cm.
struct Views {
  explicit Views(std::size_t count)
      : markers(cloud(count, random)),
        world(see(rig, markers, {.sigma_px = 0.2, .missed = 0.1, .false_blobs = 0.3}, random)),
        predictions(expect(markers, 0.01, random)) {
    rays->begin(world.set);
    for (std::size_t view = 0; view < rig.size(); ++view) rays->cast(view);
  }
  // Innovation covariance without the covariance of the marker, on the image plane at distance 1.
  static Matrix2d added(const ViewRays& view, double sigma_px, double floor_px) {
    return (floor_px * floor_px + sigma_px * sigma_px) / (view.focal_px * view.focal_px) * Matrix2d::Identity();
  }

  std::mt19937 random{23};
  Rig rig = ring(4);
  std::vector<Vector3d> markers;
  SeenWorld world;
  Predictions predictions;
  std::unique_ptr<RayTable> rays = std::make_unique<RayTable>(rig);
  MatchSettings settings;
  PredictionGates gates{settings};
};

TEST(PredictionGates, ContainTheRaysThatASearchOfAllPairsInDoublePrecisionFinds) {
  for (const std::size_t count : {1U, 30U, 200U}) {
    Views views(count);
    views.gates.set_predictions(views.predictions);
    for (std::size_t v = 0; v < views.rig.size(); ++v) {
      const ViewRays& view = (*views.rays)[v];

      const auto candidates = views.gates.candidates(view);

      std::map<std::pair<std::uint32_t, std::uint32_t>, GateCandidate> found;
      for (const GateCandidate& one : candidates) found.emplace(std::pair{one.marker, one.ray}, one);
      EXPECT_EQ(found.size(), candidates.size());
      for (std::uint32_t m = 0; m < count; ++m) {
        const PredictedMarker& marker = views.predictions.markers[m];
        const auto projection = view.projection(marker.position.v, marker.covariance_m2);
        ASSERT_TRUE(projection);
        for (std::uint32_t ray = 0; ray < view.size(); ++ray) {
          const Matrix2d covariance =
              projection->covariance + Views::added(view, view.sigma_px[ray], views.settings.gate_floor_px);
          const Vector2d off = Vector2d(view.x(ray), view.y(ray)) - projection->centre;
          const double distance2 = off.dot(covariance.inverse() * off);
          const double gate2 = views.settings.gate_sigmas * views.settings.gate_sigmas;
          const auto candidate = found.find({m, ray});
          // Single precision: 1 % of the squared distance.
          if (distance2 < 0.99 * gate2) {
            ASSERT_TRUE(candidate != found.end()) << m << " " << ray;
          }
          if (candidate == found.end()) continue;
          EXPECT_NEAR(candidate->second.distance2, distance2, 0.01 * gate2);
          const double floor = Views::added(view, 0.0, views.settings.gate_floor_px).determinant();
          EXPECT_NEAR(candidate->second.widening, covariance.determinant() / floor,
                      0.01 * covariance.determinant() / floor);
        }
      }
    }
  }
}

TEST(PredictionGates, ListTheirRaysInTheOrderOfTheMarkersAndCountTheGatesOfARay) {
  Views views(200);
  views.gates.set_predictions(views.predictions);
  for (std::size_t v = 0; v < views.rig.size(); ++v) {
    const ViewRays& view = (*views.rays)[v];

    const auto candidates = views.gates.candidates(view);

    EXPECT_TRUE(std::ranges::is_sorted(candidates, {}, &GateCandidate::marker));
    for (std::uint32_t ray = 0; ray < view.size(); ++ray) {
      EXPECT_EQ(views.gates.gates_containing(ray), std::ranges::count(candidates, ray, &GateCandidate::ray));
    }
  }
}

TEST(PredictionGates, AreEmptyForMarkersThatAreUnknownOrBehindTheCamera) {
  Views views(30);
  const ViewRays& view = (*views.rays)[0];
  const Vector3d eye = views.rig[0].centre().v;
  for (PredictedMarker& marker : views.predictions.markers) marker.covariance_m2 *= 100.0;
  auto& markers = views.predictions.markers;
  markers[0].position.v.x() = std::numeric_limits<double>::quiet_NaN();
  markers[1].covariance_m2(2, 2) = -1.0;
  markers[2].covariance_m2(0, 1) = std::numeric_limits<double>::infinity();
  markers[3].position.v = eye - view.direction(0);
  views.gates.set_predictions(views.predictions);

  const auto candidates = views.gates.candidates(view);

  for (const GateCandidate& one : candidates) EXPECT_GT(one.marker, 3U);
  EXPECT_FALSE(candidates.empty());
  views.gates.set_predictions({});
  EXPECT_TRUE(views.gates.candidates(view).empty());
}

}  // namespace prediction_gates_test
}  // namespace mocap::associate
