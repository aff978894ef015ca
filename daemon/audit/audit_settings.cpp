#include "audit/audit_settings.h"

namespace mocap::audit {

void declare_keys(KeyVisitor& keys, AuditSettings& audit) {
  keys.flag("on", audit.on, {.help = "false: no audit log"});
  keys.path(
      "file", audit.file,
      {.help = "JSON lines, read by mocapctl audit; without this key and without a state folder there is no log"});
  keys.number("max_mb", audit.max_mb, {1, 4096}, {.help = "a larger file becomes FILE.1, FILE.1 becomes FILE.2, ..."});
  keys.number("keep", audit.keep, {1, 100}, {.help = "number of these older files; the oldest is deleted"});
}

}  // namespace mocap::audit
