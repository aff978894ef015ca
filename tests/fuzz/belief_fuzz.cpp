#include <bit>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "assemble.h"
#include "base/archive.h"
#include "base/expects.h"
#include "fuzz/fuzz_arguments.h"
#include "lib/simworld/scene_world.h"
#include "model/take/belief.h"
#include "support/places.h"
#include "synchronise/frame_aligner.h"
#include "track2d/following_blob_tracker.h"

// Damages the belief of a fusion, as a take has it: at several instants of a scene (a T-pose, tracking, a lost body
// that is searched for). A new fusion must refuse it or go on with it.
//
// usage: belief_fuzz [COUNT [SEED]]

namespace mocap {
namespace {

constexpr double kRate_hz = 30.0;
constexpr std::uint32_t kCameras = 4;
constexpr int kSets = 120;
constexpr int kSetsPerBelief = 8;
constexpr int kStepsOfEach = 3;

// The images of a person in a T-pose who then walks; after 1.6 s, 40 % of the markers are hidden.
class Scene {
 public:
  Scene() {
    simworld::SceneFile file;
    file.rate_hz = kRate_hz;
    file.ring.cameras = kCameras;
    simworld::SceneActor& actor = file.actors.emplace_back();
    actor.name = "one";
    actor.marker_set = support::source_folder() + "/config/markersets/openmocap18.toml";
    actor.motion = "tpose:1,walk";
    simworld::SceneHide& hide = file.hides.emplace_back();
    hide.from_s = 1.6;
    hide.share = 0.4;
    auto performers = simworld::make_performers(file, "", 7);
    MOCAP_EXPECTS(performers.has_value());
    settings_.rig = scene::ring_rig(file.ring);
    settings_.nominal_rate_hz = kRate_hz;
    for (const auto& performer : *performers) settings_.subject_models.push_back(performer.subject);
    auto events = simworld::SceneEvents::make(file, *performers, kCameras, 7, true);
    MOCAP_EXPECTS(events.has_value());
    simworld::SceneWorld world(file, settings_.rig, *std::move(performers), *std::move(events), 7);
    std::vector<std::unique_ptr<BlobTracker>> trackers;
    for (std::uint32_t c = 0; c < kCameras; ++c) trackers.push_back(track2d::make_blob_tracker(settings_.track_blobs));
    for (int i = 0; i < kSets; ++i) {
      world.step();
      images_.push_back(world.frames());
      for (BlobFrame& image : images_.back()) trackers[image.camera.value]->track(image);
    }
  }

  const settings::DaemonSettings& settings() const { return settings_; }
  FrameSet set(int number) const {
    FrameSet set;
    set.number = static_cast<std::uint64_t>(number);
    set.expected_views = kCameras;
    for (const BlobFrame& image : images_[static_cast<std::size_t>(number)]) set.views.push_back(&image);
    set.exposed_at = synchronise::mean_exposure(set);
    return set;
  }

 private:
  settings::DaemonSettings settings_;
  std::vector<std::vector<BlobFrame>> images_;  // by set
};

class Beliefs {
 public:
  explicit Beliefs(std::uint64_t seed) : random_(seed) {
    const auto fusion = assemble_fusion(scene_.settings());
    const Belief belief;
    for (int i = 0; i + kStepsOfEach < kSets; ++i) {
      fusion->step(scene_.set(i));
      if (i % kSetsPerBelief != 0) continue;
      Archive members = Archive::writer({belief.memory.get(), kMostBeliefBytes});
      fusion->archive(members);
      MOCAP_EXPECTS(members.ok());
      kept_.push_back({i, {belief.memory.get(), belief.memory.get() + members.size()}});
    }
  }

  void try_once() {
    const Kept& kept = kept_[random_() % kept_.size()];
    const std::vector<std::byte> bytes = damaged(kept.bytes);
    const auto fusion = assemble_fusion(scene_.settings());
    Archive members = Archive::reader(bytes);
    fusion->archive(members);
    if (!members.ok() || members.size() != bytes.size()) return;
    ++read_;
    for (int i = 1; i <= kStepsOfEach; ++i) fusion->step(scene_.set(kept.after_set + i));
  }

  std::uint64_t read() const { return read_; }

 private:
  struct Kept {
    int after_set;
    std::vector<std::byte> bytes;
  };

  std::vector<std::byte> damaged(std::vector<std::byte> bytes) {
    for (auto i = 1 + random_() % 4; i > 0; --i) {
      const std::size_t at = random_() % bytes.size();
      if (random_() % 8 == 0) {
        bytes.resize(at + 1);
        continue;
      }
      // A number of any size, or one that arithmetic does not survive.
      const double numbers[] = {std::bit_cast<double>(random_()), std::nan(""), 1e300, -1e300, 1e9, 0.0};
      const double number = numbers[random_() % std::size(numbers)];
      const std::size_t size = random_() % 2 == 0 ? 1 + random_() % 4 : sizeof number;
      std::memcpy(bytes.data() + at, &number, std::min(size, bytes.size() - at));
    }
    return bytes;
  }

  Scene scene_;
  std::vector<Kept> kept_;
  std::mt19937_64 random_;
  std::uint64_t read_ = 0;
};

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) { return mocap::fuzz::run_reading<mocap::Beliefs>(argc, argv, "damaged beliefs"); }
