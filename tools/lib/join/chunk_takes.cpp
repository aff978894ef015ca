#include "lib/join/chunk_takes.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "lib/retrack/chunk.h"
#include "lib/retrack/new_take.h"

namespace mocap::join {
namespace {

using retrack::Chunk;

Error wrong(const std::filesystem::path& file, const std::string& what) {
  return {ErrorCode::InvalidArgument, fmt::format("'{}': {}", file.string(), what)};
}

// A chunk, and what its metadata say.
struct Opened {
  std::filesystem::path file;
  take::TakeReader reader;
  retrack::ChunkOrigin origin;

  const Chunk& chunk() const { return origin.chunk; }
};

Result<Opened> open(const std::filesystem::path& file) {
  Result<take::TakeReader> reader = take::TakeReader::open(file);
  if (!reader && reader.error().code == ErrorCode::Io) {  // Io: the joined take
    return Error{ErrorCode::InvalidArgument, reader.error().message};
  }
  if (!reader) return reader.error();
  const auto& texts = reader->info().others;
  const auto text = texts.find(retrack::kMadeOf);
  Result<retrack::ChunkOrigin> origin = retrack::parse_origin(text == texts.end() ? "" : text->second);
  if (!origin) return wrong(file, "is no chunk; mocapctl take retrack --chunk makes chunks");
  if (!reader->is_whole() || !reader->info().started_at || !reader->info().ended_at) {
    return wrong(file, "is not whole; track this chunk again");
  }
  return Opened{file, *std::move(reader), *std::move(origin)};
}

// Each chunk is of the same take, and is there once.
Status check_one_take(const std::vector<Opened>& all) {
  std::map<std::uint32_t, const Opened*> by_number;
  const Opened& first = all.front();
  for (const Opened& one : all) {
    if (one.origin.digest != first.origin.digest || one.chunk().of != first.chunk().of) {
      return wrong(
          one.file,
          fmt::format("was not made of the same take with the same settings, number of chunks and version as '{}'; "
                      "move one of them away, or name the chunks with --chunks or --from",
                      first.file.string()));
    }
    const auto [other, is_new] = by_number.emplace(one.chunk().number, &one);
    if (!is_new) {
      return wrong(one.file,
                   fmt::format("is chunk {}, as '{}' is", to_text(one.chunk()), other->second->file.string()));
    }
  }
  return {};
}

// `all`: in the order of their numbers, each of which is there once.
Status check_complete(const std::vector<Opened>& all) {
  const Chunk& last = all.back().chunk();
  for (std::uint32_t number = 1; number <= last.of; ++number) {
    if (number > all.size() || all[number - 1].chunk().number != number) {
      return wrong(all.front().file, fmt::format("chunk {}/{} of this take is missing", number, last.of));
    }
  }
  return {};
}

// In the order of their numbers.
Result<std::vector<Opened>> open_all(const std::vector<std::filesystem::path>& files) {
  std::vector<Opened> all;
  for (const std::filesystem::path& file : files) {
    Result<Opened> opened = open(file);
    if (!opened) return opened.error();
    all.push_back(*std::move(opened));
  }
  if (all.empty()) return Error{ErrorCode::InvalidArgument, "there are no chunks (*.mcap)"};
  if (const Status fits = check_one_take(all); !fits) return fits.error();
  std::ranges::sort(all, {}, [](const Opened& one) { return one.chunk().number; });
  return all;
}

ChunkTake with_part(Opened opened) {
  retrack::Span part;
  if (opened.chunk().number > 1) part.from = *opened.reader.info().started_at;
  if (opened.chunk().number < opened.chunk().of) part.to = *opened.reader.info().ended_at;
  return {std::move(opened.reader), part};
}

}  // namespace

Result<ChunkTakes> open_chunks(const std::vector<std::filesystem::path>& files) {
  Result<std::vector<Opened>> all = open_all(files);
  if (!all) return all.error();
  if (const Status complete = check_complete(*all); !complete) return complete.error();
  ChunkTakes takes;
  takes.made_of = all->front().origin.digest;
  for (Opened& one : *all) takes.chunks.push_back(with_part(std::move(one)));
  return takes;
}

Result<std::string> made_of(const std::vector<std::filesystem::path>& chunks) {
  const Result<std::vector<Opened>> all = open_all(chunks);
  if (!all) return all.error();
  return all->front().origin.digest;
}

}  // namespace mocap::join
