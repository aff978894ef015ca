#include "lib/farm/openjd.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <system_error>

#include "base/replace_file.h"

namespace mocap::farm {
namespace {

using nlohmann::ordered_json;

// Limits of the specification: elements of the range of a task parameter, and characters of each.
constexpr std::size_t kMaxTasks = 1024;
constexpr std::size_t kMaxValue = 1024;
constexpr const char* kRetrackStep = "retrack";
constexpr const char* kJoinStep = "join";

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

// A parameter whose value in task i is that of unit i.
template <class ValueOf>
ordered_json parameter(const char* name, const char* type, std::span<const Unit> units, ValueOf value_of) {
  ordered_json range = ordered_json::array();
  for (const Unit& unit : units) range.push_back(value_of(unit));
  return {{"name", name}, {"type", type}, {"range", std::move(range)}};
}

ordered_json take_parameter(std::span<const Unit> units) {
  return parameter("Take", "PATH", units, [](const Unit& unit) { return unit.take.string(); });
}

ordered_json new_take_parameter(std::span<const Unit> units) {
  return parameter("NewTake", "PATH", units, [](const Unit& unit) { return unit.out.string(); });
}

std::string step_name(const char* name, std::size_t number) {
  return number == 0 ? std::string(name) : fmt::format("{}-{}", name, number + 1);
}

ordered_json script_of(const std::vector<std::string>& command) {
  return {{"actions",
           {{"onRun",
             {{"command", command.front()},
              {"args", std::vector<std::string>(command.begin() + 1, command.end())},
              {"cancelation", {{"mode", "NOTIFY_THEN_TERMINATE"}, {"notifyPeriodInSeconds", 30}}}}}}}};
}

ordered_json retrack_step(const UnitCommand& common, std::span<const Unit> units, std::size_t number) {
  UnitCommand command = common;
  ordered_json parameters = ordered_json::array({take_parameter(units), new_take_parameter(units)});
  std::string combination = "(Take, NewTake)";
  if (units.front().chunk) {
    parameters.push_back(parameter("Chunk", "STRING", units, [](const Unit& unit) { return to_text(*unit.chunk); }));
    combination = "(Take, NewTake, Chunk)";
    command.options.insert(command.options.begin(), {"--chunk", "{{Task.Param.Chunk}}"});
  }
  ordered_json step;
  step["name"] = step_name(kRetrackStep, number);
  step["parameterSpace"] = {{"taskParameterDefinitions", std::move(parameters)}, {"combination", combination}};
  step["script"] = script_of(command_of(command, {"{{Task.Param.Take}}", "{{Task.Param.NewTake}}"}));
  return step;
}

// Joins the chunks of takes once all chunks of all takes are there. `units`: one of each take.
ordered_json join_step(const UnitCommand& common, std::span<const Unit> units, std::size_t number,
                       std::size_t retrack_steps) {
  ordered_json step;
  step["name"] = step_name(kJoinStep, number);
  step["dependencies"] = ordered_json::array();
  for (std::size_t i = 0; i < retrack_steps; ++i) {
    step["dependencies"].push_back({{"dependsOn", step_name(kRetrackStep, i)}});
  }
  step["parameterSpace"] = {{"taskParameterDefinitions", ordered_json::array({new_take_parameter(units)})}};
  step["script"] = script_of(join_command(common.mocapctl, "{{Task.Param.NewTake}}", units.front().chunk->of));
  return step;
}

// Calls `add` with each part of the units that fits into a step, and the number of the part.
template <class Add>
std::size_t for_each_step(std::span<const Unit> units, Add add) {
  std::size_t number = 0;
  for (; number * kMaxTasks < units.size(); ++number) {
    const std::size_t first = number * kMaxTasks;
    add(units.subspan(first, std::min(kMaxTasks, units.size() - first)), number);
  }
  return number;
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
  const std::size_t retrack_steps = for_each_step(order.units, [&](std::span<const Unit> part, std::size_t number) {
    steps.push_back(retrack_step(order.common, part, number));
  });
  std::vector<Unit> joined;
  std::ranges::copy_if(order.units, std::back_inserter(joined),
                       [](const Unit& unit) { return unit.chunk && unit.chunk->number == 1; });
  for_each_step(joined, [&](std::span<const Unit> part, std::size_t number) {
    steps.push_back(join_step(order.common, part, number, retrack_steps));
  });
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
