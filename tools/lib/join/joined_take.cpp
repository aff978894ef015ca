#include "lib/join/joined_take.h"

#include <algorithm>

#include "lib/retrack/new_take.h"
#include "take/take_belief.h"

namespace mocap::join {
namespace {

using take::TakeRecord;
using take::TakeTopic;

take::TakeInfo info_of(const std::filesystem::path& path, const ChunkTakes& takes) {
  take::TakeInfo info = takes.chunks.front().reader.info();
  const take::TakeInfo& last = takes.chunks.back().reader.info();
  take::remove_quality(info);
  info.others[retrack::kMadeOf] = takes.made_of;
  info.name = path.stem().string();
  info.ended_at = last.ended_at;
  info.end_timecode = last.end_timecode;
  return info;
}

Result<std::vector<TakeFile>> files_of(const take::TakeReader& take) {
  std::vector<TakeFile> files;
  for (const std::string& name : take.files()) {
    Result<std::string> bytes = take.file(name);
    if (!bytes) return bytes.error();
    TakeFile& file = files.emplace_back(TakeFile{.name = name, .bytes = *std::move(bytes)});
    if (name == take::kBeliefFile) file.media_type = take::kBeliefMediaType;
  }
  return files;
}

// The part whose images are those of a chunk: from the end of the chunk before it to its own end.
take::TakeSelection others_of(const ChunkTakes& takes, std::size_t chunk) {
  take::TakeSelection selection{.topics = {TakeTopic::Blobs, TakeTopic::Health, TakeTopic::Event}};
  if (chunk > 0) selection.from = takes.chunks[chunk - 1].part.to + Duration(1);
  if (chunk + 1 < takes.chunks.size()) selection.to = takes.chunks[chunk].part.to + Duration(1);
  return selection;
}

}  // namespace

Result<JoinedTake> JoinedTake::create(const std::filesystem::path& path, const ChunkTakes& takes) {
  Result<std::vector<TakeFile>> files = files_of(takes.chunks.front().reader);
  if (!files) return files.error();
  Result<Description> description = takes.chunks.front().reader.description();
  if (!description) return description.error();
  take::TakeStart start;
  start.info = info_of(path, takes);
  start.description = *std::move(description);
  start.files = *std::move(files);
  Result<retrack::PartTake> file = retrack::PartTake::create(path, start);
  if (!file) return file.error();
  return JoinedTake(*std::move(file), start, takes);
}

JoinedTake::JoinedTake(retrack::PartTake file, const take::TakeStart& start, const ChunkTakes& takes)
    : file_(std::move(file)),
      info_(start.info),
      takes_(takes),
      described_(std::in_place, 0, start.description.version),
      version_(start.description.version),
      cameras_(start.description.cameras.size()) {
  meter_.describe(start.description);
  open_others();
}

void JoinedTake::open_others() {
  others_.reset();
  if (chunk_ < takes_.chunks.size()) {
    others_.emplace(takes_.chunks[chunk_].reader.messages(others_of(takes_, chunk_)));
  }
}

Status JoinedTake::append_others(Timestamp up_to) {
  while (others_) {
    if (!waiting_) {
      const auto record = others_->next();
      if (!record) return record.error();
      if (!*record) {
        ++chunk_;
        open_others();
        continue;
      }
      waiting_ = **record;
    }
    if (waiting_->at > up_to) return {};
    if (const Status appended = append_other(*waiting_); !appended) return appended;
    waiting_.reset();
  }
  return {};
}

Status JoinedTake::append_other(const TakeRecord& record) {
  if (record.topic == TakeTopic::Health) return file_.writer().append(take::kHealthTopic, record.at, record.bytes);
  if (record.topic == TakeTopic::Event) return file_.writer().append(take::kEventTopic, record.at, record.bytes);
  const Result<BlobFrame> image = take::blobs_of(record);
  const std::string& path = takes_.chunks[chunk_].reader.mcap().path();
  if (!image) return Error{image.error().code, fmt::format("'{}': {}", path, image.error().message)};
  if (image->camera.value >= cameras_) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("'{}': has an image of a camera that it does not describe; track this chunk again", path)};
  }
  return file_.writer().append(*image);
}

Status JoinedTake::describe(const Description& description, std::size_t chunk, Timestamp at) {
  if (described_ == std::pair(chunk, description.version)) return {};
  described_.emplace(chunk, description.version);
  Description next = description;
  next.version = ++version_;
  meter_.describe(next);
  return file_.writer().append(next, at);
}

Status JoinedTake::append(v1::Snapshot snapshot, std::size_t chunk, const Description& description) {
  const Timestamp at = from_ns(snapshot.instants().exposed_at_ns());
  if (const Status appended = append_others(at); !appended) return appended;
  if (const Status described = describe(description, chunk, at); !described) return described;
  snapshot.set_description_version(version_);
  meter_.add(snapshot);
  return file_.writer().append(take::kSnapshotTopic, at, snapshot.SerializeAsString());
}

Result<std::string> JoinedTake::finish() {
  if (const Status appended = append_others(Timestamp::max()); !appended) return appended.error();
  take::add_quality(info_, meter_.report(), {});
  return file_.finish(info_);
}

}  // namespace mocap::join
