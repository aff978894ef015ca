#include "model/identity_map.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace mocap {
namespace identity_map_test {

constexpr CameraId kCamera{1};
constexpr BlobTrackId kBlobTrack{7};
constexpr Label kLabel{SubjectId{0}, 2};

/// Predicted markers of these 3D tracks.
PredictedMarkers predict_tracks(const std::vector<std::uint32_t>& tracks) {
  PredictedMarkers predicted;
  for (const std::uint32_t track : tracks) predicted.push_back({}).track = TrackId{track};
  return predicted;
}

PredictedMarker prediction_of(Label label) {
  PredictedMarker marker;
  marker.label = label;
  return marker;
}

/// An identity map of two cameras. The second camera sees one blob a set; a test writes how the blob was associated.
class Identities {
 public:
  enum class Seen { ByNone, ByOne, ByOneAmbiguously, ByThree };

  Identities() { frame_.camera = kCamera; }

  /// One set: which predicted marker the blob belongs to, before the set is associated. Then the set is associated: the
  /// blob is a view of `marker`.
  std::uint32_t step(const PredictedMarkers& predicted, Seen seen, std::uint32_t marker = 0,
                     BlobTrackId blob_track = kBlobTrack) {
    frame_.blobs.clear();
    Blob blob;
    blob.track = blob_track;
    frame_.blobs.push_back(blob);
    return step_frame(predicted, seen, marker);
  }

  /// A set in which the camera sees no blob.
  void step_dark(const PredictedMarkers& predicted) {
    frame_.blobs.clear();
    (void)step_frame(predicted, Seen::ByNone, 0);
  }

  const Predictions& last() const { return *last_; }

 private:
  std::uint32_t step_frame(const PredictedMarkers& predicted, Seen seen, std::uint32_t marker) {
    FrameSet frames;
    frames.exposed_at = from_ns(1'000'000'000) + from_s(static_cast<double>(sets_++) / 120.0);
    frames.views.push_back(&frame_);
    last_ = &map_->predict(frames, predicted, {});
    const auto& known = last_->views[0].marker_of_blob;
    const std::uint32_t found = known.empty() ? BlobIdentities::kUnknown : known[0];

    matches_->matches.clear();
    matches_->bearing_only.clear();
    if (seen == Seen::ByThree) {
      Match& match = matches_->matches.push_back({});
      match.prediction = marker;
      for (int view = 0; view < 3; ++view) match.sightings.push_back({});  // of the one view: only its camera matters
    } else if (seen != Seen::ByNone) {
      BearingOnlyObservation& bearing_only = matches_->bearing_only.push_back({});
      bearing_only.prediction = marker;
      bearing_only.is_ambiguous = seen == Seen::ByOneAmbiguously;
    }
    map_->update(frames, *matches_, {});
    return found;
  }

  BlobFrame frame_;
  std::unique_ptr<IdentityMap> map_ = std::make_unique<IdentityMap>(2);
  std::unique_ptr<Matches> matches_ = std::make_unique<Matches>();
  const Predictions* last_ = nullptr;
  int sets_ = 0;
};

using Seen = Identities::Seen;

void teach(Identities& identities, const PredictedMarkers& predicted, std::uint32_t marker) {
  for (int set = 0; set < 3; ++set) identities.step(predicted, Seen::ByOne, marker);
}

TEST(IdentityMap, EstablishesA2DTrackAfterThreeSets) {
  Identities identities;
  const PredictedMarkers predicted = predict_tracks({40, 50});

  EXPECT_EQ(identities.step(predicted, Seen::ByOne, 1), BlobIdentities::kUnknown);
  EXPECT_EQ(identities.step(predicted, Seen::ByOne, 1), BlobIdentities::kUnknown);
  EXPECT_EQ(identities.step(predicted, Seen::ByOne, 1), BlobIdentities::kUnknown);

  EXPECT_EQ(identities.step(predicted, Seen::ByNone), 1U);
  EXPECT_EQ(identities.step(predicted, Seen::ByNone, 0, BlobTrackId{8}), BlobIdentities::kUnknown);
  EXPECT_EQ(identities.step(predicted, Seen::ByNone, 0, BlobTrackId{}), BlobIdentities::kUnknown);
}

TEST(IdentityMap, LearnsFromThreeViewsThatAgree) {
  Identities identities;
  const PredictedMarkers predicted = predict_tracks({40, 50});

  identities.step(predicted, Seen::ByThree, 1);

  EXPECT_EQ(identities.step(predicted, Seen::ByNone), 1U);
}

TEST(IdentityMap, LearnsNothingFromAnAmbiguousBearing) {
  Identities identities;
  const PredictedMarkers predicted = predict_tracks({40, 50});

  for (int set = 0; set < 5; ++set) identities.step(predicted, Seen::ByOneAmbiguously, 1);

  EXPECT_EQ(identities.step(predicted, Seen::ByNone), BlobIdentities::kUnknown);
}

TEST(IdentityMap, FindsThe3DTrackAtAnyIndexOfThePredictions) {
  Identities identities;
  teach(identities, predict_tracks({40, 50}), 1);

  EXPECT_EQ(identities.step(predict_tracks({20, 30, 50}), Seen::ByNone), 2U);
  EXPECT_EQ(identities.step(predict_tracks({40, 60}), Seen::ByNone), BlobIdentities::kUnpredicted);
}

TEST(IdentityMap, FindsAMarkerByItsLabelAfterIts3DTrackEnded) {
  Identities identities;
  PredictedMarkers tracked = predict_tracks({40, 50});
  tracked[1].label = kLabel;
  teach(identities, tracked, 1);

  PredictedMarkers by_body = predict_tracks({40});
  by_body.push_back(prediction_of(kLabel));

  EXPECT_EQ(identities.step(by_body, Seen::ByNone), 1U);
  EXPECT_EQ(identities.step(predict_tracks({40}), Seen::ByNone), BlobIdentities::kUnpredicted);
}

TEST(IdentityMap, ForgetsA2DTrackThatMissesAnImage) {
  Identities identities;
  const PredictedMarkers predicted = predict_tracks({40});
  teach(identities, predicted, 0);
  ASSERT_EQ(identities.step(predicted, Seen::ByNone), 0U);

  identities.step_dark(predicted);

  EXPECT_EQ(identities.step(predicted, Seen::ByNone), BlobIdentities::kUnknown);
  EXPECT_EQ(identities.step(predicted, Seen::ByNone), BlobIdentities::kUnknown);
}

TEST(IdentityMap, AssociatesAnotherMarkerAfterThreeSetsThatAgree) {
  Identities identities;
  const PredictedMarkers predicted = predict_tracks({40, 50});
  teach(identities, predicted, 0);

  EXPECT_EQ(identities.step(predicted, Seen::ByOne, 1), 0U);
  EXPECT_EQ(identities.step(predicted, Seen::ByOne, 1), BlobIdentities::kUnknown);
  EXPECT_EQ(identities.step(predicted, Seen::ByOne, 1), BlobIdentities::kUnknown);

  EXPECT_EQ(identities.step(predicted, Seen::ByNone), 1U);
}

TEST(IdentityMap, RemembersABearingOnlyMarkerFor24Images) {
  Identities identities;
  PredictedMarkers predicted = predict_tracks({40});
  predicted[0].label = kLabel;
  identities.step(predicted, Seen::ByOne);

  for (int image = 0; image < 24; ++image) identities.step(predicted, Seen::ByNone, 0, BlobTrackId{8});
  EXPECT_EQ(identities.last().views[0].recent_bearing_only.size(), 1U);

  identities.step(predicted, Seen::ByNone, 0, BlobTrackId{8});
  EXPECT_TRUE(identities.last().views[0].recent_bearing_only.empty());
}

/// The labels of one subject with three markers: `kLabel` is on `track`.
Labels labels_on(TrackId track) {
  Labels labels;
  labels.resize(1);
  labels[0].subject = kLabel.subject;
  labels[0].markers.resize(3);
  labels[0].markers[kLabel.marker].track = track;
  return labels;
}

TEST(IdentityMap, LabelsThePredictionOfATrackThatTheLabellerLabelled) {
  const auto map = std::make_unique<IdentityMap>(2);
  const Matches none{};
  FrameSet frames;
  const PredictedMarkers tracks = predict_tracks({40, 50});
  PredictedMarkers bodies;
  bodies.push_back(prediction_of(kLabel));
  bodies.push_back(prediction_of(Label{SubjectId{0}, 1}));
  (void)map->predict(frames, tracks, bodies);

  map->update(frames, none, labels_on(TrackId{50}));
  frames.exposed_at = from_s(0.01) + Timestamp{};
  const Predictions& predicted = map->predict(frames, tracks, bodies);

  // The label without a track comes from the body; the label with a track does not.
  ASSERT_EQ(predicted.markers.size(), 3U);
  EXPECT_FALSE(predicted.markers[0].label.names_something());
  EXPECT_EQ(predicted.markers[1].label, kLabel);
  EXPECT_EQ(predicted.markers[2].label, (Label{SubjectId{0}, 1}));
  EXPECT_TRUE(map->has_label(TrackId{50}));
  EXPECT_FALSE(map->has_label(TrackId{40}));
}

TEST(IdentityMap, RetainsTheLabelOfAHiddenTrackFor150Ms) {
  const auto map = std::make_unique<IdentityMap>(2);
  const Matches none{};
  FrameSet frames;
  const PredictedMarkers tracks = predict_tracks({40});
  (void)map->predict(frames, tracks, {});
  map->update(frames, none, labels_on(TrackId{40}));

  const auto label_after = [&](double t_s) {
    frames.exposed_at = Timestamp{} + from_s(t_s);
    const Label label = map->predict(frames, tracks, {}).markers[0].label;
    map->update(frames, none, labels_on(TrackId{}));
    return label;
  };

  EXPECT_EQ(label_after(0.010), kLabel);  // the label leaves the track in this set
  EXPECT_FALSE(map->has_label(TrackId{40}));
  EXPECT_EQ(label_after(0.150), kLabel);
  EXPECT_EQ(label_after(0.165), kLabel);  // 155 ms after: retained until this set
  EXPECT_FALSE(label_after(0.170).names_something());
}

TEST(IdentityMap, PrefersTheBodyForARetainedLabelIfTheBodyIsMoreCertain) {
  const auto map = std::make_unique<IdentityMap>(2);
  const Matches none{};
  FrameSet frames;
  const PredictedMarkers tracks = predict_tracks({40});
  PredictedMarkers bodies;
  bodies.push_back(prediction_of(kLabel));
  bodies[0].position = {{0.1, 0.0, 1.0}};
  bodies[0].covariance_m2 *= 1e-4;
  (void)map->predict(frames, tracks, bodies);
  map->update(frames, none, labels_on(TrackId{40}));
  EXPECT_EQ(map->predict(frames, tracks, bodies).markers[0].position.v, tracks[0].position.v);

  map->update(frames, none, labels_on(TrackId{}));

  EXPECT_EQ(map->predict(frames, tracks, bodies).markers[0].position.v, bodies[0].position.v);
}

}  // namespace identity_map_test
}  // namespace mocap
