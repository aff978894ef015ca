#include "lib/retrack/new_take.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "wire/codec/encode.h"

namespace mocap::retrack {
namespace {

constexpr const char* kOrigin = "retracked_from";
take::TakeInfo info_of(const take::TakeReader& from, const std::filesystem::path& path, const Span& span,
                       const std::string& producer) {
  take::TakeInfo info = from.info();
  take::remove_quality(info);
  info.others.erase(kMadeOf);
  info.name = path.stem().string();
  info.producer = producer;
  info.repaired = false;
  info.others[kOrigin] = std::filesystem::path(from.mcap().path()).filename().string();
  info.started_at = std::max(info.started_at.value_or(from.first_at()), span.from);
  info.ended_at = std::min(info.ended_at.value_or(from.last_at()), span.to);
  if (span.from > from.info().started_at.value_or(from.first_at())) info.start_timecode.clear();
  if (span.to < from.last_at()) info.end_timecode.clear();
  return info;
}

// The fields that do not follow from the blobs: when the daemon was ready with the set, and what other clocks said.
void take_over_stamps(const v1::Snapshot& recorded, v1::Snapshot& into) {
  v1::Instants& instants = *into.mutable_instants();
  instants.clear_fused_at_ns();
  instants.clear_sent_at_ns();
  if (recorded.instants().has_fused_at_ns()) instants.set_fused_at_ns(recorded.instants().fused_at_ns());
  if (recorded.instants().has_sent_at_ns()) instants.set_sent_at_ns(recorded.instants().sent_at_ns());
  if (recorded.has_synchronisation()) into.set_synchronisation(recorded.synchronisation());
  if (recorded.has_timecode()) *into.mutable_timecode() = recorded.timecode();
  if (recorded.has_delivering_cameras()) into.set_delivering_cameras(recorded.delivering_cameras());
}

}  // namespace

NewTake::NewTake(PartTake file, take::TakeInfo info, const Span& span, Description description)
    : file_(std::move(file)), info_(std::move(info)), span_(span), description_(std::move(description)) {
  meter_.describe(description_);
}

Result<NewTake> NewTake::create(const std::filesystem::path& path, const take::TakeReader& from, const Span& span,
                                NewTakeStart content) {
  take::TakeStart start;
  start.info = info_of(from, path, span, content.description.producer);
  if (!content.made_of.empty()) start.info.others[kMadeOf] = std::move(content.made_of);
  start.description = content.description;
  start.files = std::move(content.files);
  Result<PartTake> file = PartTake::create(path, start);
  if (!file) return file.error();
  return NewTake(*std::move(file), start.info, span, std::move(content.description));
}

Status NewTake::learn(const SubjectFit& fit, Timestamp at) {
  description_ = with_fit(std::move(description_), fit);
  meter_.describe(description_);
  described_ = at >= span_.from;
  return described_ ? file_.writer().append(description_, at) : Status{};
}

Result<bool> NewTake::append(const Snapshot& snapshot, const TakeSet& set) {
  const std::optional<RecordedSnapshot>& recorded = set.recorded;
  const Timestamp at = snapshot.instants.exposed_at;
  wire::encode(snapshot, message_);
  message_.set_utc_minus_host_ns(info_.utc_minus_host.count());
  if (recorded) take_over_stamps(recorded->message, message_);
  message_.SerializeToString(&bytes_);
  const bool same = recorded && recorded->bytes == bytes_;
  if (!span_.has(at)) return same;
  for (const BlobFrame* view : set.frames.views) {
    if (span_.has(view->exposed_at)) continue;
    if (const Status appended = file_.writer().append(*view); !appended) return appended.error();
  }
  if (!std::exchange(described_, true)) {
    if (const Status described = file_.writer().append(description_, at); !described) return described.error();
  }
  meter_.add(message_);
  if (const Status appended = file_.writer().append(take::kSnapshotTopic, at, bytes_); !appended)
    return appended.error();
  return same;
}

Status NewTake::append(const BlobFrame& frame) {
  return span_.has(frame.exposed_at) ? file_.writer().append(frame) : Status{};
}

Status NewTake::append(std::string_view topic, const take::TakeRecord& record) {
  return span_.has(record.at) ? file_.writer().append(topic, record.at, record.bytes) : Status{};
}

Result<std::string> NewTake::finish() {
  take::add_quality(info_, meter_.report(), {});
  return file_.finish(info_);
}

}  // namespace mocap::retrack
