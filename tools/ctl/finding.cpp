#include "ctl/finding.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace mocap::ctl {
namespace {

constexpr const char* kWords[] = {"good", "warning", "bad"};  // by Verdict

}  // namespace

Finding good(std::string check, std::string what) { return {std::move(check), Verdict::Good, std::move(what), {}}; }
Finding warning(std::string check, std::string what, std::string cure) {
  return {std::move(check), Verdict::Warning, std::move(what), std::move(cure)};
}
Finding bad(std::string check, std::string what, std::string cure) {
  return {std::move(check), Verdict::Bad, std::move(what), std::move(cure)};
}

bool is_bad(const std::vector<Finding>& findings) {
  return std::ranges::any_of(findings, [](const Finding& each) { return each.verdict == Verdict::Bad; });
}

void print(const std::vector<Finding>& findings, bool json) {
  if (json) {
    nlohmann::json list = nlohmann::json::array();
    for (const Finding& each : findings) {
      list.push_back({{"check", each.check},
                      {"verdict", kWords[static_cast<std::size_t>(each.verdict)]},
                      {"what", each.what},
                      {"cure", each.cure}});
    }
    fmt::print("{}\n", list.dump());
    return;
  }
  for (const Finding& each : findings) {
    fmt::print("{:<8} {:<28} {}\n", kWords[static_cast<std::size_t>(each.verdict)], each.check, each.what);
    if (!each.cure.empty()) fmt::print("{:<8} {:<28} > {}\n", "", "", each.cure);
  }
}

}  // namespace mocap::ctl
