// mocap-rokoko: sends a feed as Rokoko Studio's live stream (JSON v3 over UDP), for Rokoko's free plug-ins.
#include <string>
#include <vector>

#include "bridges/rokoko/lz4_frame.h"
#include "bridges/rokoko/scene.h"
#include "bridges/udp/send_loop.h"

namespace {

using namespace mocap;  // NOLINT: the program

class SceneWriter : public bridge::PacketWriter {
 public:
  SceneWriter(const rokoko::SceneOptions& options, const bool& lz4) : options_(options), lz4_(lz4) {}

  const std::vector<std::string>& write(const ClientFrame* frame, double time_s) override {
    packets_[0] = rokoko::write_scene(frame, options_, time_s);
    if (lz4_) packets_[0] = rokoko::lz4_frame(packets_[0]);
    return packets_;
  }

 private:
  const rokoko::SceneOptions& options_;
  const bool& lz4_;
  std::vector<std::string> packets_ = std::vector<std::string>(1);
};

}  // namespace

int main(int argc, char** argv) {
  bridge::SendOptions send{.feed = {.axes = MOCAP_AXES_UNITY}, .port = "14043"};
  rokoko::SceneOptions scene;
  bool lz4 = false;
  cli::App app(
      "Sends a mocapd feed as JSON v3 over UDP, which Rokoko's plug-ins for Blender, Unreal, Unity, Maya, "
      "MotionBuilder, "
      "Houdini and Cinema 4D receive.",
      "mocap-rokoko");
  app.footer(R"(examples:
  mocap-rokoko                                     all subjects of the daemon on this machine, to 127.0.0.1:14043
  mocap-rokoko tcp://10.0.0.7:5570 --subject anna --to 10.0.0.9 --rate 30
  mocap-rokoko --to 10.0.0.9 --to 10.0.0.10:14044  two receivers
  mocap-rokoko --lz4 --to 10.0.0.9                 compressed to a third, for several people or fingers
exit codes: 0 sent, or ended by a signal, 64 invalid command line, 69 no data in --seconds or an unknown receiver)");
  app.add_option("--subject", scene.subject, "name of the only subject to send; default: all");
  app.add_flag("--lz4", lz4, "compress each packet as an LZ4 frame");
  add_send_options(app, send);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  scene.rate_hz = send.rate_hz;
  SceneWriter writer(scene, lz4);
  return bridge::send_until_stopped("mocap-rokoko", send, writer);
}
