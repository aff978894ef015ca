#pragma once

#include <string>
#include <utility>

#include "model/control.h"

namespace mocap::runtime {

/// An answer without data.
inline ControlAnswer plain_answer(ControlCode code, std::string message) {
  ControlAnswer answer;
  answer.code = code;
  answer.message = std::move(message);
  return answer;
}

}  // namespace mocap::runtime
