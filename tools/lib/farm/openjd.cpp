#include "lib/farm/openjd.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <system_error>

#include "base/replace_file.h"

namespace mocap::farm {
namespace {

using nlohmann::ordered_json;

// Limits of the specification: elements of the range of a task parameter, and characters of each.
constexpr std::size_t kMaxTasks = 1024;
constexpr std::size_t kMaxValue = 1024;

Status check(const std::string& text) {
  const bool has_control =
      std::ranges::any_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
  if (!has_control && text.size() <= kMaxValue && text.find("{{") == std::string::npos) return {};
  return Error{
      ErrorCode::InvalidArgument,
      fmt::format("'{}' cannot be in a job template: expected at most {} characters, without control characters "
                  "and '{{{{'",
                  text, kMaxValue)};
}

ordered_json path_parameter(const char* name, std::span<const Unit> units, std::filesystem::path Unit::*path) {
  ordered_json range = ordered_json::array();
  for (const Unit& unit : units) range.push_back((unit.*path).string());
  return {{"name", name}, {"type", "PATH"}, {"range", std::move(range)}};
}

ordered_json step_of(const UnitCommand& common, std::span<const Unit> units, std::size_t number) {
  const Unit any{"{{Task.Param.Take}}", "{{Task.Param.NewTake}}"};
  const std::vector<std::string> command = command_of(common, any);
  ordered_json step;
  step["name"] = number == 0 ? std::string("retrack") : fmt::format("retrack-{}", number + 1);
  step["parameterSpace"] = {
      {"taskParameterDefinitions",
       {path_parameter("Take", units, &Unit::take), path_parameter("NewTake", units, &Unit::out)}},
      {"combination", "(Take, NewTake)"}};
  step["script"] = {{"actions",
                     {{"onRun",
                       {{"command", command.front()},
                        {"args", std::vector<std::string>(command.begin() + 1, command.end())},
                        {"cancelation", {{"mode", "NOTIFY_THEN_TERMINATE"}, {"notifyPeriodInSeconds", 30}}}}}}}};
  return step;
}

}  // namespace

Result<ordered_json> openjd_template(const FarmOrder& order) {
  for (const Unit& unit : order.units) {
    for (const auto& path : {unit.take, unit.out}) {
      if (const Status allowed = check(path.string()); !allowed) return allowed.error();
    }
  }
  for (const std::string& option : order.common.options) {
    if (const Status allowed = check(option); !allowed) return allowed.error();
  }
  if (const Status allowed = check(order.common.mocapctl.string()); !allowed) return allowed.error();
  ordered_json steps = ordered_json::array();
  const std::span<const Unit> all(order.units);
  for (std::size_t first = 0; first < all.size(); first += kMaxTasks) {
    const auto part = all.subspan(first, std::min(kMaxTasks, all.size() - first));
    steps.push_back(step_of(order.common, part, first / kMaxTasks));
  }
  return ordered_json{{"specificationVersion", "jobtemplate-2023-09"},
                      {"name", "retrack"},
                      {"description", "takes tracked again, written by mocapctl take retrack --farm openjd"},
                      {"steps", std::move(steps)}};
}

Result<std::filesystem::path> write_openjd(const FarmOrder& order) {
  const Result<ordered_json> job = openjd_template(order);
  if (!job) return job.error();
  std::error_code error;
  std::filesystem::create_directories(order.folder, error);
  const std::filesystem::path path = order.folder / "template.json";
  const std::string text = job->dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
  if (const Status written = replace_file(path, text); !written) return written.error();
  return path;
}

}  // namespace mocap::farm
