#include "scene/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace mocap::scene {
namespace program_test {

using testing::HasSubstr;

TEST(Program, HasActsWithDurationsInTheirOrder) {
  const auto program = parse_program("tpose:3,walk:20.5,wave");

  ASSERT_TRUE(program) << program.error().message;
  ASSERT_EQ(program->scenes.size(), 3U);
  EXPECT_EQ(program->scenes[0].act, Act::TPose);
  EXPECT_EQ(program->scenes[0].duration_s, 3.0);
  EXPECT_EQ(program->scenes[1].act, Act::Walk);
  EXPECT_EQ(program->scenes[1].duration_s, 20.5);
  EXPECT_EQ(program->scenes[2].act, Act::Wave);
}

TEST(Program, RefusesDurationsOutsideTheRangeAndBrokenText) {
  for (const char* text : {"walk:0.9", "walk:86401", "walk:", "walk:3s", "walk:nan", "", "walk,", "walk:-3"}) {
    const auto program = parse_program(text);

    ASSERT_FALSE(program) << text;
    EXPECT_EQ(program.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(program.error().message, HasSubstr("expected tpose, apose, walk"));
  }
}

TEST(ActMix, HasOneActOutsideOfAFadeAndTwoWithin) {
  const Program program = *parse_program("tpose:3,walk:4,wave");

  const ActMix before = mix_at(program, 2.9), within = mix_at(program, 3.3), after = mix_at(program, 3.7);

  EXPECT_EQ(before.first.act, Act::TPose);
  EXPECT_EQ(before.first.share, 1.0);
  EXPECT_EQ(before.second.share, 0.0);
  EXPECT_EQ(within.first.act, Act::TPose);
  EXPECT_NEAR(within.first.share, 0.5, 1e-12) << "the middle of the fade of 0.6 s";
  EXPECT_EQ(within.second.act, Act::Walk);
  EXPECT_EQ(after.first.act, Act::Walk);
  EXPECT_EQ(after.second.share, 0.0);
}

// The oracle integrates the weights numerically.
TEST(ActMix, HasWeightsThatAddUpToOneAndTheirIntegrals) {
  const Program program = *parse_program("tpose:2,walk:1,spin:1.5,walk:2,jump");
  constexpr double kStep_s = 1e-4;
  double walked_s = 0.0, first_s = 0.0, last_s = 0.0;
  for (int i = 0; i < 90'000; ++i) {
    const ActMix middle = mix_at(program, (i + 0.5) * kStep_s);
    ASSERT_NEAR(middle.first.share + middle.second.share, 1.0, 1e-12) << i;
    for (const ActShare& share : {middle.first, middle.second}) {
      if (share.share <= 0.0) continue;
      if (share.act == Act::Walk) walked_s += share.share * kStep_s;
      if (share.act == Act::TPose) first_s += share.share * kStep_s;
      if (share.act == Act::Jump) last_s += share.share * kStep_s;
      // The error of the midpoint rule is below the square of the step, s.
      if (share.act == Act::TPose) {
        EXPECT_NEAR(share.spent_s, first_s, kStep_s) << i;
      }
      if (share.act == Act::Jump) {
        EXPECT_NEAR(share.spent_s, last_s, kStep_s) << i;
      }
    }
    ASSERT_NEAR(middle.walked_before_s, walked_s, kStep_s) << i;
  }
  EXPECT_NEAR(mix_at(program, 1.0).first.whole_s, first_s, kStep_s);
  EXPECT_TRUE(std::isinf(mix_at(program, 9.0).first.whole_s));
}

TEST(ActMix, OfANegativeTimeIsThatOfTheStart) {
  const Program program = *parse_program("crouch:2,wave");

  const ActMix mix = mix_at(program, -5.0);

  EXPECT_EQ(mix.first.act, Act::Crouch);
  EXPECT_EQ(mix.first.share, 1.0);
  EXPECT_EQ(mix.first.spent_s, 0.0);
}

}  // namespace program_test
}  // namespace mocap::scene
