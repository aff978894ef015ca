#include "bridges/natnet/command.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <vector>

namespace mocap::natnet {
namespace {

constexpr std::size_t kMaxSubscriptions = 256;
constexpr std::size_t kMaxSubscribedName_bytes = 255;  // the subscriptions of a client need at most 64 kB
constexpr std::size_t kMaxTakeName = 200;              // bytes; a file name has at most 255

std::vector<std::string_view> split(std::string_view text) {
  std::vector<std::string_view> words;
  for (;;) {
    const std::size_t end = text.find(',');
    words.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return words;
    text.remove_prefix(end + 1);
  }
}

std::optional<Kind> kind_of(std::string_view word) {
  if (word == "RigidBody") return Kind::Body;
  if (word == "Skeleton") return Kind::Skeleton;
  if (word == "MarkersetMarkers" || word == "MarkerSet") return Kind::MarkerSet;
  return std::nullopt;
}

using Words = std::vector<std::string_view>;

Answer bitstream(const Words& words, Settings& settings, const CommandFacts& facts) {
  if (words.size() > 1) {
    const std::optional<Version> wanted = read_version(words[1]);
    if (!wanted || !facts.changeable) return kNotPossible;
    settings.version = nearest(*wanted);
  }
  return "Bitstream," + to_string(settings.version);
}

// SetProperty,NODE,NAME,VALUE. The node, which is empty for a setting of the stream, is omitted by some clients.
Answer set(const Words& words, Settings& settings, const CommandFacts& facts) {
  if (words.size() < 3 || words.size() > 4 || !facts.changeable) return kNotPossible;
  if (words.size() == 4 && !words[1].empty()) return kNotPossible;  // a property of one subject
  return set_property(settings, words[words.size() - 2], words.back()) ? kDone : kNotPossible;
}

Answer get(const Words& words, const Settings& settings) {
  if (words.size() < 2 || words.size() > 3) return kNotPossible;
  const std::optional<std::string> value = get_property(settings, words.back());
  return value ? Answer(*value) : Answer(kNotPossible);
}

Answer subscribe(const Words& words, Settings& settings, const CommandFacts& facts) {
  if (!facts.changeable) return kNotPossible;
  if (words.size() < 2 || words[1].empty() || words[1] == "AllTypes") {
    settings.subscriptions.clear();
    settings.subscribed_only = false;
    return kDone;
  }
  const std::optional<Kind> kind = kind_of(words[1]);
  if (!kind || settings.subscriptions.size() >= kMaxSubscriptions) return kNotPossible;
  Subscription one;
  one.kind = *kind;
  if (words.size() > 2 && words[0] == "SubscribeByID") {
    const auto read = std::from_chars(words[2].data(), words[2].data() + words[2].size(), one.id);
    if (read.ec != std::errc() || one.id <= 0) return kNotPossible;
  } else if (words.size() > 2 && words[2] != "all" && words[2] != "All") {
    if (words[2].size() > kMaxSubscribedName_bytes) return kNotPossible;
    one.name = words[2];
  }
  settings.subscriptions.push_back(one);
  return kDone;
}

// StartRecording, StopRecording and SetRecordTakeName,NAME. The daemon checks the name.
Answer record(const Words& words, Settings& settings, const CommandFacts& facts) {
  if (!facts.records) return kNotPossible;
  if (words[0] == "StartRecording") return Record{true, settings.take_name};
  if (words[0] == "StopRecording") return Record{false, {}};
  if (words.size() != 2 || words[1].size() > kMaxTakeName) return kNotPossible;
  settings.take_name = words[1];
  return kDone;
}

// Commands of playback and live mode, which do not exist here.
constexpr std::array<std::string_view, 8> kNotOffered{
    "SetCurrentSession",       "TimelinePlay",       "TimelineStop",         "SetPlaybackTakeName", "EditMode",
    "SetPlaybackCurrentFrame", "SetPlaybackLooping", "SetPlaybackStartFrame"};

}  // namespace

Answer execute(std::string_view text, Settings& settings, const CommandFacts& facts) {
  const Words words = split(text);
  const std::string_view command = words.front();
  if (command == "Bitstream") return bitstream(words, settings, facts);
  if (command == "FrameRate") return facts.rate_hz;
  if (command == "SetProperty") return set(words, settings, facts);
  if (command == "GetProperty") return get(words, settings);
  if (command == "SubscribeToData" || command == "SubscribeByID") return subscribe(words, settings, facts);
  if (command == "StartRecording" || command == "StopRecording" || command == "SetRecordTakeName") {
    return record(words, settings, facts);
  }
  if (command == "LiveMode") return kDone;
  if (command == "Disconnect") return Leave{};
  const bool known = std::find(kNotOffered.begin(), kNotOffered.end(), command) != kNotOffered.end();
  return known ? Answer(kNotPossible) : Answer(Unknown{});
}

}  // namespace mocap::natnet
