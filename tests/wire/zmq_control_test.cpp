// The control server over real sockets: requests, roles and malformed messages.
#include "wire/zmq_control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <memory>
#include <mutex>
#include <ranges>
#include <string>
#include <thread>
#include <vector>

#include "mocap/v1/control.pb.h"
#include "sample_description.h"
#include "support/temporary_folder.h"
#include "wire/codec/control_codec.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace zmq_control_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr Duration kLong = seconds(20);  // time limit of a failing test

// Answers each valid request with its `name`, after computing for `work`.
class EchoingDaemon {
 public:
  explicit EchoingDaemon(ControlSettings settings = {}, Duration work = {}, AuditTrail* audit = nullptr) {
    settings.endpoint = "tcp://127.0.0.1:*";
    auto opened = ZmqControl::open(settings, audit);
    EXPECT_TRUE(opened) << opened.error().message;
    control_ = std::move(*opened);
    thread_ = std::jthread([this, work](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        if (const auto request = control_->next(milliseconds(5))) {
          const Timestamp begun = host_now();
          while (host_now() - begun < work) {
          }
          ControlAnswer answer;
          answer.message = request->name;
          if (!request->by.states.empty()) answer.message += " " + request->by.states + " " + request->by.role;
          if (request->action == ControlAction::GetStatus) answer.status.emplace();
          control_->answer(request->number, answer);
        }
      }
    });
  }
  const std::string& endpoint() const { return control_->endpoint(); }
  std::unique_ptr<ControlClient> client(const std::string& server_key = {}, const KeyPair& own = {}) {
    return std::move(*ControlClient::open({control_->endpoint(), {server_key, own}}));
  }

 private:
  std::unique_ptr<ZmqControl> control_;
  std::jthread thread_;
};

v1::Answer ask(ControlClient& client, const std::string& bytes) {
  v1::Answer answer;
  const Result<std::string> received = client.ask(bytes, kLong);
  EXPECT_TRUE(received) << received.error().message;
  if (received) {
    EXPECT_TRUE(answer.ParseFromString(*received));
  }
  return answer;
}

v1::Answer ask(ControlClient& client, const ControlRequest& request, std::uint64_t id = 7) {
  v1::Request message = encode(request);
  message.set_id(id);
  return ask(client, message.SerializeAsString());
}

ControlRequest reset_of(const std::string& name) {
  ControlRequest request;
  request.action = ControlAction::ResetSubject;
  request.name = name;
  return request;
}

TEST(Control, AnswersWithTheRequestsId) {
  EchoingDaemon daemon;
  const auto client = daemon.client();

  const v1::Answer answer = ask(*client, reset_of("anna"), 4711);

  EXPECT_EQ(answer.code(), v1::CODE_DONE);
  EXPECT_EQ(answer.id(), 4711U);
  EXPECT_EQ(answer.message(), "anna");
}

TEST(Control, AnswersEachRequestToItsSenderInAnyOrder) {
  const auto control = std::move(*ZmqControl::open({.endpoint = "tcp://127.0.0.1:*"}));
  std::vector<std::jthread> operators;
  std::atomic<int> right{0};
  for (const std::string name : {"anna", "ben", "cleo"}) {
    operators.emplace_back([&, name] {
      const auto client = std::move(*ControlClient::open({control->endpoint(), {}}));
      if (ask(*client, reset_of(name), name.size()).message() == name) ++right;
    });
  }

  std::vector<ControlRequest> received;
  for (const Timestamp begun = host_now(); received.size() < operators.size() && host_now() - begun < kLong;) {
    if (const auto request = control->next(milliseconds(5))) received.push_back(*request);
  }
  for (const ControlRequest& request : received | std::views::reverse) {
    ControlAnswer answer;
    answer.message = request.name;
    control->answer(request.number, answer);
  }
  operators.clear();

  EXPECT_EQ(right, 3);
}

TEST(Control, AnswersMalformedRequestsAndContinues) {
  EchoingDaemon daemon;
  const auto client = daemon.client();

  for (const std::string& bytes : {std::string(), std::string("\xff\xff\xff"), std::string(60000, 'x')}) {
    EXPECT_EQ(ask(*client, bytes).code(), v1::CODE_INVALID);
  }
  v1::Request empty;
  empty.set_id(9);
  const v1::Answer answer = ask(*client, empty.SerializeAsString());
  EXPECT_EQ(answer.code(), v1::CODE_INVALID);
  EXPECT_EQ(answer.id(), 9U);
  EXPECT_EQ(ask(*client, reset_of("anna")).code(), v1::CODE_DONE);
}

TEST(Control, DisconnectsAClientWithATooLongMessageAndServesOthers) {
  EchoingDaemon daemon;
  const auto hostile = daemon.client();
  const auto client = daemon.client();

  EXPECT_FALSE(hostile->ask(std::string(1 << 20, 'x'), milliseconds(200)));

  EXPECT_EQ(ask(*client, reset_of("anna")).code(), v1::CODE_DONE);
}

TEST(Control, ServesConcurrentClients) {
  EchoingDaemon daemon;
  std::vector<std::jthread> operators;
  std::atomic<int> right{0};

  for (int who = 0; who < 8; ++who) {
    operators.emplace_back([&, who] {
      const auto client = daemon.client();
      for (std::uint64_t i = 0; i < 50; ++i) {
        const std::string name = std::to_string(who) + "/" + std::to_string(i);
        const v1::Answer answer = ask(*client, reset_of(name), i);
        if (answer.message() == name && answer.id() == i) ++right;
      }
    });
  }
  operators.clear();

  EXPECT_EQ(right, 8 * 50);
}

// The client keeps eight requests in flight, half of the server's send queue, so the server always has a request to
// read. ZeroMQ then does not update its count of delivered answers by itself.
TEST(Control, LosesNoAnswerOfAClientThatPipelinesRequests) {
  constexpr std::uint64_t kAhead = 8, kAll = 2000;
  EchoingDaemon daemon({}, std::chrono::microseconds(30));
  const ZmqContext context;
  ZmqSocket client;
  ASSERT_TRUE(client.open(context, ZMQ_DEALER, "client"));
  ASSERT_TRUE(client.set(ZMQ_LINGER, 0));
  ASSERT_EQ(zmq_connect(client.get(), daemon.endpoint().c_str()), 0);
  const std::string request = encode(reset_of("anna")).SerializeAsString();

  std::uint64_t asked = 0, answered = 0;
  for (; answered < kAll; ++answered) {
    for (; asked < std::min(answered + kAhead, kAll); ++asked) {
      ASSERT_GE(zmq_send(client.get(), request.data(), request.size(), ZMQ_DONTWAIT), 0);
    }
    zmq_pollitem_t item{client.get(), 0, ZMQ_POLLIN, 0};
    ZmqMessage answer;
    if (zmq_poll(&item, 1, std::chrono::duration_cast<milliseconds>(kLong).count()) <= 0 || !answer.receive(client))
      break;
  }

  EXPECT_EQ(answered, kAll);
}

TEST(Control, ForbidsChangesToAViewer) {
  EchoingDaemon daemon({.endpoint = {}, .role_without_keys = Role::Viewer});
  const auto client = daemon.client();

  const v1::Answer status = ask(*client, ControlRequest{});
  const v1::Answer reset = ask(*client, reset_of("anna"));

  EXPECT_EQ(status.code(), v1::CODE_DONE);
  EXPECT_EQ(status.status().role(), "viewer");
  EXPECT_EQ(reset.code(), v1::CODE_FORBIDDEN);
}

TEST(Control, AppliesTheRoleOfEachKey) {
  support::TemporaryFolder folder;
  const KeyPair server = *new_key_pair(), anna = *new_key_pair(), ben = *new_key_pair();
  ASSERT_TRUE(save_key_pair(folder.path() / "server.key", server));
  ASSERT_TRUE(save_allowed_keys(folder.path() / "allowed",
                                {{anna.public_key, Role::Operator, "anna"}, {ben.public_key, Role::Viewer, "ben"}}));
  EchoingDaemon daemon({.endpoint = {}, .curve = {folder.path() / "server.key", folder.path() / "allowed"}});

  EXPECT_EQ(ask(*daemon.client(server.public_key, anna), reset_of("x")).code(), v1::CODE_DONE);
  EXPECT_EQ(ask(*daemon.client(server.public_key, ben), reset_of("x")).code(), v1::CODE_FORBIDDEN);
  EXPECT_FALSE(daemon.client(server.public_key, *new_key_pair())->ask(std::string(), milliseconds(300)));
  EXPECT_FALSE(daemon.client()->ask(std::string(), milliseconds(300)));
}

// Remembers the entries of the audit log.
class Remembered final : public AuditTrail {
 public:
  void note(AuditEntry entry) override {
    const std::lock_guard lock(mutex_);
    entries_.push_back(std::move(entry));
  }
  bool write(AuditEntry entry, Duration) override {
    note(std::move(entry));
    return true;
  }
  AuditHealth health() const override { return {}; }

  std::vector<AuditEntry> of(const std::string& what) const {
    const std::lock_guard lock(mutex_);
    std::vector<AuditEntry> found;
    std::ranges::copy_if(entries_, std::back_inserter(found),
                         [&](const AuditEntry& each) { return each.what == what; });
    return found;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<AuditEntry> entries_;
};

TEST(Control, NotesWhoConnectedAndWhoWasRefusedWhat) {
  support::TemporaryFolder folder;
  const KeyPair server = *new_key_pair(), ben = *new_key_pair(), stranger = *new_key_pair();
  ASSERT_TRUE(save_key_pair(folder.path() / "server.key", server));
  ASSERT_TRUE(save_allowed_keys(folder.path() / "allowed", {{ben.public_key, Role::Viewer, "ben"}}));
  Remembered audit;
  EchoingDaemon daemon({.endpoint = {}, .curve = {folder.path() / "server.key", folder.path() / "allowed"}}, {},
                       &audit);
  ControlRequest reset = reset_of("x");
  reset.by.states = "anna";

  EXPECT_EQ(ask(*daemon.client(server.public_key, ben), reset).code(), v1::CODE_FORBIDDEN);
  EXPECT_FALSE(daemon.client(server.public_key, stranger)->ask(std::string(), milliseconds(300)));
  while (audit.of("disconnected").empty() || audit.of("refused").size() < 2) std::this_thread::yield();

  const auto connected = audit.of("connected"), refused = audit.of("refused");
  ASSERT_EQ(connected.size(), 1U);
  EXPECT_EQ(connected[0].who.name, "ben");
  EXPECT_EQ(connected[0].who.key, ben.public_key);
  EXPECT_THAT(connected[0].who.address, HasSubstr("127.0.0.1:"));
  EXPECT_EQ(refused[0].who.name, "ben");
  EXPECT_EQ(refused[0].who.states, "anna");
  EXPECT_THAT(refused[0].details, ::testing::Contains(::testing::Pair("order", "subject")));
  EXPECT_EQ(refused[1].who.key, stranger.public_key);
}

TEST(Control, PassesOnWhoAsks) {
  Remembered audit;
  ControlRequest reset = reset_of("x");
  reset.by.states = "anna";
  EchoingDaemon daemon({}, {}, &audit);

  EXPECT_EQ(ask(*daemon.client(), reset).message(), "x anna operator");

  v1::Request request = encode(reset);
  request.set_asked_by(std::string(65, 'a'));
  EXPECT_THAT(ask(*daemon.client(), request.SerializeAsString()).message(), HasSubstr("asked_by has 65 bytes"));
}

TEST(ControlCodec, RoundTrips) {
  ControlRequest fit;
  fit.action = ControlAction::FitSubject;
  fit.name = "anna";
  fit.rest_offsets_m = {{0.0, 0.5, 1.0}, {0.25, 0.0, 0.0}};
  fit.marker_offsets_m = {{0.125, 0.0, 0.0}};
  fit.residual_m = 0.003;
  ControlRequest camera;
  camera.action = ControlAction::AdjustCamera;
  camera.name = "north";
  camera.exposure_us = 800.0;

  const auto read_fit = decode(encode(fit));
  const auto read_camera = decode(encode(camera));

  ASSERT_TRUE(read_fit && read_camera);
  EXPECT_EQ(read_fit->action, ControlAction::FitSubject);
  EXPECT_EQ(read_fit->rest_offsets_m, fit.rest_offsets_m);
  EXPECT_EQ(read_fit->marker_offsets_m, fit.marker_offsets_m);
  EXPECT_EQ(read_camera->exposure_us, 800.0);
  EXPECT_FALSE(read_camera->gain_db);
  for (const auto action : {ControlAction::GetStatus, ControlAction::GetDescription, ControlAction::GetSnapshot,
                            ControlAction::StartCapture, ControlAction::StopCapture, ControlAction::AddSubject,
                            ControlAction::RemoveSubject, ControlAction::LearnMask, ControlAction::Reload}) {
    ControlRequest request;
    request.action = action;
    EXPECT_EQ(decode(encode(request))->action, action);
  }
}

TEST(ControlCodec, RoundTripsTheOrdersOfTakes) {
  ControlRequest start;
  start.action = ControlAction::Take;
  start.take = {.action = TakeAction::Start,
                .name = "walk",
                .slate = "12A",
                .text = "first try",
                .before = std::chrono::seconds(20),
                .length = std::chrono::milliseconds(1500),
                .countdown = std::chrono::seconds(3),
                .at_utc_ns = 5};

  const auto read = decode(encode(start));

  ASSERT_TRUE(read);
  EXPECT_FALSE(only_looks(read->action));
  EXPECT_EQ(read->take.name, "walk");
  EXPECT_EQ(read->take.slate, "12A");
  EXPECT_EQ(read->take.text, "first try");
  EXPECT_EQ(read->take.before, start.take.before);
  EXPECT_EQ(read->take.length, start.take.length);
  EXPECT_EQ(read->take.countdown, start.take.countdown);
  EXPECT_EQ(read->take.at_utc_ns, 5);
  for (const auto action :
       {TakeAction::Start, TakeAction::Stop, TakeAction::Cancel, TakeAction::Mark, TakeAction::Next}) {
    start.take.action = action;
    EXPECT_EQ(decode(encode(start))->take.action, action);
  }
  start.take.at_utc_ns = 0;
  start.take.at_timecode = Timecode{10, 2, 3, 4, 25};
  EXPECT_EQ(decode(encode(start))->take.at_timecode, start.take.at_timecode);
  v1::Request both = encode(start);
  both.mutable_take()->set_at_utc_ns(1);
  EXPECT_THAT(decode(both).error().message, HasSubstr("both set"));
  both.mutable_take()->clear_at_utc_ns();
  both.mutable_take()->mutable_at_timecode()->set_hours(24);
  EXPECT_THAT(decode(both).error().message, HasSubstr("at_timecode is 24:2:3, expected"));
  v1::Request wrong = encode(start);
  wrong.mutable_take()->set_before_s(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(decode(wrong).error().message, HasSubstr("before_s is nan, expected 0 to"));
}

TEST(ControlCodec, RoundTripsShots) {
  ControlRequest filling;
  filling.action = ControlAction::Take;
  filling.take.action = TakeAction::ImportShots;
  filling.take.shots = {{"walk", "A1", "slow", std::chrono::seconds(5), true}, {"run", "", "", {}, false}};
  ControlRequest list, clear = filling;
  list.action = ControlAction::GetShots;
  clear.take = {.action = TakeAction::ClearShots};

  const auto read = decode(encode(filling));

  ASSERT_TRUE(read);
  EXPECT_FALSE(only_looks(read->action));
  EXPECT_EQ(read->take.action, TakeAction::ImportShots);
  EXPECT_EQ(read->take.shots, filling.take.shots);
  EXPECT_EQ(decode(encode(list))->action, ControlAction::GetShots);
  EXPECT_TRUE(only_looks(ControlAction::GetShots));
  EXPECT_EQ(decode(encode(clear))->take.action, TakeAction::ClearShots);
  v1::Request wrong = encode(filling);
  wrong.mutable_shots()->mutable_shots(0)->set_seconds(-1.0);
  EXPECT_THAT(decode(wrong).error().message, HasSubstr("seconds is -1"));
  wrong.mutable_shots()->clear_shots();
  EXPECT_THAT(decode(wrong).error().message, HasSubstr("shots has 0 entries, expected 1 to 500"));
  wrong.mutable_shots()->clear_action();
  EXPECT_THAT(decode(wrong).error().message, HasSubstr("action is missing"));
}

TEST(ControlCodec, EncodesTheShotsOfAnAnswer) {
  ControlAnswer answer;
  answer.shots = {{"walk", "A1", "slow", std::chrono::seconds(5), true}};

  const v1::Answer message = encode(answer);

  ASSERT_EQ(message.shots().shots_size(), 1);
  EXPECT_EQ(message.shots().shots(0).name(), "walk");
  EXPECT_EQ(message.shots().shots(0).seconds(), 5.0);
  EXPECT_TRUE(message.shots().shots(0).done());
  EXPECT_FALSE(encode(ControlAnswer{}).has_shots());
}

TEST(ControlCodec, AcceptsANewSubjectOnlyIfItCanBeQuotedInAConfiguration) {
  v1::Request request;
  v1::SubjectRequest& subject = *request.mutable_subject();
  subject.set_action(v1::SubjectRequest::ACTION_ADD);
  subject.set_name("ben 2");
  subject.set_marker_set("/sets/rigid3.toml");
  ASSERT_TRUE(decode(request));
  EXPECT_EQ(decode(request)->marker_set, "/sets/rigid3.toml");
  EXPECT_EQ(decode(encode(*decode(request)))->marker_set, "/sets/rigid3.toml");

  for (const char* path : {"sets/rigid3.toml", "/a\"\n[control]\nendpoint = \"tcp://0.0.0.0:1", "/a\\"}) {
    subject.set_marker_set(path);
    EXPECT_THAT(decode(request).error().message, HasSubstr("marker_set is not an absolute path")) << path;
  }
  subject.set_marker_set("/sets/rigid3.toml");
  for (const char* name : {"", "a\"b", "a\nb"}) {
    subject.set_name(name);
    EXPECT_THAT(decode(request).error().message, HasSubstr("name is empty, or has quotes")) << name;
  }
}

TEST(ControlRequest, OfANewSubjectMayHaveTheContentOfItsMarkerSet) {
  v1::Request request;
  v1::SubjectRequest& subject = *request.mutable_subject();
  subject.set_action(v1::SubjectRequest::ACTION_ADD);
  subject.set_name("anna 2");
  subject.set_marker_set_text("name = \"anna\"\n");
  ASSERT_TRUE(decode(request));
  EXPECT_EQ(decode(encode(*decode(request)))->marker_set_text, "name = \"anna\"\n");

  for (const char* name : {"", "../anna", ".anna", "a\"b"}) {
    subject.set_name(name);
    EXPECT_THAT(decode(request).error().message, HasSubstr("expected at most 64 letters")) << name;
  }
  subject.set_name("anna");
  subject.set_marker_set("/sets/rigid3.toml");
  EXPECT_THAT(decode(request).error().message, HasSubstr("are both set"));
  subject.clear_marker_set();
  subject.set_marker_set_text(std::string(48 * 1024 + 1, 'x'));
  EXPECT_THAT(decode(request).error().message, HasSubstr("marker_set_text has 49153 bytes"));
}

TEST(ControlCodec, NamesTheFault) {
  v1::Request request;
  request.mutable_camera()->set_exposure_us(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(decode(request).error().message, HasSubstr("exposure_us is nan, expected 1 to"));
  request.mutable_camera()->Clear();
  EXPECT_THAT(decode(request).error().message, HasSubstr("nothing to set"));
  request.mutable_capture();
  EXPECT_THAT(decode(request).error().message, HasSubstr("expected start or stop"));
  request.mutable_subject()->set_action(v1::SubjectRequest::ACTION_FIT);
  request.mutable_subject()->add_rest_offsets_m(1.0);
  EXPECT_THAT(decode(request).error().message, HasSubstr("rest_offsets_m has 1 numbers"));
  request.mutable_mask()->set_images(1);
  EXPECT_THAT(decode(request).error().message, HasSubstr("images is 1, expected 10 to"));
}

TEST(ControlEndpoint, IsDerivedFromTheFeedsEndpoint) {
  EXPECT_EQ(control_beside("tcp://127.0.0.1:5570"), "tcp://127.0.0.1:5571");
  EXPECT_EQ(control_beside("tcp://[::1]:5570"), "tcp://[::1]:5571");
  EXPECT_EQ(control_beside("tcp://127.0.0.1:*"), "tcp://127.0.0.1:*");
  EXPECT_EQ(control_beside("ipc:///run/mocapd/feed"), "ipc:///run/mocapd/feed.control");
}

}  // namespace zmq_control_test
}  // namespace mocap::wire
