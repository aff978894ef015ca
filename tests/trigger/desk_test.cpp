#include "trigger/desk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "model/search_health.h"
#include "trigger/ip4.h"
#include "trigger/osc_packet.h"
#include "trigger/xml_packet.h"

namespace mocap::trigger {
namespace desk_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Peer kController{*read_address("10.0.0.7"), 4000};
const Peer kSecond{*read_address("10.0.0.8"), 4000};
const Peer kUnlisted{*read_address("10.0.0.66"), 4000};
const Peer kFollower{*read_address("10.0.0.9"), 30};
constexpr std::size_t kXml = 0, kXsens = 1, kOsc = 2, kAnswers = 3;
constexpr std::uint64_t kFirstId = 1000;

TriggerSettings both_directions() {
  TriggerSettings settings;
  settings.listen = "0.0.0.0";
  settings.senders = {"10.0.0.7", "10.0.0.8", "10.0.0.9"};
  settings.xsens_ports = {6004};
  settings.osc_ports = {8000};
  settings.xml_receivers = {"10.0.0.9:30"};
  return settings;
}

TakeHealth take_in(TakeState state, const std::string& name, std::uint64_t takes = 1) {
  TakeHealth take;
  take.state = state;
  take.name = bounded_text<255>(name);
  take.path = bounded_text<1023>("/takes/" + name + ".mcap");
  take.takes = takes;
  return take;
}

std::string start_packet(const std::string& name, const std::string& id) {
  return write_capture({.verb = Verb::Start, .name = name, .packet_id = id});
}

std::string stop_packet(const std::string& name, const std::string& id, const char* result = "SUCCESS") {
  return write_capture({.verb = Verb::Stop, .result = result, .name = name, .packet_id = id});
}

// The answers and packets that the desk is expected to send.
std::string started(const std::string& name, const std::string& id) {
  return write_capture({.verb = Verb::Start, .name = name, .database_path = "/takes", .packet_id = id});
}
std::string stopped(const std::string& name, const std::string& id, const char* result = "SUCCESS") {
  return write_capture(
      {.verb = Verb::Stop, .result = result, .name = name, .database_path = "/takes", .packet_id = id});
}
std::string completed(const std::string& name, const std::string& id, const char* result = "SUCCESS") {
  return write_capture(
      {.verb = Verb::Complete, .result = result, .name = name, .database_path = "/takes", .packet_id = id});
}

class DeskTest : public testing::Test {
 protected:
  TriggerActions receive(const std::string& bytes, const Peer& from = kController, std::size_t socket = kXml) {
    return desk->receive({socket, from, bytes}, now);
  }
  TriggerActions hear(std::uint64_t order, TakeOutcome outcome, const TakeHealth& take, std::string message = "") {
    return desk->hear({order, TakeDone{order, outcome, std::move(message)}, take}, now);
  }
  TriggerActions hear(const TakeHealth& take) { return desk->hear({0, std::nullopt, take}, now); }
  TriggerActions hear_executing(std::uint64_t order, const TakeHealth& take) {
    return desk->hear({order, std::nullopt, take}, now);
  }

  // The controller starts 'walk' with order 1.
  TriggerActions start_walk() {
    receive(start_packet("walk", "7"));
    return hear(1, TakeOutcome::Done, take_in(TakeState::Recording, "walk"));
  }

  static std::vector<std::string> sent_to(const Peer& to, const TriggerActions& actions) {
    std::vector<std::string> bytes;
    for (const Datagram& packet : actions.packets) {
      if (packet.peer == to) bytes.push_back(packet.bytes);
    }
    return bytes;
  }

  Timestamp now = from_ns(1'000'000'000);
  std::unique_ptr<TriggerDesk> desk = make_desk(both_directions(), kFirstId);
};

TEST_F(DeskTest, OrdersATakeAndAnswersWhenItIsRecorded) {
  const TriggerActions ordered = receive(write_capture({.verb = Verb::Start,
                                                        .name = "walk",
                                                        .notes = "first",
                                                        .description = "with a prop",
                                                        .delay = milliseconds(33),
                                                        .packet_id = "7"}));
  ASSERT_TRUE(ordered.order);
  EXPECT_EQ(ordered.order->action, TakeAction::Start);
  EXPECT_EQ(ordered.order->name, "walk");
  EXPECT_EQ(ordered.order->text, "first\nwith a prop");
  EXPECT_EQ(ordered.order->countdown, milliseconds(33));
  EXPECT_THAT(ordered.packets, IsEmpty());

  const TriggerActions answered = hear(ordered.order->number, TakeOutcome::Done, take_in(TakeState::Waiting, "walk"));

  EXPECT_THAT(sent_to(kController, answered), ElementsAre(write_capture({.verb = Verb::Start,
                                                                         .name = "walk",
                                                                         .notes = "first",
                                                                         .description = "with a prop",
                                                                         .database_path = "/takes",
                                                                         .delay = milliseconds(33),
                                                                         .packet_id = "7"})));
  EXPECT_THAT(sent_to(kFollower, answered), IsEmpty());
  EXPECT_THAT(sent_to(kFollower, hear(take_in(TakeState::Recording, "walk"))), ElementsAre(started("walk", "1000")));
}

TEST_F(DeskTest, AnswersAStopAtOnceAndCompletesWhenTheFileIsOnTheDisk) {
  EXPECT_THAT(sent_to(kController, start_walk()), ElementsAre(started("walk", "7")));

  const TriggerActions ordered = receive(stop_packet("walk", "8"));
  ASSERT_TRUE(ordered.order);
  EXPECT_EQ(ordered.order->action, TakeAction::Stop);
  const TriggerActions executing = hear_executing(2, take_in(TakeState::Recording, "walk"));
  EXPECT_THAT(sent_to(kController, executing), ElementsAre(stopped("walk", "8")));
  EXPECT_THAT(sent_to(kFollower, executing), ElementsAre(stopped("walk", "1001")));

  const TriggerActions ended = hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "walk"));
  EXPECT_THAT(sent_to(kController, ended), ElementsAre(completed("walk", "8")));
  EXPECT_THAT(sent_to(kFollower, ended), ElementsAre(completed("walk", "1002")));
}

TEST_F(DeskTest, ExecutesARepeatOnceAndAnswersItAgain) {
  start_walk();
  const TriggerActions again = receive(start_packet("walk", "7"));
  EXPECT_FALSE(again.order);
  EXPECT_THAT(sent_to(kController, again), ElementsAre(started("walk", "7")));

  receive(stop_packet("walk", "8"));
  EXPECT_FALSE(receive(stop_packet("walk", "8")).order);
  hear_executing(2, take_in(TakeState::Recording, "walk"));
  hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "walk"));
  EXPECT_THAT(sent_to(kController, receive(stop_packet("walk", "8"))),
              ElementsAre(stopped("walk", "8"), completed("walk", "8")));
  EXPECT_FALSE(receive(start_packet("walk", "7")).order);  // a late copy starts no other take
  now += seconds(61);
  EXPECT_TRUE(receive(start_packet("walk", "7")).order);
}

TEST_F(DeskTest, AnswersARefusedStartWithAFailedStop) {
  receive(start_packet("walk", "7"));

  const TriggerActions refused = hear(1, TakeOutcome::Failed, take_in(TakeState::None, ""), "the disk is full");

  const std::string answer = write_capture(
      {.verb = Verb::Stop, .result = "FAIL", .name = "walk", .notes = "the disk is full", .packet_id = "7"});
  EXPECT_THAT(sent_to(kController, refused), ElementsAre(answer));
  ASSERT_EQ(refused.lines.size(), 1U);
  EXPECT_TRUE(refused.lines[0].refused);
  EXPECT_THAT(refused.lines[0].text, HasSubstr("refused start from 10.0.0.7: the disk is full"));
  const TriggerActions again = receive(start_packet("walk", "7"));
  EXPECT_FALSE(again.order);
  EXPECT_THAT(sent_to(kController, again), ElementsAre(answer));
}

TEST_F(DeskTest, ExecutesAStopThatOvertookItsStart) {
  EXPECT_TRUE(receive(stop_packet("walk", "8")).order);
  hear(1, TakeOutcome::NotFound, take_in(TakeState::None, ""), "no take is being recorded");
  receive(start_packet("walk", "7"));
  hear(2, TakeOutcome::Done, take_in(TakeState::Recording, "walk"));

  EXPECT_TRUE(receive(stop_packet("walk", "8")).order);
}

TEST_F(DeskTest, DoesNotStopAnotherTake) {
  start_walk();

  const TriggerActions refused = receive(stop_packet("run", "8"));

  EXPECT_FALSE(refused.order);
  ASSERT_EQ(refused.packets.size(), 1U);
  EXPECT_THAT(refused.packets[0].bytes, HasSubstr("RESULT=\"FAIL\""));
  EXPECT_TRUE(receive(stop_packet("", "9")).order);
}

TEST_F(DeskTest, RefusesSendersThatAreNotListedSilently) {
  const TriggerActions refused = receive(start_packet("walk", "7"), kUnlisted);

  EXPECT_FALSE(refused.order);
  EXPECT_THAT(refused.packets, IsEmpty());
  ASSERT_EQ(refused.lines.size(), 1U);
  EXPECT_THAT(refused.lines[0].text, HasSubstr("10.0.0.66, not in [trigger] senders"));
  EXPECT_THAT(receive(start_packet("walk", "7"), kUnlisted).lines, IsEmpty());
}

TEST_F(DeskTest, LogsWhyAPacketIsRefused) {
  const TriggerActions refused = receive("<CaptureStart>\x1b[31m");

  EXPECT_THAT(refused.packets, IsEmpty());
  ASSERT_EQ(refused.lines.size(), 1U);
  EXPECT_THAT(refused.lines[0].text, HasSubstr("refused a packet from 10.0.0.7: not one complete XML document"));
  Datagram cut{kXml, kController, "<CaptureStart/>", true};
  EXPECT_THAT(desk->receive(cut, now).lines[0].text, HasSubstr("over 8192 bytes"));
}

TEST_F(DeskTest, TellsReceiversOfTakesThatOthersStart) {
  EXPECT_THAT(sent_to(kFollower, hear(take_in(TakeState::Recording, "run"))), ElementsAre(started("run", "1000")));
  EXPECT_THAT(hear(take_in(TakeState::Recording, "run")).packets, IsEmpty());
  EXPECT_THAT(sent_to(kFollower, hear(take_in(TakeState::Failed, "run"))),
              ElementsAre(stopped("run", "1001", "FAIL"), completed("run", "1002", "FAIL")));
  EXPECT_THAT(hear(take_in(TakeState::Failed, "run")).packets, IsEmpty());
}

TEST_F(DeskTest, TellsReceiversOfATakeThatFollowsTheLastAtOnce) {
  hear(take_in(TakeState::Recording, "run_001"));

  EXPECT_THAT(sent_to(kFollower, hear(take_in(TakeState::Recording, "run_002", 2))),
              ElementsAre(stopped("run_001", "1001"), completed("run_001", "1002"), started("run_002", "1003")));
}

TEST_F(DeskTest, DoesNotTellAReceiverWhatTheReceiverOrdered) {
  receive(start_packet("walk", "7"), kFollower);
  const TriggerActions start = hear(1, TakeOutcome::Done, take_in(TakeState::Recording, "walk"));
  receive(stop_packet("walk", "8"), kFollower);
  const TriggerActions stop = hear_executing(2, take_in(TakeState::Recording, "walk"));
  const TriggerActions end = hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "walk"));

  EXPECT_THAT(sent_to(kFollower, start), ElementsAre(started("walk", "7")));  // its answer
  EXPECT_THAT(sent_to(kFollower, stop), ElementsAre(stopped("walk", "8")));
  EXPECT_THAT(sent_to(kFollower, end), ElementsAre(completed("walk", "8")));
}

TEST_F(DeskTest, TakesAnEchoOfItsOwnPacketsAsNoOrder) {
  hear(take_in(TakeState::Recording, "run"));  // notified with PacketID 1000

  for (const auto& [from, socket] : {std::pair(kFollower, kAnswers), std::pair(kController, kXml)}) {
    const TriggerActions echoed = receive(start_packet("run", "1000"), from, socket);
    EXPECT_FALSE(echoed.order);
    EXPECT_THAT(echoed.packets, IsEmpty());
    EXPECT_THAT(echoed.lines[0].text, HasSubstr("confirms start of 'run'"));
  }
  EXPECT_TRUE(receive(stop_packet("run", "1000", "FAIL"), kFollower, kAnswers).lines[0].refused);
}

// A notifies B, B notifies C, C notifies A.
TEST_F(DeskTest, EndsACircleOfProgramsThatTellEachOther) {
  hear(take_in(TakeState::Recording, "run"));

  const TriggerActions start = receive(start_packet("run", "55"), kSecond);
  EXPECT_FALSE(start.order);
  EXPECT_THAT(sent_to(kSecond, start), ElementsAre(started("run", "55")));
  EXPECT_THAT(sent_to(kFollower, start), IsEmpty());

  hear(take_in(TakeState::Ended, "run"));
  const TriggerActions stop = receive(stop_packet("run", "56"), kSecond);
  EXPECT_FALSE(stop.order);
  EXPECT_THAT(sent_to(kSecond, stop), ElementsAre(stopped("run", "56"), completed("run", "56")));
}

TEST_F(DeskTest, AcceptsNoOrderOnTheSocketOfAnswers) {
  const TriggerActions refused = receive(start_packet("walk", "7"), kFollower, kAnswers);

  EXPECT_FALSE(refused.order);
  EXPECT_THAT(refused.packets, IsEmpty());
  EXPECT_THAT(refused.lines[0].text, HasSubstr("10.0.0.9 answers: <?xml"));
  EXPECT_THAT(receive("x", kUnlisted, kAnswers).lines[0].text, HasSubstr("not in [trigger] senders"));
}

TEST_F(DeskTest, NotesThatAnotherProgramHasItsFile) {
  const TriggerActions noted = receive(write_capture({.verb = Verb::Complete, .result = "SUCCESS", .name = "walk"}));

  EXPECT_FALSE(noted.order);
  EXPECT_THAT(noted.packets, IsEmpty());
}

TEST_F(DeskTest, TellsTheStarterThatItsTakeEndedEarly) {
  start_walk();

  EXPECT_THAT(sent_to(kController, hear(take_in(TakeState::Failed, "walk"))),
              ElementsAre(completed("walk", "7", "FAIL")));
}

TEST_F(DeskTest, TellsTheStarterThatItsTakeDoesNotStart) {
  receive(start_packet("walk", "7"));
  hear(1, TakeOutcome::Done, take_in(TakeState::Waiting, "walk"));

  const TriggerActions failed = hear(take_in(TakeState::Failed, "walk"));

  ASSERT_EQ(sent_to(kController, failed).size(), 1U);
  EXPECT_THAT(sent_to(kController, failed)[0], HasSubstr("<CaptureStop RESULT=\"FAIL\">"));
}

TEST_F(DeskTest, AttachesASecondStopToTheFirst) {
  start_walk();
  receive(stop_packet("walk", "8"));
  hear_executing(2, take_in(TakeState::Recording, "walk"));

  const TriggerActions second = receive(stop_packet("walk", "3"), kSecond);
  EXPECT_FALSE(second.order);
  EXPECT_THAT(sent_to(kSecond, second), ElementsAre(stopped("walk", "3")));

  const TriggerActions ended = hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "walk"));
  EXPECT_THAT(sent_to(kController, ended), ElementsAre(completed("walk", "8")));
  EXPECT_THAT(sent_to(kSecond, ended), ElementsAre(completed("walk", "3")));
}

TEST_F(DeskTest, AnswersAStartThatWaitsForTheEndOfTheTakeBefore) {
  start_walk();
  receive(stop_packet("walk", "8"));
  hear_executing(2, take_in(TakeState::Recording, "walk"));
  receive(start_packet("run", "9"));

  EXPECT_THAT(hear_executing(3, take_in(TakeState::Recording, "walk")).packets, IsEmpty());
  hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "walk"));
  const TriggerActions answered = hear(3, TakeOutcome::Done, take_in(TakeState::Recording, "run", 2));

  EXPECT_THAT(sent_to(kController, answered), ElementsAre(started("run", "9")));
}

TEST_F(DeskTest, StopsATakeThatIsAboutToStart) {
  start_walk();
  receive(stop_packet("walk", "8"));
  hear_executing(2, take_in(TakeState::Recording, "walk"));
  receive(start_packet("run", "9"));
  hear_executing(3, take_in(TakeState::Recording, "walk"));

  const TriggerActions ordered = receive(stop_packet("run", "10"));
  ASSERT_TRUE(ordered.order);
  EXPECT_EQ(ordered.order->action, TakeAction::Stop);
  EXPECT_EQ(ordered.order->name, "run");
  hear(3, TakeOutcome::Failed, take_in(TakeState::Recording, "walk"), "a stop came first");
  const TriggerActions answered = hear(4, TakeOutcome::Done, take_in(TakeState::Recording, "walk"));
  const TriggerActions ended = hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "walk"));

  EXPECT_THAT(sent_to(kController, answered),
              ElementsAre(write_capture({.verb = Verb::Stop, .result = "CANCEL", .name = "run", .packet_id = "10"})));
  EXPECT_THAT(sent_to(kController, ended), ElementsAre(completed("walk", "8")));
}

TEST_F(DeskTest, TakesAStopAfterAStartForNoRepeatOfTheStopBefore) {
  const std::string start = write_osc("/RecordStart", {"walk", 3}), stop = write_osc("/RecordStop", {});
  receive(start, kController, kOsc);
  hear(1, TakeOutcome::Done, take_in(TakeState::Recording, "walk_003"));
  receive(stop, kController, kOsc);
  hear_executing(2, take_in(TakeState::Recording, "walk_003"));
  receive(write_osc("/RecordStart", {"walk", 4}), kController, kOsc);
  hear_executing(3, take_in(TakeState::Recording, "walk_003"));

  EXPECT_TRUE(receive(stop, kController, kOsc).order);
  EXPECT_FALSE(receive(stop, kController, kOsc).order);  // this one is a repeat
}

TEST_F(DeskTest, CancelsATake) {
  start_walk();
  const TriggerActions ordered = receive(stop_packet("walk", "8", "CANCEL"));
  ASSERT_TRUE(ordered.order);
  EXPECT_EQ(ordered.order->action, TakeAction::Cancel);

  const TriggerActions cancelled = hear(2, TakeOutcome::Done, take_in(TakeState::Cancelled, "walk"));

  EXPECT_THAT(sent_to(kController, cancelled),
              ElementsAre(stopped("walk", "8", "CANCEL"), completed("walk", "8", "CANCEL")));
  EXPECT_THAT(sent_to(kFollower, cancelled),
              ElementsAre(stopped("walk", "1001", "CANCEL"), completed("walk", "1002", "CANCEL")));
}

TEST_F(DeskTest, AnswersXsensInItsOwnWords) {
  receive(R"(<StartRecordingReq SessionName="C:/mvn/walk"/>)", kController, kXsens);
  const TriggerActions start = hear(1, TakeOutcome::Done, take_in(TakeState::Recording, "walk"));
  receive("<StopRecordingReq/>", kController, kXsens);
  const TriggerActions stop = hear_executing(2, take_in(TakeState::Recording, "walk"));
  const TriggerActions end = hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "walk"));

  EXPECT_THAT(sent_to(kController, start), ElementsAre(write_ack(Verb::Start, Dialect::Recording, "")));
  EXPECT_THAT(sent_to(kController, stop), ElementsAre(write_ack(Verb::Stop, Dialect::Recording, "")));
  EXPECT_THAT(sent_to(kController, end), IsEmpty());
}

TEST_F(DeskTest, ConfirmsOscWhenTheFileIsOnTheDisk) {
  const TriggerActions ordered = receive(write_osc("/RecordStart", {"walk", 3}), kController, kOsc);
  ASSERT_TRUE(ordered.order);
  EXPECT_EQ(ordered.order->name, "walk_003");
  EXPECT_EQ(ordered.order->slate, "walk");
  const TriggerActions start = hear(1, TakeOutcome::Done, take_in(TakeState::Recording, "walk_003"));
  receive(write_osc("/RecordStop", {}), kController, kOsc);
  const TriggerActions stop = hear_executing(2, take_in(TakeState::Recording, "walk_003"));
  const TriggerActions end = hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "walk_003"));

  EXPECT_THAT(sent_to(kController, start), ElementsAre(write_osc("/RecordStartConfirm", {"00:00:00.000"})));
  EXPECT_THAT(sent_to(kController, stop), IsEmpty());
  EXPECT_THAT(sent_to(kController, end),
              ElementsAre(write_osc("/RecordStopConfirm", {"00:00:00.000", "walk_003", "/takes/walk_003.mcap"})));
}

TEST_F(DeskTest, TakesEqualPacketsWithoutAPacketIdAsRepeatsWhileTheTakeIsUnchanged) {
  const std::string start = "<CaptureStart/>", stop = "<CaptureStop/>";
  EXPECT_TRUE(receive(start).order);
  EXPECT_FALSE(receive(start).order);  // no answer yet
  hear(1, TakeOutcome::Done, take_in(TakeState::Recording, "take_001"));
  EXPECT_FALSE(receive(start).order);
  EXPECT_TRUE(receive(stop).order);
  EXPECT_FALSE(receive(stop).order);
  hear_executing(2, take_in(TakeState::Recording, "take_001"));
  hear(2, TakeOutcome::Done, take_in(TakeState::Ended, "take_001"));
  EXPECT_FALSE(receive(stop).order);

  EXPECT_TRUE(receive(start).order);
  hear(3, TakeOutcome::Done, take_in(TakeState::Recording, "take_002", 2));
  EXPECT_TRUE(receive(stop).order);
}

TEST_F(DeskTest, SendsAnswersToTheConfiguredPorts) {
  TriggerSettings settings = both_directions();
  settings.xml_answer_port = 6005;
  desk = make_desk(settings, kFirstId);

  EXPECT_THAT(sent_to({kController.address, 6005}, start_walk()), ElementsAre(started("walk", "7")));
}

TEST_F(DeskTest, TellsReceiversOfOsc) {
  TriggerSettings settings = both_directions();
  settings.xml_receivers.clear();
  settings.osc_receivers = {"10.0.0.9:30"};
  desk = make_desk(settings, kFirstId);

  EXPECT_THAT(sent_to(kFollower, hear(take_in(TakeState::Recording, "run"))),
              ElementsAre(write_osc("/RecordStart", {"run", 1})));
  EXPECT_THAT(sent_to(kFollower, hear(take_in(TakeState::Ended, "run"))), ElementsAre(write_osc("/RecordStop", {})));
}

TEST_F(DeskTest, KnowsTheTakeOfTheRecorderAfterAReload) {
  const TriggerActions ordered = receive(stop_packet("walk", "8"));  // the desk does not know of a take
  ASSERT_TRUE(ordered.order);

  EXPECT_THAT(sent_to(kController, hear_executing(1, take_in(TakeState::Recording, "walk"))),
              ElementsAre(stopped("walk", "8")));
  EXPECT_THAT(sent_to(kController, hear(1, TakeOutcome::Done, take_in(TakeState::Ended, "walk"))),
              ElementsAre(completed("walk", "8")));
}

TEST_F(DeskTest, RefusesOrdersWhileTheRecorderIsSilent) {
  for (int i = 0; i < 64; ++i) EXPECT_TRUE(receive(start_packet("walk", std::to_string(i))).order);

  const TriggerActions refused = receive(start_packet("walk", "64"));

  EXPECT_FALSE(refused.order);
  EXPECT_THAT(refused.lines[0].text, HasSubstr("the recorder does not answer"));
}

}  // namespace desk_test
}  // namespace mocap::trigger
