#include "corpus/plans.h"

#include <fmt/format.h>

#include <utility>

#include "corpus/recording.h"
#include "scene/random.h"

namespace mocap::corpus {
namespace {

using chaos::Episode;
using chaos::Fault;
using chaos::FaultKind;

constexpr double kCalm_s = 0.8, kFaulty_s = 0.8, kSeconds = 2.0;

// One person with 18 markers in four cameras: the smallest world in which all kinds of faults happen.
Episode calm_episode(std::uint64_t seed) {
  Episode episode;
  episode.seed = seed;
  episode.cameras = 4;
  episode.subjects = 1;
  episode.first_role = 1;
  episode.rate_hz = 40.0;
  episode.seconds = kSeconds;
  return episode;
}

enum class Reach { Labels, Feed, Takes };

Reach reach_of(FaultKind kind) {
  switch (kind) {
    case FaultKind::PublisherStalls:
    case FaultKind::MessagesLost:
    case FaultKind::MessagesCut: return Reach::Feed;
    case FaultKind::TakeRecorded:
    case FaultKind::TakeNext:
    case FaultKind::TakeCancelled:
    case FaultKind::TakeCut:
    case FaultKind::DiskFull:
    case FaultKind::FolderGone: return Reach::Takes;
    default: return Reach::Labels;
  }
}

// Few, so that the folder is small: each kind of reload once, and once the kinds with large files and those that change
// no label.
std::uint64_t variants_of(FaultKind kind) {
  if (reach_of(kind) != Reach::Labels) return 1;
  switch (kind) {
    case FaultKind::Reload: return 3;
    case FaultKind::SubjectsSwap:
    case FaultKind::NoiseStorm:
    case FaultKind::Bumped:
    case FaultKind::ClockDrift:
    case FaultKind::ClockStill:
    case FaultKind::Dazzled:
    case FaultKind::HostStalls: return 1;
    default: return 2;
  }
}

Plan plan_of(FaultKind kind, std::uint64_t variant) {
  const std::uint64_t seed = 100 * (static_cast<std::uint64_t>(kind) + 1) + variant;
  Episode episode = calm_episode(seed);
  if (kind == FaultKind::SubjectsSwap) episode.subjects = 2;
  episode.utc_stamps = variant == 1;
  scene::Random random(scene::mixed(seed));
  Fault fault = chaos::draw_fault(kind, random, {episode.cameras, episode.subjects, kCalm_s, kCalm_s + kFaulty_s, 1});
  if (kind == FaultKind::Reload) fault.amount = static_cast<double>(variant) + 0.5;  // each kind of reload
  // A fault of takes needs a take that is recorded meanwhile.
  if (reach_of(kind) == Reach::Takes && kind != FaultKind::TakeRecorded) {
    episode.faults.push_back({FaultKind::TakeRecorded, 0.4, 1.4, 0, 0.2});
  }
  episode.faults.push_back(fault);
  return {fmt::format("{}-{}", chaos::name_of(kind), variant + 1), episode};
}

}  // namespace

std::vector<Plan> plans() {
  std::vector<Plan> all;
  for (const FaultKind kind : chaos::all_fault_kinds()) {
    for (std::uint64_t variant = 0; variant < variants_of(kind); ++variant) all.push_back(plan_of(kind, variant));
  }
  Episode two_people = calm_episode(2);
  two_people.subjects = 2;
  Episode utc = calm_episode(3);
  utc.utc_stamps = true;
  Episode impatient = calm_episode(4);
  impatient.patience = std::chrono::milliseconds(2);
  all.push_back({"calm-1", calm_episode(1)});
  all.push_back({"calm-two-people", two_people});
  all.push_back({"calm-utc", utc});
  all.push_back({"calm-short-patience", impatient});
  return all;
}

std::vector<MotionPlan> motion_plans() {
  const std::string pig = "c3d/btk_pig_walk_fullbody_100.c3d", pig_static = "c3d/btk_pig_walk_static_100.c3d";
  const std::string pycgm = "c3d/pycgm_movement_42unlabelled_120.c3d";
  const std::string pycgm_static = "c3d/pycgm_static_38unlabelled_120.c3d";
  return {{"motion-cmu-walk", "openmocap18", "openmocap18", "bvh/cmu_131_01.bvh", "", 3.0},
          {"motion-cmu-shake-hands", "baseline41", "baseline41", "bvh/cmu_18_01_walk_shakehands_A.bvh", "", 5.0},
          {"motion-dm-run", "openmocap18", "openmocap18", "bvh/dm_run.bvh", "", 2.0},
          {"motion-dm-cartwheel", "openmocap18", "openmocap18", "bvh/dm_cartwheel.bvh", "", 1.5},
          {"motion-dm-spin", "openmocap18", "openmocap18", "bvh/dm_spin.bvh", "", 1.5},
          {"motion-btk-walk", "btk", "pluginGait39", pig, pig_static, 1.0},
          {"motion-pycgm", "pycgm", "pluginGait39", pycgm, pycgm_static, 4.0}};
}

}  // namespace mocap::corpus
