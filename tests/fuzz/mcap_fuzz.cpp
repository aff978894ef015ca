#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "base/expects.h"
#include "base/log.h"
#include "fuzz/fuzz_arguments.h"
#include "support/temporary_folder.h"
#include "take/mcap/edit.h"
#include "take/mcap/encode_records.h"
#include "take/mcap/reader.h"
#include "take/mcap/writer.h"
#include "take/take_edit.h"
#include "take/take_reader.h"

// Fuzzes the readers of MCAP files and takes with random bytes and with files of which bytes are damaged, removed or
// added. Each file must be read within the bounds or refused with a reason; a repaired file must be valid.
//
// usage: mcap_fuzz [COUNT [SEED]]

namespace mocap::take::mcap {
namespace {

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed) : random_(seed) {
    set_log_level(LogLevel::Error);
    for (const Compression compression : {Compression::Zstd, Compression::Lz4, Compression::None}) {
      valid_.push_back(valid_file(compression));
    }
    valid_.push_back(plain_file());
  }

  void try_once() {
    const std::filesystem::path path = folder_.path() / "fuzz.mcap";
    const std::string bytes = below(20) == 0 ? random_file() : damaged(valid_[static_cast<std::size_t>(below(4))]);
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    read(path);
    static_cast<void>(verify_take(path));
    if (below(4) == 0) static_cast<void>(add_metadata(path, {"take", {{"notes", "n"}}}));
    const auto repair = repair_file(path);
    if (!repair) {
      MOCAP_EXPECTS(!repair.error().message.empty());
      return;
    }
    const auto faults = verify_file(path);
    MOCAP_EXPECTS(faults.has_value() && faults->empty());
    read(path);
  }

 private:
  int below(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

  std::string random_bytes(int most) {
    std::string bytes(static_cast<std::size_t>(below(most)), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random_());
    return bytes;
  }

  std::string random_file() { return std::string(kMagic) + random_bytes(300); }

  std::string valid_file(Compression compression) {
    const std::filesystem::path path = folder_.path() / "valid.mcap";
    std::filesystem::remove(path);
    WriterSettings settings;
    settings.compression = compression;
    settings.sync = false;
    Result<Writer> writer = Writer::create(path, {"mocap", "fuzz"}, settings);
    MOCAP_EXPECTS(writer.has_value());
    const auto schema = writer->add_schema("mocap.v1.Snapshot", "protobuf", random_bytes(50));
    for (const char* topic : {"snapshot", "description", "blobs/a", "event"}) {
      MOCAP_EXPECTS(writer->add_channel(topic, "protobuf", *schema).has_value());
    }
    MOCAP_EXPECTS(writer->add_metadata(encode(TakeInfo{})).has_value());
    const std::string file = random_bytes(100);
    MOCAP_EXPECTS(writer->add_attachment({1, 0, "rig", "text", file}).has_value());
    for (std::uint64_t i = 0; i < 30; ++i) {
      const std::string message = random_bytes(40);
      MOCAP_EXPECTS(writer->append(static_cast<std::uint16_t>(i % 4), i * 9'000'000, message).has_value());
    }
    MOCAP_EXPECTS(writer->finish().has_value());
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  // Messages outside of chunks, and no index.
  static std::string plain_file() {
    std::string bytes(kMagic);
    mcap::encode(Header{"", "fuzz"}, bytes);
    mcap::encode(Channel{3, 0, "snapshot", "protobuf", {}}, bytes);
    for (std::uint64_t i = 0; i < 10; ++i) mcap::encode(Message{3, 0, i, i, "message"}, bytes);
    mcap::encode(DataEnd{}, bytes);
    mcap::encode(Footer{}, bytes);
    return bytes += kMagic;
  }

  std::string damaged(std::string bytes) {
    for (int i = below(4); i > 0 && !bytes.empty(); --i) {
      const auto at = random_() % bytes.size();
      switch (below(5)) {
        case 0: bytes[at] = static_cast<char>(random_()); break;
        case 1: bytes.resize(at); break;
        case 2: bytes.insert(at, random_bytes(30)); break;
        case 3: bytes.erase(at, static_cast<std::size_t>(below(30))); break;
        default: bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
      }
    }
    return bytes;
  }

  static void read(const std::filesystem::path& path) {
    const auto reader = Reader::open(path);
    if (!reader) {
      MOCAP_EXPECTS(!reader.error().message.empty());
      return;
    }
    MessageCursor cursor(*reader);
    for (auto message = cursor.next(); !message || *message; message = cursor.next()) {
      if (!message) continue;
      MOCAP_EXPECTS(reader->summary().channels.contains((*message)->channel_id));
    }
    for (const auto& one : reader->summary().attachments) static_cast<void>(reader->attachment(one));
    for (const auto& one : reader->summary().metadata) static_cast<void>(reader->metadata(one));
    const auto take = TakeReader::open(path);
    if (!take) return;
    TakeCursor records = take->messages();
    for (auto record = records.next(); !record || *record; record = records.next()) {
      if (record) static_cast<void>(snapshot_of(**record)), static_cast<void>(blobs_of(**record));
    }
  }

  support::TemporaryFolder folder_;
  std::mt19937_64 random_;
  std::vector<std::string> valid_;
};

}  // namespace
}  // namespace mocap::take::mcap

int main(int argc, char** argv) {
  const mocap::fuzz::Arguments arguments(argc, argv);
  mocap::take::mcap::Fuzz fuzz(arguments.seed);
  for (std::uint64_t i = 0; i < arguments.count; ++i) fuzz.try_once();
  arguments.print("files");
  return 0;
}
