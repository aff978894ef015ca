#include "base/result.h"

#include <gtest/gtest.h>

#include <csignal>
#include <memory>
#include <set>
#include <string>

namespace mocap {
namespace result_test {

enum class Failure { TooFew, TooMany };

TEST(Result, HoldsAValue) {
  Result<std::string> result = std::string("north");

  ASSERT_TRUE(result);
  result->push_back('!');

  EXPECT_EQ(*result, "north!");
  EXPECT_EQ(result.value(), "north!");
}

TEST(Result, HoldsAnErrorOfAnyType) {
  const Result<int> refused = Error{ErrorCode::Busy, "in use"};
  const Result<int, Failure> counted = Failure::TooMany;

  EXPECT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Busy);
  EXPECT_EQ(refused.error().message, "in use");
  EXPECT_FALSE(counted.has_value());
  EXPECT_EQ(counted.error(), Failure::TooMany);
}

TEST(Result, GivesAwayAValueThatCannotBeCopied) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(7);

  const std::unique_ptr<int> taken = *std::move(result);

  EXPECT_EQ(*taken, 7);
}

TEST(Result, WithoutAValueIsSuccessUnlessItHoldsAnError) {
  const Status success;
  const Status failed = Error{ErrorCode::Timeout, "no answer"};

  EXPECT_TRUE(success);
  EXPECT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::Timeout);
}

TEST(ResultDeathTest, StopsTheProcessIfTheAbsentAlternativeIsRead) {
  const Result<int> value = 7;
  const Result<int> failed = Error{ErrorCode::Io, {}};
  const Status success;

  EXPECT_EXIT(static_cast<void>(value.error()), testing::KilledBySignal(SIGABRT), "violated precondition");
  EXPECT_EXIT(static_cast<void>(failed.value()), testing::KilledBySignal(SIGABRT), "violated precondition");
  EXPECT_EXIT(static_cast<void>(success.error()), testing::KilledBySignal(SIGABRT), "violated precondition");
}

TEST(ErrorCodes, HaveDifferentNames) {
  std::set<std::string> names;

  for (int code = 0; code <= static_cast<int>(ErrorCode::EndOfStream); ++code)
    names.insert(name_of(static_cast<ErrorCode>(code)));

  EXPECT_EQ(names.size(), static_cast<std::size_t>(ErrorCode::EndOfStream) + 1);
  EXPECT_EQ(names.count("unknown"), 0U);
}

}  // namespace result_test
}  // namespace mocap
