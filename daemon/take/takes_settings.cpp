#include "take/takes_settings.h"

#include "take/take_name.h"

namespace mocap::take {

void declare_keys(KeyVisitor& keys, TakesSettings& takes) {
  keys.path("folder", takes.folder,
            {.help = "of the takes that mocapctl take start records; is made with the first one"});
  keys.text("name", takes.name,
            {.help = "of a take without a name; {slate}, {number} (counts within the folder), {date}, {time} (UTC)"});
  keys.number("min_free_mb", takes.min_free_mb, {1, 1e9},
              {.help = "a take ends, and none starts, with less free space on the disk"});
  keys.flag("blobs", takes.blobs, {.help = "true: takes have the blobs of every camera, to be tracked again"});
  keys.flag("snapshots", takes.snapshots, {.help = "true: takes have every snapshot"});
  keys.time("before_s", takes.before, {0, 600},
            {.help = "the last seconds are kept in memory for mocapctl take start --before"});
  keys.number("memory_mb", takes.memory_mb, {8, 65536},
              {.help = "of before_s, and of what waits for a slow disk; if it is full, fewer seconds are kept"});
}

std::vector<KeyFault> faults_of(const TakesSettings& takes) {
  if (const Status valid = check_pattern(takes.name); !valid) return {{"name", valid.error().message}};
  return {};
}

}  // namespace mocap::take
