#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "trigger/request.h"

// The answers to a request, as bytes in the dialect of its sender. Pure. Nothing: the dialect has no such answer.
namespace mocap::trigger {

/// The facts about a take in an answer. `path`: of its file; empty if it is not known.
struct AnsweredTake {
  std::string name;
  std::string path;
};

/// The take has started, or is waiting to start.
std::optional<std::string> start_answer(const Request& request, const AnsweredTake& take);
/// The take ends. `result`: "SUCCESS", "FAIL" or "CANCEL".
std::optional<std::string> stop_answer(const Request& request, const char* result, const AnsweredTake& take);
/// The file is closed and on the disk.
std::optional<std::string> complete_answer(const Request& request, const char* result, const AnsweredTake& take);
/// The request is not executed, because of `why`.
std::optional<std::string> refusal_answer(const Request& request, const std::string& why);

/// The folder of a file, without the slash at its end.
std::string folder_of(std::string_view path);

}  // namespace mocap::trigger
