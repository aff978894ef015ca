#include <cmath>
#include <filesystem>
#include <string>

#include "base/expects.h"
#include "calibration/formats/rig_format.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/inputs.h"
#include "settings/rig/rig_file.h"
#include "settings/rig/rig_lenses.h"
#include "settings/rig/rig_masks.h"
#include "support/temporary_folder.h"

// Fuzzes the readers of rigs: our own files, and those of OpenCV, Kalibr and Qualisys. Each must be read or refused
// with faults. The cameras of a rig that is read are finite and plausible, and can be written and read again. Also
// edits damaged rig files in place.
//
// usage: rig_fuzz [COUNT [SEED]]

namespace mocap::settings {
namespace {

namespace fs = std::filesystem;
using calibration::RigFormat;
using fuzz::Inputs;

std::vector<std::string> own_rigs() {
  std::vector<std::string> rigs;
  for (const char* name : {"demo.rig.toml", "two_cameras.rig.toml", "rig.example.toml"}) {
    rigs.push_back(fuzz::bytes_of(support::source_folder() + "/config/" + name));
  }
  return rigs;
}

void check(const CameraModel& camera) {
  const Lens& lens = camera.lens;
  MOCAP_EXPECTS(!camera.name.empty());
  MOCAP_EXPECTS(std::isfinite(lens.fx_px) && std::isfinite(lens.fy_px) && lens.fx_px > 0.0 && lens.fy_px > 0.0);
  MOCAP_EXPECTS(std::isfinite(lens.cx_px) && std::isfinite(lens.cy_px) && lens.distortion.allFinite());
  const auto& pose = camera.camera_from_world;
  MOCAP_EXPECTS(pose.translation.allFinite());
  MOCAP_EXPECTS((pose.rotation * pose.rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3);
}

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed)
      : own_(Inputs::Kind::Text, seed, own_rigs()),
        foreign_(Inputs::Kind::Text, seed + 1, fuzz::files_in("tests/fuzz/seeds/rig_formats")) {}

  void try_once() {
    read_own(folder_.write("rig.toml", own_.next()));
    read_foreign(foreign_.next());
  }

  std::uint64_t read() const { return read_; }

 private:
  void read_own(const fs::path& path) {
    const auto rig = load_rig(path);
    if (const auto loose = load_foreign_rig(path)) {
      for (const CameraModel& camera : loose->rig) check(camera);
    } else {
      MOCAP_EXPECTS(!rig && !loose.error().list.empty());
    }
    if (!rig) {
      MOCAP_EXPECTS(!rig.error().list.empty() && !to_text(rig.error()).empty());
      return;
    }
    ++read_;
    for (const CameraModel& camera : *rig) check(camera);
    read_again(*rig);
    edit(path, *rig);
  }

  void read_again(const Rig& rig) {
    const fs::path copy = folder_.path() / "copy.toml";
    MOCAP_EXPECTS(save_rig(copy, rig, {}).has_value());
    const auto again = load_rig(copy);
    MOCAP_EXPECTS(again.has_value() && again->size() == rig.size());
    for (std::size_t i = 0; i < rig.size(); ++i) {
      MOCAP_EXPECTS((*again)[i].name == rig[i].name && (*again)[i].lens.fx_px == rig[i].lens.fx_px);
    }
  }

  // An edit is refused, or gives a file that is read as before.
  void edit(const fs::path& path, Rig rig) {
    for (CameraModel& camera : rig) {
      camera.learnt_masks = {{{{1.0, 1.0}}, {{9.0, 1.0}}, {{9.0, 9.0}}}};
      camera.lens.fx_px += 1.0;
    }
    if (const auto unsaved = save_masks(path, rig, kLearntMasks); unsaved && unsaved->empty()) {
      const auto masked = load_rig(path);
      MOCAP_EXPECTS(masked.has_value() && masked->size() == rig.size());
      for (const CameraModel& camera : *masked) MOCAP_EXPECTS(camera.learnt_masks.size() == 1);
    }
    if (save_lenses(path, rig)) {
      const auto focused = load_rig(path);
      MOCAP_EXPECTS(focused.has_value() && focused->size() == rig.size());
    }
  }

  void read_foreign(const std::string& text) {
    const auto format = calibration::guess_format(text);
    if (!format || *format == RigFormat::Pose2Sim) return;
    const auto parsed = calibration::parse_rig(*format, text, "camera");
    if (!parsed) {
      MOCAP_EXPECTS(!parsed.error().empty());
      return;
    }
    ++read_;
    for (const CameraModel& camera : parsed->rig) check(camera);
    for (const RigFormat to : {RigFormat::OpenCv, RigFormat::Kalibr}) {
      const auto written = calibration::rig_text(parsed->rig, to);
      if (written) static_cast<void>(calibration::parse_rig(to, written->text, "camera"));
    }
  }

  support::TemporaryFolder folder_;
  Inputs own_, foreign_;
  std::uint64_t read_ = 0;
};

}  // namespace
}  // namespace mocap::settings

int main(int argc, char** argv) { return mocap::fuzz::run_reading<mocap::settings::Fuzz>(argc, argv, "rigs"); }
