// mocap-vmc: sends one subject of a feed with the VMC protocol or as VRChat's trackers (OSC over UDP).
#include <string>

#include "bridges/udp/send_loop.h"
#include "bridges/vmc/vmc.h"
#include "bridges/vmc/vrchat.h"

namespace {

using namespace mocap;  // NOLINT: the program

constexpr std::size_t kMaxPacket_bytes = 1400;  // below the Ethernet MTU of 1500, so that packets are not fragmented

enum class Protocol { Vmc, Vrchat };

struct Options {
  bridge::SendOptions send{.feed = {.axes = MOCAP_AXES_UNITY}};
  std::string subject;
  Protocol protocol = Protocol::Vmc;
  bool no_head = false;
};

class SubjectWriter : public bridge::PacketWriter {
 public:
  explicit SubjectWriter(const Options& options) : options_(options) {}

  const std::vector<std::string>& write(const ClientFrame* frame, double time_s) override {
    const auto subject = select(frame);
    const ClientSubject* person = subject ? &*subject : nullptr;
    if (options_.protocol == Protocol::Vrchat) {
      vmc::write_trackers(person, !options_.no_head, bundles_);
    } else {
      vmc::write_frame(person, static_cast<float>(time_s), bundles_);
    }
    return bundles_.bundles();
  }

 private:
  std::optional<ClientSubject> select(const ClientFrame* frame) const {
    if (frame == nullptr) return std::nullopt;
    return options_.subject.empty() ? frame->subject(0) : frame->subject(options_.subject);
  }

  const Options& options_;
  vmc::OscBundles bundles_{kMaxPacket_bytes};
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  cli::App app(
      "Sends one subject of a mocapd feed to programs with the VMC protocol, or to VRChat as OSC trackers, in Unity's "
      "axes.",
      "mocap-vmc");
  app.footer(R"(examples:
  mocap-vmc                                          the first subject of the daemon on this machine, to 127.0.0.1:39539
  mocap-vmc tcp://10.0.0.7:5570 --subject anna --to 10.0.0.9 --rate 90
  mocap-vmc --protocol vrchat --to 10.0.0.9          trackers 1 to 8 and the head, to port 9000
exit codes: 0 sent, or ended by a signal, 64 invalid command line, 69 no data in --seconds or an unknown receiver)");
  app.add_option("--subject", options.subject, "name of the subject; default: the first");
  app.add_choice("--protocol", options.protocol, {{"vmc", Protocol::Vmc}, {"vrchat", Protocol::Vrchat}},
                 "vmc: port 39539; vrchat: /tracking/trackers, port 9000");
  app.add_flag("--no-head", options.no_head, "vrchat: do not align VRChat's space to the tracked head");
  add_send_options(app, options.send);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  if (options.send.port.empty()) options.send.port = options.protocol == Protocol::Vrchat ? "9000" : "39539";
  SubjectWriter writer(options);
  return bridge::send_until_stopped("mocap-vmc", options.send, writer);
}
