#include "track3d/point_tracks.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <set>
#include <vector>

#include "filter/kalman.h"
#include "filter/random.h"

namespace mocap::track3d {
namespace point_tracks_test {

using Tracks = PointTracks<filter::Kalman<3>, 3>;
using Seen = filter::Seen<3>;
using Point = filter::Vector<3>;

constexpr double kStep_s = 0.01;
constexpr double kSigma_m = 0.001;

TrackLife usual_life() {
  TrackLife life;
  life.max_coast = std::chrono::milliseconds(95);
  return life;
}

// A tracker that receives one list of points a set.
struct Tracker {
  explicit Tracker(const TrackLife& life, std::size_t max_tracks = 50) : tracks(life, max_tracks, 50) {}

  void see(const std::vector<Point>& points, bool measurable = true) {
    measurements.clear();
    for (const Point& point : points)
      measurements.push_back({point, kSigma_m * kSigma_m * filter::Matrix<3>::Identity()});
    tracks.advance(from_ns(0) + from_s(kStep_s * ++set), measurements.size());
    tracks.assign(measurements);
    for (Tracks::Track& track : tracks.tracks()) track.measurable = measurable;
    update();
  }
  void update() {
    tracks.update(measurements, [](const Seen& seen) {
      return filter::Kalman<3>({.acceleration_u_s2 = 20.0, .initial_speed_u_s = 1.0}, seen);
    });
  }
  // The measurement of the track with this id, or kNone.
  std::uint32_t measurement_of(std::uint32_t id) {
    const Tracks::Track* const track = tracks.find(id);
    return track == nullptr ? Tracks::kNone : track->measurement;
  }

  Tracks tracks;
  std::vector<Seen> measurements;
  int set = 0;
};

TEST(PointTracks, FollowEachPointThatMovesAmongOthers) {
  filter::Random random(1);
  std::vector<Point> places, speeds_m_s;
  for (int i = 0; i < 20; ++i) {
    places.emplace_back(random.unit(), random.unit(), random.unit());
    speeds_m_s.emplace_back(random.normal(), random.normal(), random.normal());
  }
  Tracker tracker(usual_life());

  std::vector<std::uint32_t> id_of_point(20);
  for (int set = 0; set < 40; ++set) {
    std::vector<Point> points;
    for (std::size_t i = 0; i < 20; ++i) {
      places[i] += kStep_s * speeds_m_s[i];
      points.push_back(places[i] + kSigma_m * Point(random.normal(), random.normal(), random.normal()));
    }
    tracker.see(points);
    if (set == 5) {
      for (const Tracks::Track& track : tracker.tracks.tracks()) id_of_point[track.measurement] = track.id;
    }
  }

  ASSERT_EQ(tracker.tracks.tracks().size(), 20U);
  for (std::uint32_t i = 0; i < 20; ++i) {
    EXPECT_EQ(tracker.measurement_of(id_of_point[i]), i);
    EXPECT_LT((tracker.tracks.find(id_of_point[i])->filter.belief().point - places[i]).norm(), 5.0 * kSigma_m);
  }
}

TEST(PointTracks, AreConfirmedByConsecutiveMeasurementsAndEndIfATentativeOneIsMissed) {
  Tracker tracker(usual_life());
  const Point known(0.0, 0.0, 1.0), flash(1.0, 0.0, 1.0);

  tracker.see({known});
  EXPECT_FALSE(tracker.tracks.tracks()[0].confirmed);
  tracker.see({known, flash});
  EXPECT_FALSE(tracker.tracks.tracks()[0].confirmed);
  tracker.see({known});

  ASSERT_EQ(tracker.tracks.tracks().size(), 1U);
  EXPECT_TRUE(tracker.tracks.tracks()[0].confirmed);
}

TEST(PointTracks, CoastForTheirTimeThenEndAndNeverUseAnIdAgain) {
  Tracker tracker(usual_life());
  const Point point(0.0, 0.0, 1.0);
  for (int i = 0; i < 4; ++i) tracker.see({point});
  const std::uint32_t id = tracker.tracks.tracks()[0].id;

  for (int i = 0; i < 9; ++i) tracker.see({});
  ASSERT_NE(tracker.tracks.find(id), nullptr);
  EXPECT_EQ(tracker.tracks.find(id)->missed_sets, 9U);
  tracker.see({});  // 100 ms without a measurement

  EXPECT_EQ(tracker.tracks.find(id), nullptr);
  tracker.see({point});
  ASSERT_EQ(tracker.tracks.tracks().size(), 1U);
  EXPECT_GT(tracker.tracks.tracks()[0].id, id);
}

TEST(PointTracks, MissNoSetThatCouldNotMeasureThem) {
  Tracker tracker(usual_life());
  const Point known(0.0, 0.0, 1.0), young(1.0, 0.0, 1.0);
  for (int i = 0; i < 3; ++i) tracker.see({known});
  tracker.see({known, young});

  for (int i = 0; i < 5; ++i) tracker.see({}, false);

  ASSERT_EQ(tracker.tracks.tracks().size(), 2U);  // a tentative track ends with the first set that it misses
  EXPECT_EQ(tracker.tracks.tracks()[0].missed_sets, 0U);
  EXPECT_TRUE(tracker.tracks.tracks()[0].coasts);
  tracker.see({});
  ASSERT_EQ(tracker.tracks.tracks().size(), 1U);
  EXPECT_EQ(tracker.tracks.tracks()[0].missed_sets, 1U);
  for (int i = 0; i < 4; ++i) tracker.see({}, false);
  EXPECT_TRUE(tracker.tracks.tracks().empty());  // the maximum time of coasting is for all
}

TEST(PointTracks, EndEarlyIfTheirPositionBecomesUncertain) {
  TrackLife life = usual_life();
  life.max_coast_sigma_u = 0.02;
  Tracker tracker(life);
  for (int i = 0; i < 4; ++i) tracker.see({Point(0.0, 0.0, 1.0)});

  int sets = 0;
  while (!tracker.tracks.tracks().empty() && sets < 9) {
    tracker.see({});
    ++sets;
  }

  EXPECT_GT(sets, 1);
  EXPECT_LT(sets, 9);
}

TEST(PointTracks, AssignMeasurementsWithTheLeastTotalCost) {
  // Two points 10 mm apart. The first measurement is nearest to the second point, but then the second measurement would
  // be without a track.
  Tracker tracker(usual_life());
  for (int i = 0; i < 10; ++i) tracker.see({Point(0.0, 0.0, 1.0), Point(0.010, 0.0, 1.0)});

  tracker.see({Point(0.006, 0.0, 1.0), Point(0.0145, 0.0, 1.0)});

  ASSERT_EQ(tracker.tracks.tracks().size(), 2U);
  EXPECT_EQ(tracker.measurement_of(0), 0U);
  EXPECT_EQ(tracker.measurement_of(1), 1U);
}

TEST(PointTracks, GiveAMeasurementToAConfirmedTrackBeforeATentativeOne) {
  Tracker tracker(usual_life());
  const Point known(0.0, 0.0, 1.0);
  for (int i = 0; i < 5; ++i) tracker.see({known});
  tracker.see({known, known + Point(0.004, 0.0, 0.0)});
  ASSERT_EQ(tracker.tracks.tracks().size(), 2U);

  tracker.see({known + Point(0.003, 0.0, 0.0)});

  ASSERT_EQ(tracker.tracks.tracks().size(), 1U);
  EXPECT_EQ(tracker.tracks.tracks()[0].id, 0U);
  EXPECT_EQ(tracker.tracks.tracks()[0].measurement, 0U);
}

TEST(PointTracks, KeepAKnownAssociationAndExcludeIgnoredMeasurements) {
  Tracker tracker(usual_life());
  const Point first(0.0, 0.0, 1.0), second(0.5, 0.0, 1.0);
  for (int i = 0; i < 5; ++i) tracker.see({first, second});
  tracker.measurements = {{first + Point(0.002, 0.0, 0.0), filter::Matrix<3>::Identity() * 1e-6},
                          {first, filter::Matrix<3>::Identity() * 1e-6},
                          {second, filter::Matrix<3>::Identity() * 1e-6}};
  tracker.tracks.advance(from_ns(0) + from_s(kStep_s * ++tracker.set), 3);

  tracker.tracks.associate(*tracker.tracks.find(0), tracker.measurements, 0);
  tracker.tracks.ignore(2);
  tracker.tracks.assign(tracker.measurements);
  tracker.update();

  EXPECT_EQ(tracker.measurement_of(0), 0U);
  EXPECT_EQ(tracker.measurement_of(1), Tracks::kNone);
  // The measurement beside the association starts a track, the ignored one does not.
  ASSERT_EQ(tracker.tracks.tracks().size(), 3U);
  EXPECT_EQ(tracker.tracks.tracks()[2].measurement, 1U);
}

TEST(PointTracks, AssociateNoMeasurementBeyondTheGateUnlessItIsSure) {
  Tracker tracker(usual_life());
  for (int i = 0; i < 5; ++i) tracker.see({Point(0.0, 0.0, 1.0)});
  tracker.measurements = {{Point(0.3, 0.0, 1.0), filter::Matrix<3>::Identity() * 1e-6}};
  tracker.tracks.advance(from_ns(0) + from_s(kStep_s * ++tracker.set), 1);
  Tracks::Track& track = tracker.tracks.tracks()[0];

  tracker.tracks.associate(track, tracker.measurements, 0);
  EXPECT_EQ(track.measurement, Tracks::kNone);
  tracker.tracks.associate(track, tracker.measurements, 0, true);

  EXPECT_EQ(track.measurement, 0U);
}

TEST(PointTracks, FollowAnOutlierIfTheMixtureAllowsIt) {
  for (const double probability : {0.0, 0.01}) {
    TrackLife life = usual_life();
    life.outlier_probability = probability;
    Tracker tracker(life);
    for (int i = 0; i < 30; ++i) tracker.see({Point(0.0, 0.0, 1.0)});
    tracker.tracks.advance(from_ns(0) + from_s(kStep_s * ++tracker.set), 1);
    const double sigma_m = std::sqrt(tracker.tracks.tracks()[0].gate.predicted_covariance(0, 0) + kSigma_m * kSigma_m);
    // Between the usual gate (4 sigma) and that of an outlier (16 sigma).
    tracker.measurements = {{Point(6.0 * sigma_m, 0.0, 1.0), kSigma_m * kSigma_m * filter::Matrix<3>::Identity()}};

    tracker.tracks.assign(tracker.measurements);

    EXPECT_EQ(tracker.tracks.tracks()[0].measurement, probability > 0.0 ? 0U : Tracks::kNone);
  }
}

TEST(PointTracks, StartNoTrackBeyondTheirBound) {
  Tracker tracker(usual_life(), 3);
  std::vector<Point> points;
  for (int i = 0; i < 5; ++i) points.emplace_back(0.2 * i, 0.0, 1.0);

  tracker.see(points);
  tracker.see(points);

  EXPECT_EQ(tracker.tracks.tracks().size(), 3U);
}

}  // namespace point_tracks_test
}  // namespace mocap::track3d
