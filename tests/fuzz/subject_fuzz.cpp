#include <cstdio>
#include <filesystem>
#include <string>

#include "base/expects.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/inputs.h"
#include "model/bounds.h"
#include "settings/subject/marker_set_file.h"
#include "settings/subject/subject_file.h"
#include "support/temporary_folder.h"

// Fuzzes the readers of marker sets, skeletons and subjects with damaged shipped files and a damaged body. Each must be
// read or refused with faults; what is read has finite numbers and parents before children, and is the same after it
// was written and read again.
//
// usage: subject_fuzz [COUNT [SEED]]

namespace mocap::settings {
namespace {

namespace fs = std::filesystem;
using fuzz::Inputs;

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed)
      : sets_(Inputs::Kind::Text, seed, fuzz::files_in("config/markersets", ".toml")),
        skeletons_(Inputs::Kind::Text, seed + 1, fuzz::files_in("config/skeletons", ".toml")),
        subjects_(Inputs::Kind::Text, seed + 2, {body()}) {
    for (const char* part : {"markersets", "skeletons"}) {
      fs::copy(support::source_folder() + "/config/" + part, folder_.path() / part);
    }
  }

  void try_once() {
    if (const auto set = load_marker_set(folder_.write("markersets/fuzz.toml", sets_.next()))) {
      ++read_;
      check(*set);
      read_again(*set);
    } else {
      MOCAP_EXPECTS(!set.error().message.empty());
    }
    if (const auto skeleton = load_skeleton(folder_.write("skeletons/fuzz.toml", skeletons_.next()))) {
      check(*skeleton);
    } else {
      MOCAP_EXPECTS(!skeleton.error().message.empty());
    }
    if (const auto subject = load_subject(folder_.write("body.toml", subjects_.next()))) {
      check(subject->marker_set);
      read_again(*subject);
    } else {
      MOCAP_EXPECTS(!subject.error().list.empty());
    }
  }

  std::uint64_t read() const { return read_; }

 private:
  static std::string body() {
    const support::TemporaryFolder folder;
    SubjectFile subject;
    subject.name = "Anna";
    subject.fitted_on = "2009-07-01T12:00:00Z";
    subject.marker_set_file = support::source_folder() + "/config/markersets/baseline41.toml";
    subject.marker_set = *load_marker_set(subject.marker_set_file);
    subject.bone_residuals_m.resize(subject.marker_set.skeleton.bones.size());
    subject.marker_residuals_m.resize(subject.marker_set.markers.size());
    MOCAP_EXPECTS(save_subject(folder.path() / "body.toml", subject).has_value());
    return fuzz::bytes_of(folder.path() / "body.toml");
  }

  static void check(const Skeleton& skeleton) {
    MOCAP_EXPECTS(!skeleton.bones.empty() && skeleton.bones.size() <= kMaxBones);
    for (std::size_t i = 0; i < skeleton.bones.size(); ++i) {
      MOCAP_EXPECTS(skeleton.bones[i].rest_offset_m.allFinite() && skeleton.bones[i].parent < static_cast<int>(i));
      MOCAP_EXPECTS((skeleton.bones[i].parent == -1) == (i == 0));
    }
  }

  static void check(const MarkerSet& set) {
    check(set.skeleton);
    MOCAP_EXPECTS(set.markers.size() <= kMaxLabels);
    for (const MarkerOnBone& marker : set.markers) {
      MOCAP_EXPECTS(marker.offset_m.allFinite());
      MOCAP_EXPECTS(marker.bone >= 0 && marker.bone < static_cast<int>(set.skeleton.bones.size()));
    }
  }

  void read_again(const MarkerSet& set) {
    const fs::path copy = folder_.path() / "markersets/copy.toml";
    const fs::path skeleton = folder_.path() / "skeletons" / (set.skeleton.name + ".toml");
    if (!fs::exists(skeleton)) return;
    MOCAP_EXPECTS(save_marker_set(copy, set, skeleton).has_value());
    const auto again = load_marker_set(copy);
    if (!again) std::fprintf(stderr, "%s\n", again.error().message.c_str());
    MOCAP_EXPECTS(again.has_value() && again->name == set.name && again->markers.size() == set.markers.size());
    for (std::size_t i = 0; i < set.markers.size(); ++i) {
      MOCAP_EXPECTS(again->markers[i].name == set.markers[i].name);
      MOCAP_EXPECTS(again->markers[i].offset_m == set.markers[i].offset_m);
    }
  }

  void read_again(const SubjectFile& subject) {
    const fs::path copy = folder_.path() / "copy.toml";
    MOCAP_EXPECTS(save_subject(copy, subject).has_value());
    const auto again = load_subject(copy);
    if (!again) std::fprintf(stderr, "%s\n", to_text(again.error()).c_str());
    MOCAP_EXPECTS(again.has_value() && again->name == subject.name && again->fitted_on == subject.fitted_on);
    MOCAP_EXPECTS(again->size == subject.size && again->residual_m == subject.residual_m);
    MOCAP_EXPECTS(again->bone_residuals_m == subject.bone_residuals_m);
  }

  support::TemporaryFolder folder_;
  Inputs sets_, skeletons_, subjects_;
  std::uint64_t read_ = 0;
};

}  // namespace
}  // namespace mocap::settings

int main(int argc, char** argv) {
  return mocap::fuzz::run_reading<mocap::settings::Fuzz>(argc, argv, "marker sets, skeletons and subjects");
}
