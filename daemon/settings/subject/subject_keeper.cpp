#include "settings/subject/subject_keeper.h"

#include <ctime>

#include <chrono>
#include <utility>

#include "base/expects.h"
#include "base/time.h"

namespace mocap::settings {
namespace {

class SubjectKeeper final : public Writer {
 public:
  explicit SubjectKeeper(std::vector<KeptSubject> kept) : kept_(std::move(kept)) {}

  bool wants_snapshots() const override { return false; }
  Status write(const Snapshot& /*snapshot*/) override { return {}; }
  Status finish() override { return {}; }

  Status learn(const SubjectFit& fit) override {
    for (KeptSubject& kept : kept_) {
      if (kept.subject != fit.subject) continue;
      auto& bones = kept.known.marker_set.skeleton.bones;
      auto& markers = kept.known.marker_set.markers;
      MOCAP_EXPECTS(bones.size() == fit.rest_offsets_m.size() && markers.size() == fit.marker_offsets_m.size());
      for (std::size_t b = 0; b < bones.size(); ++b) bones[b].rest_offset_m = fit.rest_offsets_m[b];
      for (std::size_t m = 0; m < markers.size(); ++m) markers[m].offset_m = fit.marker_offsets_m[m];
      kept.known.residual_m = fit.residual_m;
      kept.known.bone_residuals_m.clear();
      kept.known.marker_residuals_m.clear();
      kept.known.fitted_on = utc_text(host_now() + utc_minus_host());
      std::error_code ignored;  // save_subject reports a missing folder
      std::filesystem::create_directories(kept.path.parent_path(), ignored);
      return save_subject(kept.path, kept.known);
    }
    return {};
  }

 private:
  static std::string utc_text(Timestamp at) {
    const std::time_t seconds = static_cast<std::time_t>(to_ns(at) / 1'000'000'000);
    std::tm utc{};
    ::gmtime_r(&seconds, &utc);
    char text[32];
    return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
  }

  std::vector<KeptSubject> kept_;
};

}  // namespace

std::unique_ptr<Writer> make_subject_keeper(std::vector<KeptSubject> kept) {
  return std::make_unique<SubjectKeeper>(std::move(kept));
}

}  // namespace mocap::settings
