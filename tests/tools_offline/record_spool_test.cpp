#include "lib/offline/record_spool.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace mocap::offline {
namespace record_spool_test {

TEST(RecordSpool, GivesAnyRecordBackAndLeavesNoFile) {
  const support::TemporaryFolder folder;
  auto spool = RecordSpool::create(folder.path());
  ASSERT_TRUE(spool) << spool.error().message;
  const std::vector<std::string> records{"first", "", std::string(100'000, 'x'), "last"};

  for (const std::string& record : records) ASSERT_TRUE(spool->append(record));

  ASSERT_EQ(spool->size(), 4U);
  for (const std::size_t index : {3U, 0U, 2U, 1U}) EXPECT_EQ(*spool->read(index), records[index]);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(RecordSpool, NamesAFolderThatCannotBeWritten) {
  const auto spool = RecordSpool::create("/proc");

  ASSERT_FALSE(spool);
  EXPECT_NE(spool.error().message.find("'/proc'"), std::string::npos) << spool.error().message;
}

}  // namespace record_spool_test
}  // namespace mocap::offline
