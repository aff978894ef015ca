#include "lib/offline/offline_tracks.h"

#include <algorithm>
#include <utility>

#include "assemble.h"
#include "base/expects.h"
#include "lib/offline/ages.h"
#include "lib/offline/two_way.h"
#include "mocap/v1/snapshot.pb.h"
#include "mocap/v1/take.pb.h"
#include "wire/codec/camera_blobs.h"
#include "wire/codec/decode.h"
#include "wire/codec/encode.h"

namespace mocap::offline {
namespace {

constexpr std::size_t kSetsPerProgress = 100;
// Of the description with the fitted bodies, which does not change.
constexpr std::uint32_t kDescriptionVersion = 1;

// Parts of a record, each behind its length.
void put(std::string_view part, std::string& record) {
  const auto size = static_cast<std::uint32_t>(part.size());
  record.append(reinterpret_cast<const char*>(&size), sizeof size);  // NOLINT: bytes
  record.append(part);
}

std::string_view next_part(std::string_view& record) {
  std::uint32_t size = 0;
  MOCAP_EXPECTS(record.size() >= sizeof size);
  record.copy(reinterpret_cast<char*>(&size), sizeof size);  // NOLINT: bytes
  MOCAP_EXPECTS(record.size() >= sizeof size + size);
  const std::string_view part = record.substr(sizeof size, size);
  record.remove_prefix(sizeof size + size);
  return part;
}

std::string bytes_of(const Snapshot& snapshot) {
  v1::Snapshot message;
  wire::encode(snapshot, message);
  return message.SerializeAsString();
}

Result<Snapshot> snapshot_of(std::string_view bytes) {
  v1::Snapshot message;
  MOCAP_EXPECTS(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  return wire::decode(message);
}

// The settings with fitted bodies, which are not fitted again.
settings::DaemonSettings with_bodies(settings::DaemonSettings settings, const Description& fitted) {
  settings.refine.instants = 0;
  for (std::size_t i = 0; i < settings.subject_models.size(); ++i) settings.subject_models[i] = fitted.subjects[i];
  return settings;
}

}  // namespace

Result<std::unique_ptr<OfflineTracks>> OfflineTracks::create(const settings::DaemonSettings& settings,
                                                             const std::filesystem::path& folder) {
  Result<RecordSpool> sets = RecordSpool::create(folder);
  if (!sets) return sets.error();
  Result<RecordSpool> forward = RecordSpool::create(folder);
  if (!forward) return forward.error();
  Result<RecordSpool> joined = RecordSpool::create(folder);
  if (!joined) return joined.error();
  return std::unique_ptr<OfflineTracks>(
      new OfflineTracks(settings, *std::move(sets), *std::move(forward), *std::move(joined)));  // NOLINT: private
}

OfflineTracks::OfflineTracks(const settings::DaemonSettings& settings, RecordSpool sets, RecordSpool forward,
                             RecordSpool joined)
    : settings_(std::make_unique<settings::DaemonSettings>(settings)),
      fitted_(describe(settings, {})),
      fusion_(assemble_fusion(*settings_)),
      sets_(std::move(sets)),
      forward_(std::move(forward)),
      joined_(std::move(joined)) {}

Status OfflineTracks::add(const FrameSet& set) {
  if (sets_.size() == 0) first_at_ = set.exposed_at;
  last_at_ = set.exposed_at;
  std::string record, bytes;
  put(std::to_string(set.number), record);
  put(std::to_string(set.expected_views), record);
  v1::CameraBlobs message;
  for (const BlobFrame* view : set.views) {
    wire::encode(*view, message);
    message.SerializeToString(&bytes);
    put(bytes, record);
  }
  if (const Status kept = sets_.append(record); !kept) return kept;
  const std::string snapshot_bytes = bytes_of(fusion_->step(set));
  if (const auto& fit = fusion_->fit()) {
    fitted_ = with_fit(std::move(fitted_), *fit);
    fitted_.subjects[fit->subject.value].fitted = true;
  }
  const Result<Snapshot> snapshot = snapshot_of(snapshot_bytes);
  if (!snapshot) return snapshot.error();
  record.clear();
  put(snapshot_bytes, record);
  put(encode(ages_.next(*snapshot)), record);
  return forward_.append(record);
}

Status OfflineTracks::finish(const std::function<bool(double)>& progress) {
  fusion_.reset();
  settings_ = std::make_unique<settings::DaemonSettings>(with_bodies(*settings_, fitted_));
  const auto fusion = assemble_fusion(*settings_);
  const Mirror mirror(first_at_, last_at_);
  AgeWatch ages;
  TwoWay both(settings_->subject_models);
  for (std::size_t i = size(); i-- > 0;) {
    Result<OwnedSet> owned = set(i);
    if (!owned) return owned.error();
    const OwnedSet mirrored = mirror.mirrored(*std::move(owned));
    Pass backward{fusion->step(mirrored.set()), {}};
    backward.ages = ages.next(backward.snapshot);
    Mirror::unmirror(backward.snapshot.poses);
    const Result<std::string> record = forward_.read(i);
    if (!record) return record.error();
    std::string_view parts = *record;
    Result<Snapshot> snapshot = snapshot_of(next_part(parts));
    if (!snapshot) return snapshot.error();
    std::optional<Ages> own = decode_ages(next_part(parts), *snapshot);
    MOCAP_EXPECTS(own);
    const Pass forward{*std::move(snapshot), *std::move(own)};
    Snapshot joined = both.join(forward, backward);
    joined.description_version = kDescriptionVersion;
    if (const Status kept = joined_.append(bytes_of(joined)); !kept) return kept;
    if (joined_.size() % kSetsPerProgress == 0 &&
        !progress(static_cast<double>(joined_.size()) / static_cast<double>(size()))) {
      return Error{ErrorCode::EndOfStream, "the backward pass was ended"};
    }
  }
  return {};
}

Result<Snapshot> OfflineTracks::snapshot(std::size_t index) const {
  const Result<std::string> record = joined_.read(size() - 1 - index);
  if (!record) return record.error();
  return snapshot_of(*record);
}

Result<OwnedSet> OfflineTracks::set(std::size_t index) const {
  const Result<std::string> record = sets_.read(index);
  if (!record) return record.error();
  std::string_view parts = *record;
  OwnedSet owned;
  owned.number = std::stoull(std::string(next_part(parts)));
  owned.expected_views = static_cast<std::uint32_t>(std::stoul(std::string(next_part(parts))));
  while (!parts.empty()) {
    const std::string_view bytes = next_part(parts);
    v1::CameraBlobs message;
    MOCAP_EXPECTS(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    Result<BlobFrame> image = wire::decode(message);
    if (!image) return image.error();
    owned.images.push_back(*std::move(image));
  }
  return owned;
}

}  // namespace mocap::offline
