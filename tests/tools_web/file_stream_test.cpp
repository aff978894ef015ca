#include "web/takes/file_stream.h"

#include <gmock/gmock.h>

#include <future>

#include "support/temporary_folder.h"

namespace mocap::web {
namespace file_stream_test {

constexpr auto kLong = std::chrono::seconds(60);  // time limit of a failing test

const FileStream::RunHere kAtOnce = [](const std::function<void()>& work) { work(); };

std::string next_of(FileStream& stream) {
  std::promise<std::string> came;
  stream.next([&](std::string piece) { came.set_value(std::move(piece)); });
  auto piece = came.get_future();
  EXPECT_EQ(piece.wait_for(kLong), std::future_status::ready);
  return piece.get();
}

TEST(FileStream, BringsAFileInBoundedPieces) {
  const support::TemporaryFolder folder;
  std::string content;
  for (int i = 0; i < 50'000; ++i) content += std::to_string(i);
  const auto file = OpenFile::open(folder.write("walk.mcap", content));
  ASSERT_TRUE(file) << file.error().message;
  std::filesystem::remove(folder.path() / "walk.mcap");
  Worker worker;
  const auto open = std::make_shared<std::atomic<int>>(0);

  std::string came;
  {
    const auto stream = std::make_shared<FileStream>(*file, worker, kAtOnce, open);
    EXPECT_EQ(*open, 1);
    EXPECT_EQ(stream->size(), content.size());
    for (std::string piece; !(piece = next_of(*stream)).empty(); came += piece) EXPECT_LE(piece.size(), 65536U);
  }

  EXPECT_EQ(came, content);
}

TEST(OpenFile, RefusesWhatIsNoFile) {
  const support::TemporaryFolder folder;
  std::filesystem::create_symlink(folder.write("secret", "x"), folder.path() / "link");

  EXPECT_EQ(OpenFile::open(folder.path() / "none").error().code, ErrorCode::NotFound);
  EXPECT_FALSE(OpenFile::open(folder.path() / "link"));
  EXPECT_THAT(OpenFile::open(folder.path()).error().message, testing::HasSubstr("expected a file"));
}

}  // namespace file_stream_test
}  // namespace mocap::web
