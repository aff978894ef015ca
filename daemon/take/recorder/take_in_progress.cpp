#include "take/recorder/take_in_progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "take/take_belief.h"
#include "take/take_reader.h"
#include "wire/codec/encode_numbers.h"

namespace mocap::take {

TakeInProgress::TakeInProgress(std::unique_ptr<TakeWriter> file, TakeInfo begun, const Description& description,
                               bool snapshots)
    : writer(std::move(file)), info(std::move(begun)), snapshots_(snapshots) {
  meter.describe(description);
  for (const CameraModel& camera : description.cameras) blob_topics_.push_back(std::string(kBlobsTopics) + camera.name);
}

Status TakeInProgress::write(const BufferedMessage& message) {
  const bool is_early = message.at < from;
  if (is_early) lead_in_.add(message);
  if (message.kind == BufferedKind::Blobs) return write_image(message);
  if (!is_early && (!to || message.at <= *to)) return append(message);
  if (message.kind != BufferedKind::Snapshot) return {};
  if (is_early) {
    edges_.forget(message.at);  // the images of a later set were exposed after the mean of this one
  } else {
    drained = true;
  }
  return {};
}

Status TakeInProgress::write_image(const BufferedMessage& image) {
  const bool is_early = image.at < from, is_late = to && image.at > *to;
  if (image.at < from - kLongestSet || (is_late && image.at > *to + kLongestSet)) return {};
  if ((is_early || is_late) && !edges_.add(image)) return {};
  return append_image(image.camera, image.at, image.bytes);
}

Status TakeInProgress::append_image(std::uint32_t camera, Timestamp at, std::string_view bytes) {
  return camera < blob_topics_.size() ? writer->append(blob_topics_[camera], at, bytes) : Status{};
}

Status TakeInProgress::append(const BufferedMessage& message) {
  switch (message.kind) {
    case BufferedKind::Blobs: return append_image(message.camera, message.at, message.bytes);
    case BufferedKind::Snapshot: return append_snapshot(message);
    case BufferedKind::Description: {
      const Result<Description> description = description_of({TakeTopic::Description, message.at, message.bytes});
      if (description) meter.describe(*description);
      return writer->append(kDescriptionTopic, message.at, message.bytes);
    }
    case BufferedKind::Health: return writer->append(kHealthTopic, message.at, message.bytes);
    case BufferedKind::Event: return writer->append(kEventTopic, message.at, message.bytes);
    case BufferedKind::Belief:
    case BufferedKind::Break: break;
  }
  return {};
}

Status TakeInProgress::append_snapshot(const BufferedMessage& message) {
  if (!read_.ParseFromArray(message.bytes.data(), static_cast<int>(message.bytes.size()))) return {};
  for (const EdgeImages::Image& image : edges_.take(read_)) {
    if (const Status written = append_image(image.camera, image.at, image.bytes); !written) return written;
  }
  meter.add(read_);
  if (read_.has_timecode()) {
    last_timecode_ = wire::timecode_of(read_.timecode());
    if (!first_timecode_) first_timecode_ = last_timecode_;
  }
  if (!snapshots_) return {};
  read_.set_utc_minus_host_ns(info.utc_minus_host.count());
  read_.SerializeToString(&written_);
  return writer->append(kSnapshotTopic, message.at, written_);
}

Status TakeInProgress::finish(Timestamp now, const QualityReport& report, const std::string& ended_early) {
  if (first_timecode_) {
    info.start_timecode = text_of(*first_timecode_);
    info.end_timecode = text_of(*last_timecode_);
    info.others["timecode_rate"] = fmt::format("{:.6g}", rate_hz(*first_timecode_));
  }
  info.ended_at = to ? std::min(*to, now) : now;
  add_quality(info, report, ended_early);
  // At the end, because it is as large as a second of the take or more, and not for a disk that is full or slow.
  if (auto belief = lead_in_.finish(info.producer); belief && ended_early.empty()) {
    // If this fails, `finish` returns the same error.
    static_cast<void>(writer->attach({kBeliefFile, kBeliefMediaType, *std::move(belief)}));
  }
  return writer->finish(info);
}

std::string TakeInProgress::words(const QualityReport& report, const std::string& fault) const {
  constexpr double kMB = 1e6;
  std::string words = fmt::format("'{}' ended, {:.2f} s, {:.1f} MB, {}", writer->path(), report.seconds,
                                  static_cast<double>(writer->size().bytes) / kMB, name_of(report.quality));
  if (!report.reasons.empty()) words += fmt::format(": {}", fmt::join(report.reasons, "; "));
  return fault.empty() ? words : fmt::format("{}; it ended early: {}", words, fault);
}

}  // namespace mocap::take
