#include "lib/cli/key_options.h"

namespace mocap::cli {

void add_key_options(App& app, KeyOptions& keys) {
  app.add_option("--server-key", keys.server_key, "the daemon's public key, or a file with it")->type_name("KEY|FILE");
  app.add_option("--secret-key", keys.secret_key, "your own key pair, a file of mocapctl keys new")->type_name("FILE");
  app.add_option("--key", keys.secret_key)->group("");
}

}  // namespace mocap::cli
