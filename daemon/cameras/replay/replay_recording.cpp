#include "cameras/replay/replay_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include "base/list_folder.h"

namespace mocap::cameras {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 2> kImages{".pgm", ".png"};
constexpr std::array<std::string_view, 5> kVideos{".avi", ".mkv", ".mp4", ".mov", ".mjpeg"};

template <class Extensions>
bool is_one_of(const fs::path& file, const Extensions& extensions) {
  const std::string extension = file.extension().string();
  return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Error wrong(const fs::path& file, std::size_t line, const std::string& what) {
  return {ErrorCode::InvalidArgument, fmt::format("{}:{}: {}", file.string(), line, what)};
}

struct Contents {
  std::map<std::uint64_t, fs::path> images;
  std::vector<fs::path> videos;
  bool any() const { return !images.empty() || !videos.empty(); }
};

// Ignores files that are neither numbered images nor videos.
Result<Contents> contents_of(const fs::path& folder) {
  const FolderContents all = list_folder(folder);
  if (all.error) {
    return Error{ErrorCode::Io, fmt::format("{} cannot be read: {}", folder.string(), all.error.message())};
  }
  Contents contents;
  for (const fs::path& file : all.paths) {
    if (is_one_of(file, kVideos)) contents.videos.push_back(file);
    if (!is_one_of(file, kImages)) continue;
    if (const auto number = number_in<std::uint64_t>(file.stem().string())) contents.images.emplace(*number, file);
  }
  return contents;
}

// Empty for a time that the daemon's clock does not reach: the numbers are times then.
std::optional<Timestamp> at_constant_rate(std::uint64_t number, double rate_hz) {
  constexpr double kLongest_s = 1.1e9;  // 35 years; 2^63 ns are 292 years
  const double at_s = static_cast<double>(number) / rate_hz;
  if (at_s > kLongest_s) return std::nullopt;
  return Timestamp{from_s(at_s)};
}

Result<std::vector<RecordedFrame>> timed(const Contents& contents, const std::optional<RecordedTimes>& times,
                                         const fs::path& times_file, double rate_hz) {
  std::vector<RecordedFrame> frames;
  for (const auto& [number, file] : contents.images) {
    if (!times) {
      const std::optional<Timestamp> at = at_constant_rate(number, rate_hz);
      if (!at) {
        return Error{ErrorCode::InvalidArgument,
                     fmt::format("{}: frame {} would be exposed {:.0f} years after the first at rate_hz = {}, expected "
                                 "a number that counts images; if it is a time, write {} (lines frame,time_ns)",
                                 file.string(), number, static_cast<double>(number) / rate_hz / (365.25 * 24 * 3600),
                                 rate_hz, times_file.string())};
      }
      frames.push_back({number, *at, file});
      continue;
    }
    const auto row = times->find(number);
    if (row == times->end()) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("{}: no row for frame {} ({})", times_file.string(), number, file.string())};
    }
    frames.push_back({number, row->second, file});
  }
  return frames;
}

}  // namespace

Result<RecordedTimes> read_recorded_times(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return Error{ErrorCode::NotFound, fmt::format("cannot read {}", file.string())};
  RecordedTimes times;
  std::string text;
  for (std::size_t line = 1; std::getline(in, text); ++line) {
    if (!text.empty() && text.back() == '\r') text.pop_back();
    if (line == 1) {
      if (text != "frame,time_ns")
        return wrong(file, line, fmt::format("the header is '{}', expected 'frame,time_ns'", text));
      continue;
    }
    if (text.empty()) continue;
    const std::string_view row = text;
    const std::size_t comma = row.find(',');
    const auto number = number_in<std::uint64_t>(row.substr(0, comma));
    const auto time_ns =
        comma == std::string_view::npos ? std::nullopt : number_in<std::int64_t>(row.substr(comma + 1));
    if (!number || !time_ns) return wrong(file, line, fmt::format("'{}' is no row 'frame,time_ns'", text));
    if (!times.empty() && *number <= times.rbegin()->first) {
      return wrong(file, line,
                   fmt::format("frame {} follows frame {}; numbers must grow", *number, times.rbegin()->first));
    }
    if (!times.empty() && *time_ns <= to_ns(times.rbegin()->second)) {
      return wrong(file, line, fmt::format("frame {} is not later than the one before; times must grow", *number));
    }
    times.emplace_hint(times.end(), *number, from_ns(*time_ns));
  }
  if (in.bad()) return Error{ErrorCode::Io, fmt::format("{} cannot be read to its end", file.string())};
  if (times.empty()) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{} has no row, expected the line 'frame,time_ns' and one row for each image; write the "
                             "rows or delete the file",
                             file.string())};
  }
  return times;
}

Result<Recording> find_recording(const fs::path& folder, const std::string& camera, double rate_hz) {
  std::error_code ignored;
  const fs::path own = fs::is_directory(folder / camera, ignored) ? folder / camera : folder;
  if (!fs::is_directory(own, ignored)) {
    return Error{ErrorCode::NotFound,
                 fmt::format("no folder {} (nor {})", folder.string(), (folder / camera).string())};
  }
  const Result<Contents> read = contents_of(own);
  if (!read) return read.error();
  const Contents& contents = *read;
  if (!contents.any()) {
    return Error{ErrorCode::NotFound, fmt::format("{} holds no numbered .pgm or .png and no video", own.string())};
  }
  if (contents.videos.size() + (contents.images.empty() ? 0 : 1) > 1) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{} holds more than one recording; expected numbered images or one video", own.string())};
  }

  const fs::path times_file = own / "timestamps.csv";
  std::optional<RecordedTimes> times;
  if (fs::exists(times_file, ignored)) {
    Result<RecordedTimes> given = read_recorded_times(times_file);
    if (!given) return given.error();
    times = *std::move(given);
  }
  Recording recording;
  if (contents.images.empty()) {
    recording.video = contents.videos.front();
    if (times) {
      for (const auto& [number, at] : *times) recording.frames.push_back({number, at, {}});
    }
    return recording;
  }
  Result<std::vector<RecordedFrame>> frames = timed(contents, times, times_file, rate_hz);
  if (!frames) return frames.error();
  recording.frames = *std::move(frames);
  return recording;
}

}  // namespace mocap::cameras
