#include "text.h"

#include <cctype>

#include "settings/toml/suggestion.h"

namespace mocap::client {
namespace {

std::string lower(std::string_view text) {
  std::string copy(text);
  for (char& c : copy) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return copy;
}

// The known name that is nearest to `name` without regard to case.
std::string nearest(std::string_view name, const std::vector<std::string>& known) {
  std::vector<std::string> lowered;
  for (const std::string& one : known) lowered.push_back(lower(one));
  const auto found = settings::nearest_word(lower(name), lowered);
  if (!found) return {};
  return known[static_cast<std::size_t>(std::find(lowered.begin(), lowered.end(), *found) - lowered.begin())];
}

}  // namespace

std::string unknown_name(std::string_view kind, std::string_view name, std::string_view owner,
                         const std::vector<std::string>& known) {
  std::string text(owner);
  text.append(" has no ").append(kind).append(" '").append(name).append("'");
  if (const std::string near = nearest(name, known); !near.empty()) text += ", did you mean '" + near + "'?";
  text.append(known.empty() ? "; it has none" : "; its ")
      .append(known.empty() ? "" : kind)
      .append(known.empty() ? "" : "s are ");
  for (std::size_t i = 0; i < known.size(); ++i) text.append(i > 0 ? ", " : "").append(known[i]);
  return text;
}

}  // namespace mocap::client
