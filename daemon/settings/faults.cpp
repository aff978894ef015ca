#include "settings/faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace mocap::settings {

std::string to_text(const Fault& fault) {
  if (fault.line == 0) return fmt::format("{}: {}", fault.file.string(), fault.message);
  return fmt::format("{}:{}:{}: {}", fault.file.string(), fault.line, fault.column, fault.message);
}

std::string to_text(const Faults& faults) {
  // Faults of the file itself come first, then those of the files it names in the order of reading.
  std::vector<Fault> sorted = faults.list;
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Fault& a, const Fault& b) {
    const bool a_elsewhere = a.file != faults.file;
    const bool b_elsewhere = b.file != faults.file;
    if (a_elsewhere || b_elsewhere) return a_elsewhere < b_elsewhere;
    return std::tie(a.line, a.column) < std::tie(b.line, b.column);
  });

  std::string text;
  for (const Fault& fault : sorted) text += to_text(fault) + "\n";
  const std::size_t count = sorted.size();
  return text + fmt::format("{}: {} fault{}, nothing started", faults.file.string(), count, count == 1 ? "" : "s");
}

}  // namespace mocap::settings
