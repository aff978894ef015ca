#include "corpus/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "corpus/replay.h"
#include "settings/rig/rig_file.h"
#include "settings/subject/marker_set_file.h"
#include "settings/subject/subject_file.h"

namespace mocap::corpus {
namespace {

namespace fs = std::filesystem;

Result<MarkerSet> body_named(const std::string& name, const fs::path& world) {
  const fs::path subject = world / "subjects" / (name + ".toml");
  if (!fs::exists(subject)) return settings::load_marker_set(world / "markersets" / (name + ".toml"));
  auto loaded = settings::load_subject(subject);
  if (!loaded) return Error{ErrorCode::InvalidArgument, settings::to_text(loaded.error())};
  return std::move(loaded->marker_set);
}

Result<settings::DaemonSettings> settings_of(const Recording& recording, const fs::path& world) {
  settings::DaemonSettings settings;
  auto rig = settings::load_rig(world / "rig.toml");
  if (!rig) return Error{ErrorCode::InvalidArgument, settings::to_text(rig.error())};
  settings.rig = *std::move(rig);
  for (const std::string& name : recording.bodies) {
    auto body = body_named(name, world);
    if (!body) return body.error();
    settings.subject_models.push_back(
        {fmt::format("subject{}", settings.subject_models.size()), *std::move(body), true});
  }
  settings.nominal_rate_hz = recording.rate_hz;
  settings.pipeline.align.patience = recording.patience;
  return settings;
}

// Whether every input names a camera or subject of the world.
bool names_are_known(const Recording& recording, const settings::DaemonSettings& settings) {
  return std::ranges::all_of(recording.inputs, [&](const Input& input) {
    if (const auto* arrival = std::get_if<chaos::Arrival>(&input.what)) {
      return arrival->camera.value < settings.rig.size();
    }
    const Order& order = std::get<Order>(input.what);
    if (order.kind == OrderKind::Lose) return order.target < settings.rig.size();
    return order.target < settings.subject_models.size();
  });
}

}  // namespace

Result<Figures> figures_of(const Recording& recording, const fs::path& world) {
  auto settings = settings_of(recording, world);
  if (!settings) return settings.error();
  if (!names_are_known(recording, *settings)) {
    return Error{ErrorCode::InvalidArgument, "the recording names a camera or a subject that its world does not have"};
  }
  return Replay(recording, *std::move(settings)).run();
}

}  // namespace mocap::corpus
