#include "reload.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "assemble.h"
#include "assemble_camera.h"
#include "base/log.h"
#include "settings/rig/kept_rigs.h"
#include "settings/rig/rig_masks.h"
#include "settings/subject/add_subject.h"
#include "timecode/timecode_sources.h"
#include "wire/curve_keys.h"

namespace mocap {
namespace {

// Constructs each camera without opening it, and returns the faults that only the driver detects.
settings::Faults driver_faults(const settings::DaemonSettings& settings, const std::filesystem::path& config) {
  settings::Faults faults{config, {}};
  SharedByCameras shared;
  for (std::uint32_t i = 0; i < settings.cameras.size(); ++i) {
    const Result<runtime::CameraParts> made = assemble_camera(settings, CameraId{i}, shared);
    if (!made) faults.list.push_back({config, 0, 0, made.error().message});
  }
  return faults;
}

// Returns the faults of the server's key and of the list of clients' keys. A key that the service manager provides is
// not there when the file is checked by hand.
settings::Faults key_faults(const wire::CurveSettings& curve, const std::filesystem::path& config) {
  settings::Faults faults{config, {}};
  if (!curve.on()) return faults;
  if (!settings::is_unresolved_credential(curve.server_key)) {
    if (const auto own = wire::load_key_pair(curve.server_key); !own) {
      faults.list.push_back({config, 0, 0, "security: server_key: " + own.error().message});
    }
  }
  if (!settings::is_unresolved_credential(curve.allowed)) {
    if (const auto allowed = wire::load_allowed_keys(curve.allowed); !allowed) {
      faults.list.push_back({config, 0, 0, "security: allowed_keys: " + allowed.error().message});
    }
  }
  return faults;
}

// Returns the fault of a source of timecode that cannot work.
settings::Faults timecode_faults(const settings::DaemonSettings& settings, const std::filesystem::path& config) {
  settings::Faults faults{config, {}};
  if (const Status good = timecode::check(settings.timecode); !good) {
    faults.list.push_back({config, 0, 0, "timecode: wav: " + good.error().message});
  }
  return faults;
}

// Saves masks: to the state folder if there is one, otherwise to the rig file. `rig`: the cameras whose masks change.
// Returns a message about cameras whose masks have no place in the rig file; empty: none.
Result<std::string> save_masks(const Configuration& now, const Rig& rig, const settings::MaskKind& kind,
                               const std::filesystem::path& state_file) {
  if (now.state.exist()) {
    const Status written = settings::write_masks(state_file, rig, kind);
    return written ? Result<std::string>(std::string()) : written.error();
  }
  const std::filesystem::path& file = now.settings->capture.rig_file;
  const auto without_place = settings::save_masks(file, rig, kind);
  if (!without_place) return without_place.error();
  return without_place->empty() ? std::string() : settings::no_place_for_masks(file, *without_place);
}

// Returns the message of save_masks.
Result<std::string> save_learnt_masks(const Configuration& now, const std::vector<std::vector<MaskPolygon>>& masks) {
  Rig rig = now.settings->rig;
  for (std::size_t i = 0; i < rig.size(); ++i) rig[i].learnt_masks = masks[i];
  return save_masks(now, rig, settings::kLearntMasks, now.state.learnt_masks);
}

Status save_drawn_masks(const Configuration& now, const runtime::DrawnMasks& drawn) {
  CameraModel camera = now.settings->rig[drawn.camera.value];
  if (delivers_blobs(now.settings->cameras[drawn.camera.value])) {
    return Error{
        ErrorCode::Unsupported,
        fmt::format("camera '{}' delivers blobs without pixels; draw its masks on its node (mocapctl --endpoint "
                    "NODE mask draw)",
                    camera.name)};
  }
  camera.masks = drawn.polygons;
  const auto unsaved = save_masks(now, {camera}, settings::kDrawnMasks, now.state.drawn_masks);
  if (!unsaved) return unsaved.error();
  return unsaved->empty() ? Status() : Error{ErrorCode::InvalidArgument, *unsaved};
}

// Adds a subject: to the file in the state folder if there is one, otherwise to the configuration.
Status save_subject(const Configuration& now, const settings::NewSubject& subject) {
  const auto faults_of = [](const auto& loaded) { return loaded ? settings::Faults{} : loaded.error(); };
  if (!now.state.exist()) {
    return settings::add_subject(now.file, subject,
                                 [&](const auto& tried) { return faults_of(load_checked(tried, now.state)); });
  }
  return settings::add_subject_to_state(now.state.added_subjects, subject, [&](const auto& tried) {
    settings::StateFiles state = now.state;
    state.added_subjects = tried;
    return faults_of(load_checked(now.file, state));
  });
}

// The same with the content of the marker set, which is kept in a new file. Without the subject there is no file.
Status save_subject_with_text(const Configuration& now, const std::string& name, const std::string& text) {
  const Result<std::filesystem::path> file = settings::write_marker_set_text(
      (now.state.exist() ? now.state.folder : now.file.parent_path()) / "marker_sets", name, text);
  if (!file) return file.error();
  Status saved = save_subject(now, {name, *file});
  std::error_code ignored;
  if (!saved) std::filesystem::remove(*file, ignored);
  return saved;
}

// Writes a calibrated rig, with the masks in force, or an earlier one.
Status write_ordered_rig(const settings::RigPlaces& places, const Configuration& now, const runtime::MainOrder& order) {
  if (!order.restore.empty()) return settings::restore_rig(places, order.restore);
  CalibratedRig rig = *order.rig;
  for (CameraModel& camera : rig.rig) {
    const auto same = std::ranges::find(now.settings->rig, camera.name, &CameraModel::name);
    if (same == now.settings->rig.end()) continue;
    camera.masks = same->masks;
    camera.learnt_masks = same->learnt_masks;
  }
  return settings::write_rig(places, rig);
}

// Writes a rig; if the configuration has faults with it, the rig file is as before.
Status save_rig(const Configuration& now, const runtime::MainOrder& order) {
  const auto places = settings::rig_places(*now.settings);
  if (!places) return places.error();
  const Result<std::optional<std::string>> before = settings::written_rig(*places);
  if (!before) return before.error();
  if (Status written = write_ordered_rig(*places, now, order); !written) return written;
  const auto read = load_checked(now.file, now.state);
  if (read) return {};
  if (Status undone = settings::undo_rig(*places, *before); !undone) return undone;
  return Error{ErrorCode::InvalidArgument, settings::to_text(read.error())};
}

void list_rigs(const Configuration& now, runtime::MainDone& answer) {
  const auto places = settings::rig_places(*now.settings);
  answer.done = places.has_value();
  if (!places) {
    answer.message = places.error().message;
  } else {
    answer.rigs = settings::list_rigs(*places);
  }
}

}  // namespace

Result<settings::DaemonSettings, settings::Faults> load_checked(const std::filesystem::path& config,
                                                                const settings::StateFiles& state) {
  Result<settings::DaemonSettings, settings::Faults> settings = settings::load_daemon_settings(config, state);
  if (!settings) return settings;
  settings::Faults faults = driver_faults(*settings, config);
  for (const settings::Faults& more :
       {key_faults(settings->publish.curve, config), timecode_faults(*settings, config)}) {
    faults.list.insert(faults.list.end(), more.list.begin(), more.list.end());
  }
  if (!faults.list.empty()) return faults;
  if (const wire::CurveSettings& curve = settings->publish.curve; curve.on()) {
    if (const auto key = wire::load_key_pair(curve.server_key)) settings->server_public_key = key->public_key;
  }
  return settings;
}

std::unique_ptr<settings::DaemonSettings> reload(const Configuration& now, const runtime::MainOrder& order,
                                                 runtime::MainDone& answer) {
  answer.order = order.number;
  if (order.list_rigs) {
    list_rigs(now, answer);
    return nullptr;
  }
  Status saved;
  std::string unsaved;
  if (!order.masks.empty()) {
    const auto learnt = save_learnt_masks(now, order.masks);
    saved = learnt ? Status() : learnt.error();
    if (learnt && !learnt->empty()) unsaved = *learnt + "; the learnt masks of all other cameras are saved\n";
  }
  if (saved && order.drawn) saved = save_drawn_masks(now, *order.drawn);
  if (saved && !order.marker_set_text.empty()) {
    saved = save_subject_with_text(now, order.subject, order.marker_set_text);
  } else if (saved && !order.subject.empty()) {
    saved = save_subject(now, {order.subject, order.marker_set});
  }
  if (saved && (order.rig || !order.restore.empty())) saved = save_rig(now, order);
  if (!saved) {
    answer.message = saved.error().message;
    return nullptr;
  }
  Result<settings::DaemonSettings, settings::Faults> read = load_checked(now.file, now.state);
  if (!read) {
    answer.message = settings::to_text(read.error());
    return nullptr;
  }
  if (const Status free = check_ports(*now.settings, *read); !free) {
    answer.message = now.file.string() + ": " + free.error().message;
    return nullptr;
  }
  answer.done = unsaved.empty();
  answer.message = unsaved + now.file.string() + " is in force; unchanged subjects, cameras and recordings continue";
  return std::make_unique<settings::DaemonSettings>(*std::move(read));
}

void log_reload(const runtime::MainDone& answer) {
  std::istringstream lines(answer.message);
  for (std::string line; std::getline(lines, line);) {
    answer.done ? log_info("reload", line) : log_error("reload", line);
  }
  if (!answer.done) log_error("reload", "the daemon keeps the settings that it had; correct the file and reload");
}

}  // namespace mocap
