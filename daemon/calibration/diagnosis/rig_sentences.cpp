#include <fmt/format.h>

#include <numbers>

#include "calibration/diagnosis/diagnose_rig.h"

namespace mocap::calibration {
namespace {

std::string shares_of(const RigFinding& finding) {
  return fmt::format("{:.0f} % of the markers of the other cameras, instead of {:.0f} %", 100.0 * finding.share_after,
                     100.0 * finding.share_before);
}

std::string exchange_sentence(const RigFinding& finding, const Rig& rig) {
  std::string text = fmt::format("{} and {} fit if exchanged", rig[finding.camera].name, rig[finding.other].name);
  for (const auto& [a, b] : finding.alternatives)
    text += fmt::format(", or {} and {}, which the symmetry of the rig does not distinguish", rig[a].name, rig[b].name);
  return text +
         fmt::format(" (they see {}): exchange their names in the configuration, or their cables", shares_of(finding));
}

std::string image_sentence(const char* how, const char* remedy, const RigFinding& finding, const Rig& rig) {
  return fmt::format("{} fits if its image is {} (it sees {}): {}", rig[finding.camera].name, how, shares_of(finding),
                     remedy);
}

std::string time_sentence(const char* how, const RigFinding& finding, const Rig& rig) {
  return fmt::format(
      "{} is one frame {} (with the other image it sees {}): trigger all cameras by one signal, and compare their "
      "exposure and transfer settings",
      rig[finding.camera].name, how, shares_of(finding));
}

std::string pose_sentence(const RigFinding& finding, const Rig& rig) {
  return fmt::format(
      "{} fits if turned by {:.1f} degrees and moved by {:.0f} mm (it sees {}): turn it back, or calibrate again with "
      "mocap-calibrate wand",
      rig[finding.camera].name, finding.turned_rad * 180.0 / std::numbers::pi, 1e3 * finding.moved_m,
      shares_of(finding));
}

std::string lens_sentence(const RigFinding& finding, const Rig& rig) {
  const double before_px = rig[finding.camera].lens.fx_px;
  return fmt::format(
      "{} has another lens than the rig says: it fits with a focal length of about {:.0f} px instead of {:.0f} px (it "
      "sees {}): mount the lens of the calibration, or calibrate again with mocap-calibrate lens and wand",
      rig[finding.camera].name, finding.focal_ratio * before_px, before_px, shares_of(finding));
}

}  // namespace

std::string sentence_of(const RigFinding& finding, const Rig& rig) {
  constexpr const char* kUnflip = "switch the flip off in the camera (ReverseX, ReverseY), or calibrate again with it";
  switch (finding.fault) {
    case RigFault::Exchanged: return exchange_sentence(finding, rig);
    case RigFault::UpsideDown:
      return image_sentence("turned by 180 degrees",
                            "mount it as during the calibration, or compare ReverseX and ReverseY with those of the "
                            "calibration",
                            finding, rig);
    case RigFault::MirroredSides: return image_sentence("mirrored left to right", kUnflip, finding, rig);
    case RigFault::MirroredHeights: return image_sentence("mirrored top to bottom", kUnflip, finding, rig);
    case RigFault::OneFrameLate: return time_sentence("late", finding, rig);
    case RigFault::OneFrameEarly: return time_sentence("early", finding, rig);
    case RigFault::OtherPose: return pose_sentence(finding, rig);
    case RigFault::OtherLens: return lens_sentence(finding, rig);
    case RigFault::Unexplained:
      return fmt::format(
          "{} contributes nothing: it sees {:.0f} % of the markers of the other cameras, and no exchange, flip, delay, "
          "rotation or focal length explains its blobs: calibrate again with mocap-calibrate wand",
          rig[finding.camera].name, 100.0 * finding.share_before);
    case RigFault::OtherRig:
      return "the cameras do not fit this rig: no marker is where the rig says in most cameras; is it the rig of "
             "another room or an older calibration? Choose the right file, or calibrate again with mocap-calibrate "
             "wand";
  }
  return {};
}

}  // namespace mocap::calibration
