#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "assemble.h"
#include "lib/simworld/scene_world.h"
#include "scene/ring_rig.h"
#include "settings/packed_files.h"
#include "settings/rig/rig_file.h"
#include "support/places.h"
#include "support/temporary_folder.h"
#include "synchronise/frame_aligner.h"
#include "take/take_belief.h"
#include "take/take_reader.h"
#include "take/take_writer.h"
#include "track2d/following_blob_tracker.h"
#include "wire/codec/encode.h"

namespace mocap::retrack {

// A person in a T-pose who then walks, seen by four cameras, and the take that the daemon would record of it.
class RecordedWorld {
 public:
  static constexpr std::uint32_t kCameras = 4;
  static constexpr double kRate_hz = 60.0;
  static constexpr Timestamp kStart = from_ns(9'000'000'000);

  /// `mistake`: what is wrong in the rig of the configuration.
  explicit RecordedWorld(const std::function<void(Rig&)>& mistake = {}) {
    const std::string set = support::source_folder() + "/config/markersets/openmocap18.toml";
    scene_.rate_hz = kRate_hz;
    scene_.ring = {.cameras = kCameras, .width_px = 1280, .height_px = 1024};
    simworld::SceneActor& actor = scene_.actors.emplace_back();
    actor.name = "actor";
    actor.motion = "tpose:1.5,walk";
    actor.marker_set = set;
    actor.size = 0.97;
    true_rig_ = scene::ring_rig(scene_.ring);
    Rig configured = true_rig_;
    if (mistake) mistake(configured);
    EXPECT_TRUE(settings::save_rig(folder_.path() / "rig.toml", configured, {}));
    std::string text =
        "[capture]\nrig = \"rig.toml\"\nrate_hz = 60\n[[subject]]\nname = \"actor\"\nmarker_set = \"" + set + "\"\n";
    for (std::uint32_t i = 1; i <= kCameras; ++i) {
      text += "[[camera]]\nname = \"cam" + std::to_string(i) +
              "\"\ndriver = \"synthetic\"\nwidth_px = 1280\nheight_px = 1024\nmarker_set = \"" + set + "\"\n";
    }
    auto loaded = settings::load_daemon_settings(folder_.write("mocapd.toml", text));
    EXPECT_TRUE(loaded) << settings::to_text(loaded.error());
    settings_ = std::make_unique<settings::DaemonSettings>(*std::move(loaded));
  }

  const std::filesystem::path& folder() const { return folder_.path(); }
  const settings::DaemonSettings& settings() const { return *settings_; }
  const Rig& true_rig() const { return true_rig_; }

  // Calls `use` with each of the first sets.
  template <class Use>
  void play(std::uint64_t sets, Use use) const {
    simworld::SceneWorld world = make_world();
    std::vector<std::unique_ptr<BlobTracker>> trackers;
    for (std::uint32_t i = 0; i < kCameras; ++i) trackers.push_back(track2d::make_blob_tracker(settings_->track_blobs));
    for (std::uint64_t set = 0; set < sets; ++set) {
      world.step();
      std::vector<BlobFrame> images = images_of(world, set);
      for (BlobFrame& image : images) trackers[image.camera.value]->track(image);
      use(set_of(images, set, kCameras));
    }
  }

  // Which sets and images the daemon had.
  struct Recording {
    std::uint64_t sets = 300;
    std::uint64_t from = 0;         // the take begins with this set
    std::uint64_t passed_over = 0;  // every n-th set is passed over; 0: none
    std::uint64_t late = 0;         // in every n-th set the last camera is late; 0: none
    bool snapshots = true;
    bool cut_disc = false;    // the border of each image cuts off a disc, whose centre is outside of the image
    std::string belief = {};  // the attachment belief.pb; empty: none
  };

  // Returns the path of the take.
  std::filesystem::path record(const std::string& name, const Recording& wanted) const {
    simworld::SceneWorld world = make_world();
    const auto fusion = assemble_fusion(*settings_);
    std::vector<std::unique_ptr<BlobTracker>> trackers;
    for (std::uint32_t i = 0; i < kCameras; ++i) trackers.push_back(track2d::make_blob_tracker(settings_->track_blobs));
    Description description = describe(*settings_, "session");
    std::unique_ptr<take::TakeWriter> writer;
    for (std::uint64_t set = 0; set < wanted.sets; ++set) {
      world.step();
      std::vector<BlobFrame> images = images_of(world, set);
      for (BlobFrame& image : images) {
        if (wanted.cut_disc) add_cut_disc(image);
        trackers[image.camera.value]->track(image);
      }
      if (set == wanted.from) writer = start(name, description, images.front().exposed_at, wanted.belief);
      for (const BlobFrame& image : images) {
        if (writer) {
          EXPECT_TRUE(writer->append(image));
        }
      }
      if (wanted.passed_over != 0 && set % wanted.passed_over == 1) continue;
      const bool late = wanted.late != 0 && set % wanted.late == 2;
      const Snapshot& snapshot = fusion->step(set_of(images, set, late ? kCameras - 1 : kCameras));
      if (fusion->fit()) {
        description = with_fit(std::move(description), *fusion->fit());
        if (writer) {
          EXPECT_TRUE(writer->append(description, snapshot.instants.exposed_at));
        }
      }
      if (writer && wanted.snapshots) append(*writer, snapshot);
    }
    take::TakeInfo info = info_of(name);
    info.ended_at = kStart + std::chrono::seconds(1000);
    EXPECT_TRUE(writer->finish(info));
    return folder_.path() / (name + ".mcap");
  }

  static take::TakeInfo info_of(const std::string& name) {
    take::TakeInfo info;
    info.name = name;
    info.notes = "first try";
    info.producer = "mocapd test";
    info.utc_minus_host = std::chrono::seconds(1'700'000'000);
    info.started_at = kStart;
    info.others[take::kFirstSetOfRun] = "0";
    return info;
  }

 private:
  simworld::SceneWorld make_world() const {
    auto performers = simworld::make_performers(scene_, "", 1);
    EXPECT_TRUE(performers) << performers.error().message;
    auto events = simworld::SceneEvents::make(scene_, *performers, kCameras, 1, true);
    EXPECT_TRUE(events) << events.error().message;
    return {scene_, true_rig_, *std::move(performers), *std::move(events), 1};
  }

  static void add_cut_disc(BlobFrame& image) {
    Blob disc = image.blobs.front();
    disc.centroid.v = {1280.01, 118.8};
    disc.area_px2 = 20.0;
    image.blobs.push_back(disc);
  }

  // The images, with the skews of cameras that do not expose at quite the same time.
  static std::vector<BlobFrame> images_of(const simworld::SceneWorld& world, std::uint64_t set) {
    std::vector<BlobFrame> images = world.frames();
    for (BlobFrame& image : images) {
      image.number = set + 7;
      image.exposed_at = kStart + from_s(static_cast<double>(set) / kRate_hz) + Duration(1000 * image.camera.value);
      image.received_at = image.exposed_at + std::chrono::milliseconds(3);
      image.detected_at = image.exposed_at + std::chrono::milliseconds(4);
    }
    return images;
  }

  static FrameSet set_of(const std::vector<BlobFrame>& images, std::uint64_t number, std::uint32_t views) {
    FrameSet set;
    set.number = number;
    set.expected_views = kCameras;
    for (std::uint32_t i = 0; i < views; ++i) set.views.push_back(&images[i]);
    set.exposed_at = synchronise::mean_exposure(set);
    return set;
  }

  std::unique_ptr<take::TakeWriter> start(const std::string& name, const Description& description, Timestamp at,
                                          const std::string& belief) const {
    take::TakeStart begin;
    begin.info = info_of(name);
    begin.info.started_at = at;
    begin.description = description;
    for (settings::PackedFile& file : settings::pack_files(*settings_)) {
      begin.files.push_back({.name = std::move(file.name), .bytes = std::move(file.bytes)});
    }
    if (!belief.empty()) begin.files.push_back({.name = take::kBeliefFile, .bytes = belief});
    auto writer = take::TakeWriter::create(folder_.path() / (name + ".mcap"), begin, {.sync = false});
    EXPECT_TRUE(writer) << writer.error().message;
    return *std::move(writer);
  }

  static void append(take::TakeWriter& writer, const Snapshot& snapshot) {
    Snapshot stamped = snapshot;
    stamped.instants.fused_at = *snapshot.instants.detected_at + std::chrono::microseconds(700);
    v1::Snapshot message;
    wire::encode(stamped, message);
    message.set_utc_minus_host_ns(info_of("").utc_minus_host.count());
    message.set_delivering_cameras(kCameras);
    EXPECT_TRUE(writer.append(take::kSnapshotTopic, snapshot.instants.exposed_at, message.SerializeAsString()));
  }

  support::TemporaryFolder folder_;
  simworld::SceneFile scene_;
  Rig true_rig_;
  std::unique_ptr<settings::DaemonSettings> settings_;
};

// The snapshots of a take, as they are in the file.
inline std::vector<std::string> snapshots_in(const std::filesystem::path& path) {
  std::vector<std::string> all;
  const auto take = take::TakeReader::open(path);
  EXPECT_TRUE(take) << take.error().message;
  if (!take) return all;
  take::TakeCursor cursor = take->messages({.topics = {take::TakeTopic::Snapshot}});
  for (auto record = cursor.next(); record && *record; record = cursor.next()) all.emplace_back((*record)->bytes);
  return all;
}

}  // namespace mocap::retrack
