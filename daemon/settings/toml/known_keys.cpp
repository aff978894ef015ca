#include "settings/toml/known_keys.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "settings/toml/suggestion.h"

namespace mocap::settings {
namespace {

bool has_key(const std::vector<std::string>& keys, std::string_view key) {
  return std::ranges::find(keys, key) != keys.end();
}

void remember_key(std::vector<std::string>& keys, std::string_view key) {
  if (!has_key(keys, key)) keys.emplace_back(key);
}

bool is_near(const std::string& word, std::string_view key) {
  return nearest_word(word, {std::string(key)}).has_value();
}

}  // namespace

KnownKeys::KnownKeys(Faults& faults, Place table, std::string who)
    : faults_(faults), table_(table), who_(std::move(who)) {}

void KnownKeys::learn(std::string_view key) { remember_key(known_, key); }

bool KnownKeys::is_faulty(std::string_view key) const { return has_key(faulty_, key); }

void KnownKeys::fault(Place at, std::string_view message) {
  faults_.list.push_back(
      {faults_.file, at.line, at.column, who_.empty() ? std::string(message) : fmt::format("{}: {}", who_, message)});
}

void KnownKeys::fault(std::string_view key, Place at, std::string_view message) {
  remember_key(faulty_, key);
  fault(at, message);
}

void KnownKeys::missing(std::string_view key, std::string_view expected) {
  remember_key(faulty_, key);
  if (std::ranges::any_of(unknown_, [&](const std::string& word) { return is_near(word, key); })) return;
  const std::string message = fmt::format("{} is missing, expected {}", key, expected);
  missing_.push_back({std::string(key), std::string(expected), message});
  fault(table_, message);
}

bool KnownKeys::correct(const std::string& name, Place at) {
  if (has_key(known_, name)) return false;
  const auto meant = std::ranges::find_if(missing_, [&](const Missing& each) { return is_near(name, each.key); });
  if (meant == missing_.end()) return false;
  std::erase_if(faults_.list,
                [&](const Fault& each) { return each.line == table_.line && each.message.ends_with(meant->message); });
  fault(at, fmt::format("unknown key '{}', did you mean '{}'? Expected {}", name, meant->key, meant->expected));
  missing_.erase(meant);
  return true;
}

void KnownKeys::judge(const std::string& name, Place at) {
  if (has_key(known_, name)) return;
  unknown_.push_back(name);
  if (correct(name, at)) return;
  const std::string advice = did_you_mean(name, known_);
  fault(at, fmt::format("unknown key '{}'{}", name,
                        advice.empty() ? fmt::format("; known are {}", fmt::join(known_, ", ")) : advice));
}

}  // namespace mocap::settings
