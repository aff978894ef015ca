#include "wire/codec/encode_numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace mocap::wire {
namespace encode_numbers_test {

TEST(EncodeNumbers, HaveACodeForEachState) {
  EXPECT_EQ(code_of(SubjectPhase::Searching), v1::SUBJECT_PHASE_SEARCHING);
  EXPECT_EQ(code_of(SubjectPhase::Tracking), v1::SUBJECT_PHASE_TRACKING);
  EXPECT_EQ(code_of(SubjectPhase::Lost), v1::SUBJECT_PHASE_LOST);
  EXPECT_EQ(code_of(LabelState::Lost), v1::MARKER_STATE_LOST);
  EXPECT_EQ(code_of(LabelState::Measured), v1::MARKER_STATE_MEASURED);
  EXPECT_EQ(code_of(LabelState::Filled), v1::MARKER_STATE_FILLED);
  EXPECT_EQ(code_of(BoneState::Lost), v1::BONE_STATE_LOST);
  EXPECT_EQ(code_of(BoneState::Measured), v1::BONE_STATE_MEASURED);
  EXPECT_EQ(code_of(BoneState::Filled), v1::BONE_STATE_FILLED);
}

TEST(EncodeNumbers, RoundAFractionToPercents) {
  for (std::uint32_t tenth = 0; tenth <= 1000; ++tenth) {
    if (tenth % 10 == 5) continue;  // a half has no nearest percent
    const float fraction = static_cast<float>(tenth) / 1000.0F;
    EXPECT_EQ(percent(fraction), std::lround(0.1 * tenth)) << fraction;
  }
  EXPECT_EQ(percent(-0.3F), 0U);
  EXPECT_EQ(percent(std::numeric_limits<float>::infinity()), 100U);
}

TEST(EncodeNumbers, RoundAResidualToThousandthsOfAPixelUpToItsBound) {
  EXPECT_EQ(millipx(0.0), 0U);
  EXPECT_EQ(millipx(0.0004), 0U);
  EXPECT_EQ(millipx(0.1234), 123U);
  EXPECT_EQ(millipx(0.1236), 124U);
  EXPECT_EQ(millipx(-2.0), 0U);
  EXPECT_EQ(millipx(1e9), 1'000'000'000U);
}

TEST(EncodeNumbers, ReserveZeroForNoTrack) {
  EXPECT_EQ(plus_one(TrackId{}), 0U);
  EXPECT_EQ(plus_one(TrackId{0}), 1U);
  EXPECT_EQ(plus_one(TrackId{TrackId::kNothing - 1}), TrackId::kNothing);
}

}  // namespace encode_numbers_test
}  // namespace mocap::wire
