#include "take/take_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <stop_token>
#include <string>
#include <thread>

#include "support/temporary_folder.h"
#include "take/example_take.h"

namespace mocap::take {
namespace take_edit_test {

using ::testing::HasSubstr;

class TakeEditTest : public ::testing::Test {
 protected:
  std::filesystem::path path() const { return folder_.path() / "walk-3.mcap"; }

 private:
  support::TemporaryFolder folder_;
};

Result<TakeInfo> edit_when_free(const std::filesystem::path& path, const TakeEdit& edit) {
  for (;;) {
    Result<TakeInfo> edited = edit_take(path, edit);
    if (edited || edited.error().code != ErrorCode::Busy) return edited;
  }
}

TEST_F(TakeEditTest, KeepsTheChangesOfTwoEditsAtOnce) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 5));
  const std::jthread other([&](const std::stop_token& stop) {
    TakeEdit rating;
    for (int i = 0; !stop.stop_requested(); ++i) {
      rating.rating = i % 5;
      EXPECT_TRUE(edit_when_free(path(), rating));
    }
  });

  for (int i = 0; i < 50; ++i) {
    TakeEdit notes;
    notes.notes = std::to_string(i);
    const auto edited = edit_when_free(path(), notes);
    ASSERT_TRUE(edited) << edited.error().message;
    EXPECT_EQ(edit_when_free(path(), {})->notes, notes.notes);
  }
}

TEST_F(TakeEditTest, RefusesToEditWhatIsNotThere) {
  const auto edited = edit_take(path(), {});

  ASSERT_FALSE(edited);
  EXPECT_EQ(edited.error().code, ErrorCode::NotFound);
  EXPECT_THAT(edited.error().message, HasSubstr(path().string()));
}

TEST_F(TakeEditTest, RefusesANameThatIsTooLongForAFile) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 5));

  const auto renamed = rename_take(path(), std::string(300, 'x'));

  ASSERT_FALSE(renamed);
  EXPECT_THAT(renamed.error().message, HasSubstr("File name too long; choose a shorter name"));
  EXPECT_TRUE(std::filesystem::exists(path()));
}

TEST(TakeInfoTexts, AreRefusedWithTheTextAndTheByteAtFault) {
  TakeInfo info;
  info.tags = {"walk", "caf\xE9"};
  EXPECT_THAT(check(info).error().message, HasSubstr("tag 'caf?': byte 3 is not UTF-8"));
  info.tags.clear();
  info.notes = "two\nlines\t";
  EXPECT_THAT(check(info).error().message, HasSubstr("notes: byte 9 is a control character"));
}

}  // namespace take_edit_test
}  // namespace mocap::take
