#include "chaos/stage.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "chaos/scripted_actor.h"
#include "scene/procedural_actor.h"
#include "scene/program.h"
#include "settings/subject/shipped_marker_sets.h"

namespace mocap::chaos {
namespace {

struct Role {
  const char* name;
  const char* marker_set;
  const char* motion;
  std::array<double, 2> place_m;
};

// Two people with different marker sets.
constexpr std::array kRoles{Role{"one", "baseline41", "walk:4,wave:3,walk", {0.6, 0.5}},
                            Role{"two", "openmocap18", "wave:3,walk", {-0.7, -0.5}}};

Result<simworld::Performer> make_performer(const Episode& episode, std::uint32_t subject,
                                           const std::vector<MarkerSet>& sets) {
  const Role& role = kRoles[(episode.first_role + subject) % kRoles.size()];
  const Role& other = kRoles[(episode.first_role + episode.subjects - 1 - subject) % kRoles.size()];
  const auto set = std::ranges::find(sets, role.marker_set, &MarkerSet::name);
  if (set == sets.end()) {
    return Error{ErrorCode::NotFound, std::string("the marker set ") + role.marker_set +
                                          " is not installed; run the program from the tree or install the package"};
  }
  auto program = scene::parse_program(episode.fitted ? role.motion : std::string("tpose:1.2,") + role.motion);
  if (!program) return program.error();
  simworld::Performer performer;
  const ActorPlace place{subject, {role.place_m[0], role.place_m[1]}, {other.place_m[0], other.place_m[1]}};
  performer.actor = make_scripted_actor(scene::make_procedural_actor(*set, std::move(*program)), place, episode.faults);
  performer.subject = {role.name, *set, episode.fitted};
  for (std::uint32_t m = 0; m < set->markers.size(); ++m) performer.marker_of.push_back(m);
  return performer;
}

}  // namespace

Result<Stage> Stage::make(const Episode& episode) {
  const std::vector<MarkerSet> sets = settings::load_shipped_marker_sets();
  std::vector<simworld::Performer> performers;
  for (std::uint32_t i = 0; i < std::min<std::size_t>(episode.subjects, kRoles.size()); ++i) {
    auto performer = make_performer(episode, i, sets);
    if (!performer) return performer.error();
    performers.push_back(*std::move(performer));
  }
  simworld::SceneFile scene;
  scene.rate_hz = episode.rate_hz;
  scene.ring.cameras = static_cast<int>(episode.cameras);
  Rig rig = scene::ring_rig(scene.ring);
  auto events = simworld::SceneEvents::make(scene, performers, rig.size(), episode.seed, true);
  if (!events) return events.error();
  return Stage(std::make_unique<simworld::SceneWorld>(scene, std::move(rig), std::move(performers), *std::move(events),
                                                      episode.seed));
}

std::vector<Subject> Stage::subjects() const {
  std::vector<Subject> subjects;
  for (const simworld::Performer& performer : world_->performers()) subjects.push_back(performer.subject);
  return subjects;
}

}  // namespace mocap::chaos
