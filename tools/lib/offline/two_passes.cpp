#include "lib/offline/two_passes.h"

#include <string>
#include <string_view>
#include <utility>

#include "assemble.h"
#include "base/expects.h"
#include "lib/offline/mirror.h"
#include "lib/offline/snapshot_record.h"

namespace mocap::offline {
namespace {

// Of the description with the fitted bodies, which does not change.
constexpr std::uint32_t kDescriptionVersion = 1;

// The settings with fitted bodies, which are not fitted again.
settings::DaemonSettings with_bodies(settings::DaemonSettings settings, const Description& fitted) {
  settings.refine.instants = 0;
  for (std::size_t i = 0; i < settings.subject_models.size(); ++i) settings.subject_models[i] = fitted.subjects[i];
  return settings;
}

}  // namespace

Result<TwoPasses> TwoPasses::create(const settings::DaemonSettings& settings, const std::filesystem::path& folder) {
  Result<RecordSpool> forward = RecordSpool::create(folder);
  if (!forward) return forward.error();
  return TwoPasses(settings, *std::move(forward));
}

TwoPasses::TwoPasses(const settings::DaemonSettings& settings, RecordSpool forward)
    : settings_(std::make_unique<settings::DaemonSettings>(settings)),
      fitted_(describe(settings, {})),
      forward_(std::move(forward)) {}

Status TwoPasses::add(const Snapshot& snapshot, const std::optional<SubjectFit>& fit) {
  if (fit) {
    fitted_ = with_fit(std::move(fitted_), *fit);
    fitted_.subjects[fit->subject.value].fitted = true;
  }
  const std::string bytes = bytes_of(snapshot);
  const Result<Snapshot> kept = snapshot_of(bytes);
  if (!kept) return kept.error();
  std::string record;
  put(bytes, record);
  put(encode(ages_.next(*kept)), record);
  return forward_.append(record);
}

void TwoPasses::turn() {
  settings_ = std::make_unique<settings::DaemonSettings>(with_bodies(*settings_, fitted_));
  both_.emplace(settings_->subject_models);
  ages_ = AgeWatch();
  left_ = forward_.size();
}

Status TwoPasses::read_forward_pass() {
  const Result<std::string> record = forward_.read(--left_);
  if (!record) return record.error();
  std::string_view parts = *record;
  const Result<Snapshot> snapshot = snapshot_of(next_part(parts));
  if (!snapshot) return snapshot.error();
  std::optional<Ages> ages = decode_ages(next_part(parts), *snapshot);
  MOCAP_EXPECTS(ages);
  forward_pass_->snapshot = *snapshot;
  forward_pass_->ages = *std::move(ages);
  return {};
}

Result<Snapshot> TwoPasses::join(const Snapshot& backward) {
  MOCAP_EXPECTS(both_ && left_ > 0);
  backward_pass_->snapshot = backward;
  backward_pass_->ages = ages_.next(backward);
  Mirror::unmirror(backward_pass_->snapshot.poses);
  if (const Status read = read_forward_pass(); !read) return read.error();
  Result<Snapshot> joined = both_->join(*forward_pass_, *backward_pass_);
  joined->description_version = kDescriptionVersion;
  return joined;
}

}  // namespace mocap::offline
