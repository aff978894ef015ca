#include "lib/offline/offline_tracks.h"

#include <utility>

#include "assemble.h"
#include "base/expects.h"
#include "lib/offline/snapshot_record.h"
#include "mocap/v1/take.pb.h"
#include "wire/codec/camera_blobs.h"

namespace mocap::offline {
namespace {

constexpr std::size_t kSetsPerProgress = 100;

}  // namespace

Result<std::unique_ptr<OfflineTracks>> OfflineTracks::create(const settings::DaemonSettings& settings,
                                                             const std::filesystem::path& folder) {
  Result<RecordSpool> sets = RecordSpool::create(folder);
  if (!sets) return sets.error();
  Result<TwoPasses> passes = TwoPasses::create(settings, folder);
  if (!passes) return passes.error();
  Result<RecordSpool> joined = RecordSpool::create(folder);
  if (!joined) return joined.error();
  return std::unique_ptr<OfflineTracks>(
      new OfflineTracks(*std::move(sets), *std::move(passes), *std::move(joined)));  // NOLINT: private
}

OfflineTracks::OfflineTracks(RecordSpool sets, TwoPasses passes, RecordSpool joined)
    : passes_(std::move(passes)),
      fusion_(assemble_fusion(passes_.settings())),
      sets_(std::move(sets)),
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
  const Snapshot& snapshot = fusion_->step(set);
  return passes_.add(snapshot, fusion_->fit());
}

Status OfflineTracks::finish(const std::function<bool(double)>& progress) {
  fusion_.reset();
  passes_.turn();
  const auto fusion = assemble_fusion(passes_.settings());
  const Mirror mirror(first_at_, last_at_);
  for (std::size_t i = size(); i-- > 0;) {
    Result<OwnedSet> owned = set(i);
    if (!owned) return owned.error();
    const OwnedSet mirrored = mirror.mirrored(*std::move(owned));
    const Result<Snapshot> joined = passes_.join(fusion->step(mirrored.set()));
    if (!joined) return joined.error();
    if (const Status kept = joined_.append(bytes_of(*joined)); !kept) return kept;
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
