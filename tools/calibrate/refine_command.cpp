#include "calibrate/verify_command.h"

#include <algorithm>
#include <numbers>

#include "calibrate/marker_row.h"
#include "calibrate/rig_output.h"
#include "calibration/refine_rig.h"
#include "geometry/lens.h"

namespace mocap::calibrate {
namespace {

constexpr double kSeconds = 10.0;
constexpr std::size_t kMostSights = 4000;
constexpr std::size_t kMostMarkers = 4000;
constexpr std::size_t kLeastSights = 100;

Failure refused(std::string message) { return {kExitData, std::move(message)}; }

// The one blob within `gate_px` of a place, and none nearly as near.
const Blob* only_blob(const Blobs& blobs, const Eigen::Vector2d& at, double gate_px) {
  const Blob* best = nullptr;
  double nearest = gate_px;
  double second = 1e9;
  for (const Blob& blob : blobs) {
    const double off = (blob.centroid.v - at).norm();
    if (off < nearest) {
      second = best != nullptr ? nearest : second;
      nearest = off;
      best = &blob;
    } else {
      second = std::min(second, off);
    }
  }
  if (best == nullptr || best->merged || best->touches_border) return nullptr;
  return second < 2.0 * gate_px ? nullptr : best;
}

/// What the cameras without those that drifted say of where markers were, and what one of these saw there.
std::vector<calibration::KnownSight> sights_of(const record::BlobRecording& recording, const Rig& rig,
                                               const std::vector<bool>& without, std::uint32_t camera, double gate_px) {
  std::vector<calibration::KnownSight> sights;
  std::vector<record::RecordedPicture> const& pictures = recording.pictures[camera];
  std::size_t next = 0;
  Blobs blobs;
  run_row(recording, rig, without, [&](const RowLook& look) {
    constexpr Duration kSkew = std::chrono::milliseconds(5);
    while (next < pictures.size() && pictures[next].exposed_at < look.frames.exposed_at - kSkew) ++next;
    if (next == pictures.size() || pictures[next].exposed_at > look.frames.exposed_at + kSkew) return;
    blobs.clear();
    for (const Blob& blob : pictures[next].blobs) {
      if (!blobs.try_push_back(blob)) break;
    }
    for (const Marker& marker : look.markers) {
      if (marker.cameras < 3) continue;
      const auto at = geometry::project(rig[camera], marker.position);
      if (!at || !geometry::in_image(rig[camera], *at)) continue;
      if (const Blob* blob = only_blob(blobs, at->v, gate_px))
        sights.push_back({marker.position, blob->centroid, blob->sigma_px});
    }
  });
  if (sights.size() <= kMostSights) return sights;
  std::vector<calibration::KnownSight> some;
  for (std::size_t i = 0; i < kMostSights; ++i) some.push_back(sights[i * sights.size() / kMostSights]);
  return some;
}

/// Puts cameras that drifted where the others see them stand.
std::optional<Failure> mend(const record::BlobRecording& recording, const std::vector<stages::CameraDrift>& drifts,
                            Rig& rig) {
  std::vector<bool> without;
  for (const auto& drift : drifts) without.push_back(drift.drifted);
  for (std::uint32_t c = 0; c < rig.size(); ++c) {
    if (!without[c]) continue;
    const Eigen::Vector3d before = rig[c].centre().v;
    const Eigen::Matrix3d turn_before = rig[c].camera_from_world.rotation;
    rig[c].camera_from_world = drifts[c].camera_from_world;
    for (const double gate_px : {6.0, 2.0}) {
      const auto sights = sights_of(recording, rig, without, c, gate_px);
      const auto placed = sights.size() < kLeastSights ? std::nullopt : calibration::place_camera(rig[c], sights);
      if (!placed) {
        return refused(
            fmt::format("camera '{}' was moved, and only {} views of markers that three others see tell where "
                        "to, expected {} at least; move markers where it and others look",
                        rig[c].name, sights.size(), kLeastSights));
      }
      rig[c] = placed->camera;
    }
    const Eigen::AngleAxisd turned(Eigen::Matrix3d(rig[c].camera_from_world.rotation * turn_before.transpose()));
    fmt::print("camera {}: was turned by {:.3f} degrees and moved by {:.2f} mm\n", rig[c].name,
               std::abs(turned.angle()) * 180.0 / std::numbers::pi, 1e3 * (rig[c].centre().v - before).norm());
  }
  return std::nullopt;
}

std::vector<calibration::SeenMarker> seen_markers(const record::BlobRecording& recording, const Rig& rig) {
  std::vector<calibration::SeenMarker> all;
  run_row(recording, rig, {}, [&](const RowLook& look) {
    for (const Marker& marker : look.markers) {
      if (marker.cameras < 3) continue;
      calibration::SeenMarker& seen = all.emplace_back();
      seen.point = marker.position;
      for (const BlobRef& ref : look.matches.matches[marker.match].sightings) {
        const BlobFrame& view = *look.frames.views[ref.view];
        const Blob& blob = view.blobs[ref.blob];
        if (blob.merged || blob.touches_border) continue;
        seen.sights.push_back({static_cast<int>(view.camera.value), blob.centroid, blob.sigma_px});
      }
      if (seen.sights.size() < 3) all.pop_back();
    }
  });
  if (all.size() <= kMostMarkers) return all;
  std::vector<calibration::SeenMarker> some;
  for (std::size_t i = 0; i < kMostMarkers; ++i) some.push_back(std::move(all[i * all.size() / kMostMarkers]));
  return some;
}

Result<calibration::RefinedRig, Failure> refine(const record::BlobRecording& recording, const Rig& before,
                                                const RefineOptions& options) {
  const auto drifts = drift_of(recording, before, options.verify.drift_px);
  const auto drifted = std::ranges::count_if(drifts, &stages::CameraDrift::drifted);
  if (2 * static_cast<std::size_t>(drifted) > before.size()) {
    return refused(
        fmt::format("{} of {} cameras stand otherwise than the rig says: too many to be mended from the "
                    "others; calibrate anew with mocap-calibrate wand",
                    drifted, before.size()));
  }
  Rig rig = before;
  if (auto failed = mend(recording, drifts, rig)) return *failed;
  calibration::RefineRigSettings settings;
  settings.threads = options.threads;
  const auto markers = seen_markers(recording, rig);
  auto refined = calibration::refine_rig(rig, markers, settings);
  if (!refined) {
    return refused(
        fmt::format("{} markers that three cameras or more saw, expected 50 at least; move some through the "
                    "whole volume, longer",
                    markers.size()));
  }
  const auto after = drift_of(recording, refined->rig, options.verify.drift_px);
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (after[c].drifted) {
      return refused(
          fmt::format("camera '{}' is still {:.2f} px off: no turn and move of it explains what it sees; has "
                      "its lens been touched? Calibrate anew with mocap-calibrate wand",
                      rig[c].name, after[c].off_px));
    }
  }
  return *refined;
}

}  // namespace

void add_refine_command(CLI::App& app, RefineOptions& options) {
  CLI::App* refine =
      app.add_subcommand("refine", "move any markers: mend a rig that drifted, or of which a camera was bumped");
  add_take_options(*refine, options.verify.take);
  refine->add_option("--rig", options.verify.rig, "the rig; default: the configuration's")->type_name("FILE");
  refine->add_option("--out", options.out, "the rig file to write; default: the same")->type_name("FILE");
  refine
      ->add_option("--drift-px", options.verify.drift_px,
                   "a camera that is off by more is mended from the others first")
      ->check(CLI::Range(0.05, 20.0))
      ->capture_default_str();
  refine->add_option("--seconds", options.verify.take.seconds, "of live cameras; default 10")
      ->check(CLI::Range(1.0, 3600.0));
  refine->add_flag("--dry-run", options.dry_run, "say what it would do, write nothing");
  refine->add_option("--threads", options.threads)->check(CLI::Range(1, 64))->capture_default_str();
}

int run_refine(const RefineOptions& options) {
  catch_end();
  TakeOptions take = options.verify.take;
  if (take.seconds <= 0.0) take.seconds = kSeconds;
  const auto gathered = gather_blobs(take);
  if (!gathered) {
    say("{}", gathered.error().message);
    return gathered.error().exit;
  }
  const std::filesystem::path file = options.verify.rig.empty() ? gathered->rig_file : options.verify.rig;
  const auto rig = with_lenses(*gathered, file, {});
  if (!rig) {
    say("{}", rig.error().message);
    return rig.error().exit;
  }
  const auto refined = refine(gathered->recording, *rig, options);
  if (!refined) {
    say("{}", refined.error().message);
    return refined.error().exit;
  }
  fmt::print("rig: {:.3f} px before, {:.3f} px after\n", refined->before_px, refined->after_px);
  if (options.dry_run) return kExitOk;
  return write_rig(options.out.empty() ? file : options.out, refined->rig, {{"refined_px", refined->after_px}},
                   "refine");
}

}  // namespace mocap::calibrate
