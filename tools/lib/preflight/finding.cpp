#include "lib/preflight/finding.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace mocap::preflight {
namespace {

constexpr const char* kWords[] = {"good", "warning", "bad"};  // by Verdict

}  // namespace

Finding good(std::string check, std::string what) {
  return {.check = std::move(check), .verdict = Verdict::Good, .what = std::move(what), .cure = {}};
}
Finding warning(std::string check, std::string what, std::string cure) {
  return {.check = std::move(check), .verdict = Verdict::Warning, .what = std::move(what), .cure = std::move(cure)};
}
Finding bad(std::string check, std::string what, std::string cure) {
  return {.check = std::move(check), .verdict = Verdict::Bad, .what = std::move(what), .cure = std::move(cure)};
}

bool is_bad(const std::vector<Finding>& findings) {
  return std::ranges::any_of(findings, [](const Finding& each) { return each.verdict == Verdict::Bad; });
}

std::string json_of(const std::vector<Finding>& findings) {
  nlohmann::json list = nlohmann::json::array();
  for (const Finding& each : findings) {
    list.push_back({{"check", each.check},
                    {"verdict", kWords[static_cast<std::size_t>(each.verdict)]},
                    {"what", each.what},
                    {"cure", each.cure}});
    if (each.minutes) list.back()["minutes"] = *each.minutes;
  }
  return list.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void print(const std::vector<Finding>& findings, bool json) {
  if (json) return fmt::print("{}\n", json_of(findings));
  for (const Finding& each : findings) {
    fmt::print("{:<8} {:<28} {}\n", kWords[static_cast<std::size_t>(each.verdict)], each.check, each.what);
    if (!each.cure.empty()) fmt::print("{:<8} {:<28} > {}\n", "", "", each.cure);
  }
}

}  // namespace mocap::preflight
