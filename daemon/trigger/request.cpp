#include "trigger/request.h"

namespace mocap::trigger {

const char* name_of(Verb verb) {
  switch (verb) {
    case Verb::Start: return "start";
    case Verb::Stop: return "stop";
    case Verb::Cancel: return "cancel";
    case Verb::Complete: break;
  }
  return "complete";
}

}  // namespace mocap::trigger
