#include "take/take_info.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <ctime>

#include "take/mcap/encode_records.h"
#include "take/mcap/writer.h"
#include "wire/codec/utf8.h"

namespace mocap::take {
namespace {

constexpr const char* kFormat = "mocap-take/1";

std::string joined(const std::vector<std::string>& lines) { return fmt::format("{}", fmt::join(lines, "\n")); }

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    if (end > begin) lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

// Takes texts out of a metadata record. After the first text that is not a number, `status` has the error.
class Keys {
 public:
  explicit Keys(mcap::Texts texts) : texts_(std::move(texts)) {}

  std::string text(const std::string& key) {
    const auto found = texts_.extract(key);
    return found.empty() ? std::string() : wire::valid_utf8(found.mapped());
  }

  std::optional<std::int64_t> number(const std::string& key, std::int64_t least, std::int64_t most) {
    const std::string value = text(key);
    if (value.empty()) return std::nullopt;
    std::int64_t number = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc() || end != value.data() + value.size() || number < least || number > most) {
      status_ = Error{ErrorCode::InvalidArgument,
                      fmt::format("metadata 'take': {} is '{}', expected {} to {}", key, value, least, most)};
      return std::nullopt;
    }
    return number;
  }

  const Status& status() const noexcept { return status_; }
  mcap::Texts others() { return std::move(texts_); }

 private:
  mcap::Texts texts_;
  Status status_;
};

bool is_plain(char c, bool lines) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte >= 0x20 && byte != 0x7F) || (lines && c == '\n');
}

// Fails with the byte of `text` that is at fault. `what`: as an error calls the text.
Status check_text(const std::string& what, const std::string& text, bool lines) {
  const std::string valid = wire::valid_utf8(text);
  if (valid != text) {
    const auto fault = std::ranges::mismatch(text, valid).in1 - text.begin();
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("take: {}: byte {} is not UTF-8, expected UTF-8", what, fault)};
  }
  const auto fault = std::ranges::find_if_not(text, [&](char c) { return is_plain(c, lines); });
  if (fault == text.end()) return {};
  return Error{ErrorCode::InvalidArgument, fmt::format("take: {}: byte {} is a control character, expected text{}",
                                                       what, fault - text.begin(), lines ? " and newlines" : "")};
}

constexpr std::int64_t kAnyTime_ns = std::numeric_limits<std::int64_t>::max() / 4;

}  // namespace

Status check(const TakeInfo& info) {
  std::vector<std::pair<const char*, const std::string&>> texts = {{"name", info.name},
                                                                   {"slate", info.slate},
                                                                   {"producer", info.producer},
                                                                   {"start timecode", info.start_timecode},
                                                                   {"end timecode", info.end_timecode}};
  for (const std::string& tag : info.tags) texts.emplace_back("tag", tag);
  std::size_t bytes = info.notes.size();
  for (const auto& [what, text] : texts) {
    bytes += text.size();
    const std::string named = fmt::format("{} '{}'", what, wire::valid_utf8(text));
    if (const Status valid = check_text(named, text, false); !valid) return valid;
  }
  if (const Status valid = check_text("notes", info.notes, true); !valid) return valid;
  if (bytes > kMaxInfo_bytes) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("take: name, notes and tags have {} bytes, expected at most {}", bytes, kMaxInfo_bytes)};
  }
  if (info.rating && (*info.rating < 0 || *info.rating > kMaxRating)) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("take: the rating is {}, expected 0 to {}", *info.rating, kMaxRating)};
  }
  return {};
}

std::string plain_text(const std::string& text) {
  const std::string valid = wire::valid_utf8(text);
  std::string plain;
  for (std::size_t i = 0; i < valid.size(); ++i) {
    if (valid.compare(i, 2, "\r\n") == 0) continue;
    plain += is_plain(valid[i], true) ? valid[i] : ' ';
  }
  return plain;
}

mcap::Metadata encode(const TakeInfo& info) {
  mcap::Metadata metadata{kTakeMetadata, info.others};
  mcap::Texts& texts = metadata.texts;
  texts["format"] = kFormat;
  texts["name"] = info.name;
  texts["slate"] = info.slate;
  texts["take_number"] = info.number == 0 ? "" : std::to_string(info.number);
  texts["notes"] = info.notes;
  texts["tags"] = joined(info.tags);
  texts["rating"] = info.rating ? std::to_string(*info.rating) : "";
  texts["producer"] = info.producer;
  texts["utc_minus_host_ns"] = std::to_string(info.utc_minus_host.count());
  for (const auto& [key, at] : {std::pair{"start", info.started_at}, {"end", info.ended_at}}) {
    texts[fmt::format("{}_ns", key)] = at ? std::to_string(to_ns(*at)) : "";
    texts[fmt::format("{}_utc", key)] = at ? utc_text(*at, info.utc_minus_host) : "";
  }
  texts["start_timecode"] = info.start_timecode;
  texts["end_timecode"] = info.end_timecode;
  texts["repaired"] = info.repaired ? std::string("1") : std::string();
  return metadata;
}

bool fits_on_a_full_disk(const TakeInfo& info) {
  std::string bytes;
  mcap::encode(encode(info), bytes);
  return bytes.size() <= mcap::kMaxLastMetadata_bytes;
}

Result<TakeInfo> decode_info(const mcap::Metadata& metadata) {
  Keys keys(metadata.texts);
  TakeInfo info;
  if (const std::string format = keys.text("format"); format != kFormat) {
    return Error{ErrorCode::Unsupported, fmt::format("its format is '{}', expected {}", format, kFormat)};
  }
  info.name = keys.text("name");
  info.slate = keys.text("slate");
  info.number = static_cast<std::uint32_t>(keys.number("take_number", 0, 0xFFFF'FFFF).value_or(0));
  info.notes = keys.text("notes");
  info.tags = lines_of(keys.text("tags"));
  if (const auto rating = keys.number("rating", 0, kMaxRating)) info.rating = static_cast<int>(*rating);
  info.producer = keys.text("producer");
  info.utc_minus_host = Duration(keys.number("utc_minus_host_ns", -kAnyTime_ns, kAnyTime_ns).value_or(0));
  if (const auto at = keys.number("start_ns", -kAnyTime_ns, kAnyTime_ns)) info.started_at = from_ns(*at);
  if (const auto at = keys.number("end_ns", -kAnyTime_ns, kAnyTime_ns)) info.ended_at = from_ns(*at);
  static_cast<void>(keys.text("start_utc"));
  static_cast<void>(keys.text("end_utc"));
  info.start_timecode = keys.text("start_timecode");
  info.end_timecode = keys.text("end_timecode");
  info.repaired = !keys.text("repaired").empty();
  if (!keys.status()) return keys.status().error();
  info.others = keys.others();
  return info;
}

std::string utc_text(Timestamp at, Duration utc_minus_host) {
  const Duration utc = at.time_since_epoch() + utc_minus_host;
  const auto seconds = std::chrono::floor<std::chrono::seconds>(utc);
  const std::time_t whole = seconds.count();
  std::tm parts{};
  ::gmtime_r(&whole, &parts);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:09}Z", parts, (utc - seconds).count());
}

}  // namespace mocap::take
