#include "chaos/shrink.h"

#include <algorithm>

namespace mocap::chaos {
namespace {

// The list without its part `part` of `parts`.
std::vector<Fault> without(const std::vector<Fault>& faults, std::size_t part, std::size_t parts) {
  const std::size_t from = part * faults.size() / parts, to = (part + 1) * faults.size() / parts;
  std::vector<Fault> rest(faults.begin(), faults.begin() + static_cast<std::ptrdiff_t>(from));
  rest.insert(rest.end(), faults.begin() + static_cast<std::ptrdiff_t>(to), faults.end());
  return rest;
}

}  // namespace

std::vector<Fault> shrink(std::vector<Fault> faults, const std::function<bool(const std::vector<Fault>&)>& fails) {
  if (!faults.empty() && fails({})) return {};
  std::size_t parts = 2;
  while (faults.size() >= 2) {
    bool smaller = false;
    for (std::size_t part = 0; part < parts && !smaller; ++part) {
      std::vector<Fault> rest = without(faults, part, parts);
      if (!fails(rest)) continue;
      faults = std::move(rest);
      smaller = true;
    }
    if (smaller) {
      parts = std::max<std::size_t>(parts - 1, 2);
    } else if (parts < faults.size()) {
      parts = std::min(2 * parts, faults.size());
    } else {
      break;
    }
  }
  return faults;
}

}  // namespace mocap::chaos
