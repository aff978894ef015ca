#include <gmock/gmock.h>
#include <google/protobuf/descriptor.pb.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "support/sanitized.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/take_edit.h"
#include "take/take_reader.h"
#include "take/take_schemas.h"
#include "take/take_writer.h"
#include "wire/codec/camera_blobs.h"

namespace mocap::take {
namespace take_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class TakeTest : public ::testing::Test {
 protected:
  std::filesystem::path path() const { return folder_.path() / "walk-3.mcap"; }
  std::string bytes() const {
    std::ifstream in(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(std::string_view content) const { std::ofstream(path(), std::ios::binary | std::ios::trunc) << content; }
  std::vector<std::string> faults() const {
    std::vector<std::string> all;
    const auto found = verify_take(path());
    if (!found) return {found.error().message};
    for (const auto& fault : *found) all.push_back(fault.what);
    return all;
  }

  support::TemporaryFolder folder_;
};

TEST_F(TakeTest, RoundTripsMessagesInfoAndFilesWithEachCompression) {
  for (const auto compression : {mcap::Compression::Zstd, mcap::Compression::Lz4, mcap::Compression::None}) {
    std::filesystem::remove(path());
    mcap::WriterSettings settings;
    settings.compression = compression;
    ASSERT_NO_FATAL_FAILURE(record_example(path(), 100, settings));

    const auto reader = TakeReader::open(path());

    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_FALSE(reader->cut_off());
    const ExampleContent content = read_example(*reader);
    EXPECT_EQ(content.wrong, 0U);
    EXPECT_EQ(content.errors, 0U) << content.first_error;
    EXPECT_EQ(content.descriptions, 1U);
    EXPECT_EQ(content.snapshots.size(), 100U);
    EXPECT_EQ(content.blobs[0].size(), 100U);
    EXPECT_EQ(content.blobs[1].size(), 100U);
    EXPECT_EQ(reader->info().notes, "first try\nshoe lost");
    EXPECT_THAT(reader->info().tags, ElementsAre("walk", "two subjects"));
    EXPECT_EQ(reader->info().ended_at, example_time(100));
    EXPECT_EQ(reader->info().end_timecode, "10:00:05:00");
    EXPECT_THAT(reader->files(), ElementsAre("mocapd.toml", "rig.toml"));
    EXPECT_EQ(*reader->file("rig.toml"), std::string(3000, 'r'));
    EXPECT_EQ(reader->description()->cameras[1].name, "camera1");
    EXPECT_EQ(reader->counts().at("blobs/camera1"), 100U);
    EXPECT_THAT(faults(), IsEmpty());
  }
}

TEST_F(TakeTest, SelectsTopicsAndTimes) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 100));
  const auto reader = TakeReader::open(path());
  ASSERT_TRUE(reader);

  TakeCursor cursor = reader->messages({{TakeTopic::Snapshot}, example_time(30), example_time(40)});
  std::vector<std::uint64_t> numbers;
  for (auto record = cursor.next(); record && *record; record = cursor.next()) {
    numbers.push_back(snapshot_of(**record)->number);
  }

  EXPECT_THAT(numbers, ElementsAre(30, 31, 32, 33, 34, 35, 36, 37, 38, 39));
}

TEST_F(TakeTest, ReadsNoChunkThatEndsBeforeTheSelectedTime) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 100));
  std::string broken = bytes();
  const auto chunk = TakeReader::open(path())->mcap().summary().chunks[2];  // of sets before 30
  broken[chunk.offset + chunk.length / 2] ^= 1;
  write(broken);
  const auto reader = TakeReader::open(path());
  ASSERT_TRUE(reader);
  const auto read = [&](std::optional<Timestamp> from) {
    TakeCursor cursor = reader->messages({{TakeTopic::Snapshot}, from});
    std::pair<std::size_t, std::size_t> snapshots_and_errors;
    for (auto record = cursor.next(); !record || *record; record = cursor.next()) {
      ++(record ? snapshots_and_errors.first : snapshots_and_errors.second);
    }
    return snapshots_and_errors;
  };

  EXPECT_EQ(read(example_time(30)), std::pair(std::size_t{70}, std::size_t{0}));
  for (const auto from : {std::optional<Timestamp>(), {Timestamp::min()}, {example_time(0)}}) {
    EXPECT_EQ(read(from).second, 1U);
    EXPECT_LT(read(from).first, 100U);
  }
}

TEST_F(TakeTest, KeepsAnExistingTake) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 5));
  const std::string first = bytes();

  ASSERT_NO_FATAL_FAILURE(record_example(path(), 7));

  EXPECT_EQ(bytes(), first);
  const auto second = TakeReader::open(folder_.path() / "walk-3-2.mcap");
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(read_example(*second).snapshots.size(), 7U);
}

TEST_F(TakeTest, WritesWaitingMessagesAtATick) {
  auto writer = TakeWriter::create(path(), example_start());
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->append(example_snapshot(0)));

  ASSERT_TRUE((*writer)->tick(example_time(0) + std::chrono::milliseconds(49)));
  const auto before = read_example(*TakeReader::open(path()));
  ASSERT_TRUE((*writer)->tick(example_time(0) + std::chrono::milliseconds(50)));
  const auto reader = TakeReader::open(path());

  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->is_being_written());
  EXPECT_TRUE(reader->cut_off());
  EXPECT_EQ(before.snapshots.size(), 0U);
  EXPECT_EQ(read_example(*reader).snapshots.size(), 1U);
  EXPECT_EQ((*writer)->size().records, 2U);  // with the description
}

TEST_F(TakeTest, RefusesWhatCannotBeRight) {
  const auto other_ending = TakeWriter::create(folder_.path() / "take.blobs", example_start());
  ASSERT_FALSE(other_ending);
  EXPECT_THAT(other_ending.error().message, HasSubstr("expected .mcap"));
  TakeStart start = example_start();
  start.info.rating = 6;
  EXPECT_THAT(TakeWriter::create(path(), start).error().message, HasSubstr("the rating is 6, expected 0 to 5"));
  start = example_start();
  start.description.cameras[1].name = start.description.cameras[0].name;
  EXPECT_THAT(TakeWriter::create(path(), start).error().message, HasSubstr("the topic 'blobs/camera0' occurs twice"));
  auto writer = TakeWriter::create(folder_.path() / "second.mcap", example_start());
  ASSERT_TRUE(writer);
  EXPECT_THAT((*writer)->append("health2", example_time(0), "").error().message, HasSubstr("no topic 'health2'"));
}

TEST_F(TakeTest, EditsTheInfoAndLeavesTheDataWhereTheyAre) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 60));
  const std::string before = bytes();
  TakeEdit edit;
  edit.notes = "good";
  edit.rating = 4;

  for (int i = 0; i < 3; ++i) ASSERT_TRUE(edit_take(path(), edit));

  const auto reader = TakeReader::open(path());
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ(reader->info().notes, "good");
  EXPECT_EQ(reader->info().rating, 4);
  EXPECT_EQ(reader->info().slate, "12A");
  EXPECT_EQ(read_example(*reader).snapshots.size(), 60U);
  EXPECT_THAT(faults(), IsEmpty());
  const std::uint64_t data = reader->mcap().summary().chunks.back().offset;
  EXPECT_EQ(bytes().substr(0, data), before.substr(0, data));
}

TEST_F(TakeTest, RefusesToEditAFileWhoseFooterHasMoreFields) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 10));
  std::string changed = bytes();
  const std::size_t footer = changed.size() - mcap::kFileEnd_bytes;
  changed[footer + 1] = static_cast<char>(changed[footer + 1] + 4);  // its length
  changed.insert(changed.size() - mcap::kMagic.size(), "more");
  std::ofstream(path(), std::ios::binary) << changed;

  const Result<TakeInfo> edited = edit_take(path(), {});

  ASSERT_FALSE(edited);
  EXPECT_THAT(edited.error().message, HasSubstr("repair it"));
  EXPECT_EQ(bytes(), changed);
}

// The file at each instant of an edit: the first write puts a part of the new end behind the old DataEnd, the second
// puts the metadata over it.
TEST_F(TakeTest, AnEditThatIsInterruptedAtAnyByteLosesNoData) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 40));
  const std::string before = bytes();
  TakeEdit edit;
  edit.notes = "changed";
  ASSERT_TRUE(edit_take(path(), edit));
  const std::string after = bytes();
  const auto differ = std::mismatch(before.begin(), before.end(), after.begin());
  const auto end = static_cast<std::size_t>(differ.first - before.begin()) + mcap::kDataEnd_bytes;

  for (std::size_t written = end; written <= after.size(); written += 1 + after.size() / 300) {
    std::string between = after.substr(0, written) + before.substr(std::min(written, before.size()));
    between.replace(end - mcap::kDataEnd_bytes, mcap::kDataEnd_bytes, before, end - mcap::kDataEnd_bytes,
                    mcap::kDataEnd_bytes);
    write(between);

    const auto reader = TakeReader::open(path());

    ASSERT_TRUE(reader) << written << ": " << reader.error().message;
    const ExampleContent content = read_example(*reader);
    ASSERT_EQ(content.snapshots.size(), 40U) << written;
    ASSERT_EQ(content.wrong + content.errors, 0U) << written << ": " << content.first_error;
    ASSERT_TRUE(repair_take(path()));
    ASSERT_THAT(faults(), IsEmpty()) << written;
  }
}

// A planted defect of tests/tools_chaos: such a take was called whole, because all its data are there.
TEST_F(TakeTest, FindsATakeThatEndsWithinItsIndexAndRepairsIt) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 30));
  std::string whole = bytes();
  whole.resize(whole.size() - 9);
  write(whole);

  EXPECT_THAT(faults(), Not(IsEmpty()));
  ASSERT_TRUE(repair_take(path()));
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(TakeTest, RepairsATakeThatWasCutAtAnyByte) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 30));
  const std::string whole = bytes();
  const std::uint64_t start = TakeReader::open(path())->mcap().summary().chunks.front().offset;
  std::mt19937 random(1);

  for (std::size_t size = start; size < whole.size(); size += 1 + random() % 1500) {
    write(whole.substr(0, size));
    const auto cut = TakeReader::open(path());
    ASSERT_TRUE(cut) << size << ": " << cut.error().message;
    const ExampleContent before = read_example(*cut);

    const auto repair = repair_take(path());

    ASSERT_TRUE(repair) << size << ": " << repair.error().message;
    const auto repaired = TakeReader::open(path());
    ASSERT_TRUE(repaired);
    EXPECT_FALSE(repaired->cut_off());
    EXPECT_TRUE(repaired->info().repaired);
    const ExampleContent content = read_example(*repaired);
    ASSERT_EQ(content.snapshots, before.snapshots) << size;
    ASSERT_EQ(content.wrong + content.errors + before.wrong, 0U) << size;
    ASSERT_TRUE(content.has_no_gap()) << size;
    ASSERT_THAT(faults(), IsEmpty()) << size;
  }
  EXPECT_TRUE(std::filesystem::directory_iterator(folder_.path())->path() == path()) << "no other file is left";
}

TEST_F(TakeTest, SaysOfATakeThatWasCutOffAtItsBeginningThatItHasNoSet) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 10));
  std::filesystem::resize_file(path(), 200);  // within the schemas, which come before the metadata

  const auto reader = TakeReader::open(path());

  ASSERT_FALSE(reader);
  EXPECT_THAT(reader.error().message, HasSubstr("walk-3.mcap': the recording was cut off at its beginning"));
}

TEST_F(TakeTest, DamagedBytesGiveNoWrongMessage) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 60));
  const std::string whole = bytes();
  std::mt19937 random(4);
  constexpr unsigned kDamages = support::kSanitized ? 60 : 200;
  std::size_t noticed = 0, kept = 0;

  for (unsigned i = 0; i < kDamages; ++i) {
    std::string broken = whole;
    for (auto flips = 1 + random() % 3; flips > 0; --flips) {
      broken[random() % broken.size()] ^= static_cast<char>(1 << (random() % 8));
    }
    write(broken);
    const auto reader = TakeReader::open(path());
    if (!reader) {
      EXPECT_THAT(reader.error().message, HasSubstr(path().string()));
      ++noticed;
      continue;
    }
    const ExampleContent content = read_example(*reader);
    ASSERT_EQ(content.wrong, 0U) << i;
    EXPECT_TRUE(content.errors == 0 || content.first_error.find("byte") != std::string::npos) << content.first_error;
    if (!faults().empty()) ++noticed;
    ASSERT_TRUE(repair_take(path())) << i;
    const auto repaired = TakeReader::open(path());
    ASSERT_TRUE(repaired);
    const ExampleContent rest = read_example(*repaired);
    ASSERT_EQ(rest.wrong + rest.errors, 0U) << i << ": " << rest.first_error;
    ASSERT_GE(rest.snapshots.size(), content.snapshots.size()) << i;
    ASSERT_THAT(faults(), IsEmpty()) << i;
    kept += rest.snapshots.size();
  }

  EXPECT_EQ(noticed, kDamages);
  EXPECT_GT(kept, kDamages * 45U);  // 7 of 60 sets are in a chunk
}

// The opcode of a record, and what a reader must still find.
TEST_F(TakeTest, ADamagedOpcodeHidesNoOtherRecord) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 60));
  const std::string whole = bytes();
  const auto chunks = TakeReader::open(path())->mcap().summary().chunks;
  const std::size_t header = mcap::kMagic.size(), chunk = chunks[2].offset;
  const std::size_t end = whole.rfind(std::string("\x0F\x04\0\0\0\0\0\0\0", 9));  // DataEnd
  constexpr char kFooter = 2, kDataEnd = 15, kUnknown = 50;

  for (const auto& [at, opcode] : {std::pair(header, kUnknown), {chunk, kFooter}, {chunk, kDataEnd}, {end, kUnknown}}) {
    std::string broken = whole;
    broken[at] = opcode;
    write(broken);

    ASSERT_TRUE(repair_take(path())) << at;

    EXPECT_THAT(faults(), IsEmpty()) << at;
    EXPECT_EQ(bytes()[header], 1) << "the header is the first record";
    const auto reader = TakeReader::open(path());
    const ExampleContent content = read_example(*reader);
    EXPECT_EQ(content.wrong + content.errors, 0U) << content.first_error;
    EXPECT_GE(content.snapshots.size(), 50U) << at;  // 7 of 60 sets are in a chunk
  }
}

TEST_F(TakeTest, LeavesOutAMessageIndexWithoutContent) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 20));
  const auto last = TakeReader::open(path())->mcap().summary().chunks.back();
  write(bytes().substr(0, last.offset + last.length) + '\x07' + std::string(8, '\0'));

  ASSERT_TRUE(repair_take(path()));

  EXPECT_THAT(faults(), IsEmpty());
  EXPECT_EQ(read_example(*TakeReader::open(path())).snapshots.size(), 20U);
}

TEST_F(TakeTest, IsNotWrittenByTwo) {
  auto writer = TakeWriter::create(path(), example_start());
  ASSERT_TRUE(writer);

  EXPECT_EQ(edit_take(path(), {}).error().code, ErrorCode::Busy);
  EXPECT_EQ(repair_take(path()).error().code, ErrorCode::Busy);
}

// As a version before the check of the texts wrote it.
TEST_F(TakeTest, ReadsAndEditsATakeWhoseTextsAreNotUtf8) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 5));
  TakeInfo old = example_end(5);
  old.notes = "caf\xE9";
  old.tags = {"\xFFwalk"};
  ASSERT_TRUE(mcap::add_metadata(path(), encode(old)));

  EXPECT_EQ(TakeReader::open(path())->info().tags, std::vector<std::string>{"?walk"});
  TakeEdit rating;
  rating.rating = 2;
  const auto edited = edit_take(path(), rating);
  ASSERT_TRUE(edited) << edited.error().message;
  EXPECT_EQ(edited->notes, "caf?");
}

TEST_F(TakeTest, RenamesWithoutReplacing) {
  ASSERT_NO_FATAL_FAILURE(record_example(path(), 5));
  folder_.write("best.mcap", "other");

  const auto refused = rename_take(path(), "best");
  const auto renamed = rename_take(path(), "best-2");

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("the next free name is 'best-2'"));
  ASSERT_TRUE(renamed);
  EXPECT_TRUE(TakeReader::open(*renamed));
  EXPECT_FALSE(rename_take(*renamed, "../best"));
  EXPECT_EQ(rename_take(path(), "other").error().code, ErrorCode::NotFound);
}

TEST_F(TakeTest, SaysThatAnotherFileIsNoTake) {
  write("mocapblobs\n");
  EXPECT_THAT(TakeReader::open(path()).error().message, HasSubstr("byte 0: not an MCAP file"));
  std::filesystem::remove(path());
  EXPECT_EQ(TakeReader::open(path()).error().code, ErrorCode::NotFound);
  auto writer = mcap::Writer::create(path(), {}, {});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->finish());
  EXPECT_THAT(TakeReader::open(path()).error().message, HasSubstr("no take"));
}

TEST(TakeSchemas, ListImportedFilesFirst) {
  google::protobuf::FileDescriptorSet set;
  ASSERT_TRUE(set.ParseFromString(schema_of(*v1::Snapshot::descriptor())));

  ASSERT_EQ(set.file_size(), 2);
  EXPECT_EQ(set.file(0).name(), "mocap/v1/description.proto");
  EXPECT_EQ(set.file(1).name(), "mocap/v1/snapshot.proto");
}

TEST(CameraBlobs, RefusesColumnsOfDifferentLengthAndNumbersThatAreNotFinite) {
  v1::CameraBlobs message;
  wire::encode(example_blobs(0, 3), message);
  ASSERT_TRUE(wire::decode(message));
  message.mutable_sigma_px()->Set(0, std::nan(""));
  EXPECT_FALSE(wire::decode(message));
  message.mutable_sigma_px()->Set(0, 0.1);
  message.add_flags(0);
  EXPECT_FALSE(wire::decode(message));
}

TEST(TakeInfo, KeepsUnknownKeysAndWritesUtc) {
  TakeInfo info = example_start().info;
  info.others["stage"] = "B";

  const mcap::Metadata metadata = encode(info);
  const auto read = decode_info(metadata);

  ASSERT_TRUE(read);
  EXPECT_EQ(read->others.at("stage"), "B");
  EXPECT_EQ(metadata.texts.at("start_utc"), "2023-11-14T22:13:25.000000000Z");
}

}  // namespace take_test
}  // namespace mocap::take
