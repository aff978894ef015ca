#include <cmath>
#include <filesystem>
#include <string>

#include "base/expects.h"
#include "cameras/replay/replay_recording.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/inputs.h"
#include "support/temporary_folder.h"
#include "support/typical_snapshot.h"
#include "take/recorder/shot_list.h"
#include "take/recordings/blob_recording.h"
#include "wire/codec/json.h"
#include "wire/curve_keys.h"

// Fuzzes the readers of the small files around a recording: shot lists, lists of keys, times of recorded images,
// snapshots as JSON lines, and recordings of blobs. Each file must be read or refused with a reason; a shot list and a
// list of keys are the same after they were written and read again.
//
// usage: files_fuzz [COUNT [SEED]]

namespace mocap::take {
namespace {

namespace fs = std::filesystem;
using fuzz::Inputs;

constexpr const char* kSeeds = "tests/fuzz/seeds/";

template <class Value>
bool is_read(const Result<Value>& result) {
  MOCAP_EXPECTS(result || !result.error().message.empty());
  return result.has_value();
}

Snapshot small_snapshot() {
  return support::typical_snapshot(support::typical_description({.markers = 4, .bones = 2, .cameras = 2}));
}

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed)
      : shots_(Inputs::Kind::Text, seed, fuzz::files_in(kSeeds + std::string("shots"))),
        keys_(Inputs::Kind::Text, seed + 1, fuzz::files_in(kSeeds + std::string("keys"))),
        times_(Inputs::Kind::Text, seed + 2, fuzz::files_in(kSeeds + std::string("times"))),
        lines_(Inputs::Kind::Text, seed + 3, {wire::to_json_line(small_snapshot())}),
        blobs_(Inputs::Kind::Binary, seed + 4, {blob_recording()}) {}

  void try_once() {
    fs::remove(folder_.path() / "own.key");
    const auto own = wire::new_key_pair();
    MOCAP_EXPECTS(own.has_value() && wire::save_key_pair(folder_.path() / "own.key", *own).has_value());
    const auto read_back = wire::load_key_pair(folder_.path() / "own.key");
    MOCAP_EXPECTS(read_back.has_value() && read_back->secret_key == own->secret_key);
    read_shots(shots_.next());
    read_keys(folder_.write("keys", keys_.next()));
    read_times(times_.next());
    if (const auto snapshot = wire::from_json_line(fuzz::Exact(lines_.next()).text()); is_read(snapshot)) ++read_;
    read_blobs(folder_.write("take.blobs", blobs_.next()));
  }

  std::uint64_t read() const { return read_; }

 private:
  std::string blob_recording() {
    const fs::path path = folder_.path() / "seed.blobs";
    const std::vector<RecordedCamera> cameras{{"north", 640, 480}, {"south", 0, 0}};
    auto writer = make_blob_writer(path, cameras);
    MOCAP_EXPECTS(writer.has_value());
    for (std::uint64_t i = 0; i < 6; ++i) {
      BlobFrame frame;
      frame.camera = CameraId{static_cast<std::uint32_t>(i % 2)};
      frame.number = i / 2;
      frame.exposed_at = from_ns(static_cast<std::int64_t>(i) * 9'000'000);
      Blob blob;
      blob.centroid.v = {3.5, 4.25};
      blob.sigma_px = 0.1;
      blob.area_px2 = 5.0;
      for (std::uint64_t b = 0; b < i; ++b) frame.blobs.push_back(blob);
      MOCAP_EXPECTS((*writer)->write(frame).has_value());
    }
    MOCAP_EXPECTS((*writer)->finish().has_value());
    return fuzz::bytes_of(path);
  }

  void read_shots(const std::string& csv) {
    const auto shots = parse_shots(fuzz::Exact(csv).text(), "day.csv");
    if (!is_read(shots)) return;
    ++read_;
    for (const Shot& shot : *shots) MOCAP_EXPECTS(shot.length >= Duration{});
    const auto again = parse_shots(shots_csv(*shots), "again.csv");
    MOCAP_EXPECTS(again.has_value() && *again == *shots);
    ShotList list(folder_.path() / "state/shots.csv");
    MOCAP_EXPECTS(list.replace(*shots).has_value());
    if (const Shot* next = list.next()) MOCAP_EXPECTS(list.set_done(std::string(next->name), true).has_value());
    ShotList read(folder_.path() / "state/shots.csv");
    MOCAP_EXPECTS(read.load().has_value() && read.shots() == list.shots() && read.left() == list.left());
  }

  // Images with the times of a file, and what a daemon replays with them.
  void read_times(const std::string& csv) {
    const fs::path path = folder_.write("images/timestamps.csv", csv);
    if (is_read(cameras::read_recorded_times(path))) ++read_;
    for (const char* image : {"0.pgm", "1.png", "x.pgm", "18446744073709551616.pgm"}) {
      folder_.write(std::string("images/") + image, "");
    }
    const auto recording = cameras::find_recording(path.parent_path(), "north", 60.0);
    if (!is_read(recording)) return;
    MOCAP_EXPECTS(recording->frames.size() == 2 && recording->frames[0].number < recording->frames[1].number);
  }

  void read_keys(const fs::path& path) {
    fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
    static_cast<void>(is_read(wire::load_public_key(path)));
    static_cast<void>(is_read(wire::load_key_pair(path)));
    static_cast<void>(is_read(wire::load_client_keys(path.string(), path.string())));
    const auto keys = wire::load_allowed_keys(path);
    if (!is_read(keys)) return;
    const fs::path copy = folder_.path() / "copy";
    MOCAP_EXPECTS(wire::save_allowed_keys(copy, *keys).has_value());
    const auto again = wire::load_allowed_keys(copy);
    MOCAP_EXPECTS(again.has_value() && again->size() == keys->size());
    for (std::size_t i = 0; i < keys->size(); ++i) {
      MOCAP_EXPECTS((*again)[i].public_key == (*keys)[i].public_key && (*again)[i].name == (*keys)[i].name);
    }
  }

  void read_blobs(const fs::path& path) {
    const auto recording = read_blob_recording(path);
    if (!is_read(recording)) return;
    ++read_;
    MOCAP_EXPECTS(recording->pictures.size() == recording->cameras.size());
    for (const auto& pictures : recording->pictures) {
      for (const RecordedPicture& picture : pictures) {
        for (const Blob& blob : picture.blobs)
          MOCAP_EXPECTS(blob.centroid.v.allFinite() && std::isfinite(blob.sigma_px));
      }
    }
  }

  support::TemporaryFolder folder_;
  Inputs shots_, keys_, times_, lines_, blobs_;
  std::uint64_t read_ = 0;
};

}  // namespace
}  // namespace mocap::take

int main(int argc, char** argv) {
  return mocap::fuzz::run_reading<mocap::take::Fuzz>(argc, argv, "files of each kind");
}
