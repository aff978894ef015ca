#include "trigger/xml_packet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mocap::trigger {
namespace xml_packet_test {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using namespace std::string_literals;

std::string why_refused(const std::string& packet) {
  const auto request = read_xml(packet, false);
  return request ? std::string() : request.error().message;
}

// As Vicon documents it, with the zero byte at its end.
const std::string kStart =
    R"(<?xml version="1.0" encoding="UTF-8" standalone="no"?>)"
    R"(<CaptureStart><Name VALUE="dance"/><Notes VALUE="The pets &amp; ants"/><Description VALUE="a &quot;jump&quot;"/>)"
    R"(<DatabasePath VALUE="D:/Captures/Take"/><Delay VALUE="33"/><PacketID VALUE="33360"/></CaptureStart>)"
    "\0"s;

TEST(XmlPacket, ReadsAStart) {
  const auto request = read_xml(kStart, false);

  ASSERT_TRUE(request) << request.error().message;
  EXPECT_EQ(request->verb, Verb::Start);
  EXPECT_EQ(request->dialect, Dialect::Capture);
  EXPECT_EQ(request->name, "dance");
  EXPECT_EQ(request->notes, "The pets & ants");
  EXPECT_EQ(request->description, "a \"jump\"");
  EXPECT_EQ(request->packet_id, "33360");
  EXPECT_EQ(request->delay, milliseconds(33));
}

TEST(XmlPacket, ReadsThePacketsOfSeveralMakers) {
  const std::pair<std::string, Verb> packets[] = {
      {"\n<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"no\" ?>\n<CaptureStart>\n<Name VALUE=\"a\"/>\n"
       "<Delay VALUE = \"250\"/>\n</CaptureStart>\n",
       Verb::Start},
      {R"(<CaptureStart><Name VALUE="a"/><SessionName VALUE=""/><Assets VALUE="RigidBody1"/>)"
       R"(<TimeCode VALUE="00:00:00:00"/><HostName VALUE="x"/><ProcessID VALUE="22236"/></CaptureStart>)",
       Verb::Start},
      {"<CaptureStart><Name VALUE=\"a\" /><TimeCode VALUE=\"\" /><Notes></Notes></CaptureStart>\n", Verb::Start},
      {"<CaptureStop><Name VALUE=\"a\"/></CaptureStop>\0"s, Verb::Stop},
      {R"(<CaptureStop RESULT="SUCCESS"><Name VALUE="a"/></CaptureStop>)" + std::string(200, ' '), Verb::Stop},
      {R"(<CaptureStop RESULT="FAIL"><Name VALUE="a"/></CaptureStop>)", Verb::Stop},
      {R"(<CaptureStop RESULT="CANCEL"><Name VALUE="a"/></CaptureStop>)", Verb::Cancel},
      {R"(<CaptureComplete RESULT="SUCCESS"><Name VALUE="a"/></CaptureComplete>)", Verb::Complete},
  };

  for (const auto& [packet, verb] : packets) {
    const auto request = read_xml(packet, false);
    ASSERT_TRUE(request) << packet << ": " << request.error().message;
    EXPECT_EQ(request->verb, verb) << packet;
    EXPECT_EQ(request->name, "a") << packet;
  }
}

TEST(XmlPacket, ReadsAValueBetweenTags) {
  const auto request = read_xml("<CaptureStart><Notes>two &lt; three</Notes></CaptureStart>", false);

  ASSERT_TRUE(request);
  EXPECT_EQ(request->notes, "two < three");
}

TEST(XmlPacket, ReadsTheRequestsOfXsens) {
  const auto start =
      read_xml(R"(<StartRecordingReq SessionName="C:/Xsens/MVN/session_01" StartTime="13 46 13 25" />)", true);
  const auto stop = read_xml("<StopRecordingReq/>", true);
  const auto capture = read_xml("<CaptureStart/>", true);

  ASSERT_TRUE(start && stop && capture);
  EXPECT_EQ(start->verb, Verb::Start);
  EXPECT_EQ(start->name, "session_01");
  EXPECT_EQ(start->dialect, Dialect::Recording);
  EXPECT_EQ(stop->verb, Verb::Stop);
  EXPECT_EQ(capture->dialect, Dialect::CaptureAck);
}

TEST(XmlPacket, RefusesAPacketThatIsNotComplete) {
  const std::string whole = kStart.substr(0, kStart.size() - 1);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THAT(why_refused(whole.substr(0, size)), HasSubstr("not one complete XML document")) << size;
  }
  EXPECT_THAT(why_refused(whole + whole), HasSubstr("not one complete XML document"));
  EXPECT_THAT(why_refused(whole + "\0x"s), HasSubstr("not one complete XML document"));
}

TEST(XmlPacket, RefusesDocumentTypesAndEntities) {
  EXPECT_THAT(why_refused("<!DOCTYPE a [<!ENTITY b 'c'>]><CaptureStart><Name VALUE=\"&b;\"/></CaptureStart>"),
              HasSubstr("has a document type"));
  EXPECT_THAT(why_refused("<!DOCTYPE a SYSTEM 'file:///etc/passwd'><CaptureStart/>"), HasSubstr("has a document type"));
  EXPECT_THAT(why_refused("<CaptureStart><Name VALUE=\"&b;\"/></CaptureStart>"), HasSubstr("undefined entity"));
}

TEST(XmlPacket, RefusesWhatExceedsItsBounds) {
  EXPECT_THAT(why_refused("<CaptureStart>" + std::string(kMaxPacket_bytes, ' ') + "</CaptureStart>"),
              HasSubstr("expected at most 8192"));
  EXPECT_THAT(why_refused("<CaptureStart><a><b><c><d/></c></b></a></CaptureStart>"), HasSubstr("nested deeper than 4"));
  std::string many = "<CaptureStart>";
  for (int i = 0; i < 64; ++i) many += "<a/>";
  EXPECT_THAT(why_refused(many + "</CaptureStart>"), HasSubstr("more than 64 elements"));
}

TEST(XmlPacket, RefusesWrongValuesAndOtherDocuments) {
  EXPECT_THAT(why_refused(R"(<CaptureStart><Delay VALUE="soon"/></CaptureStart>)"),
              HasSubstr("Delay is 'soon', expected 0 to 600000 ms"));
  EXPECT_THAT(why_refused(R"(<CaptureStart><Delay VALUE="-1"/></CaptureStart>)"), HasSubstr("Delay is '-1'"));
  EXPECT_THAT(why_refused(R"(<CaptureStart><Delay VALUE="nan"/></CaptureStart>)"), HasSubstr("Delay is 'nan'"));
  EXPECT_THAT(why_refused(R"(<CaptureStop RESULT="maybe"/>)"), HasSubstr("RESULT is 'maybe'"));
  EXPECT_THAT(why_refused("<Probe/>"), HasSubstr("is a 'Probe', expected CaptureStart"));
}

TEST(XmlPacket, WritesAStartByteByByte) {
  EXPECT_EQ(write_capture({.verb = Verb::Start,
                           .name = "dance",
                           .notes = "The pets & ants",
                           .description = "a \"jump\"",
                           .database_path = "D:/Captures/Take",
                           .delay = milliseconds(33),
                           .packet_id = "33360"}),
            kStart);
}

TEST(XmlPacket, WritesAStopAndACompleteByteByByte) {
  const std::string head = R"(<?xml version="1.0" encoding="UTF-8" standalone="no"?>)";
  EXPECT_EQ(
      write_capture({.verb = Verb::Stop, .result = "FAIL", .name = "a", .notes = "disk <full>", .packet_id = "7"}),
      head + R"(<CaptureStop RESULT="FAIL"><Name VALUE="a"/><Notes VALUE="disk &lt;full&gt;"/>)"
             R"(<DatabasePath VALUE=""/><Delay VALUE="0"/><PacketID VALUE="7"/></CaptureStop>)"
             "\0"s);
  EXPECT_EQ(write_capture({.verb = Verb::Complete, .result = "SUCCESS", .name = "a", .database_path = "/takes"}),
            head + R"(<CaptureComplete RESULT="SUCCESS"><Name VALUE="a"/><DatabasePath VALUE="/takes"/>)"
                   R"(<Delay VALUE="0"/></CaptureComplete>)"
                   "\0"s);
}

TEST(XmlPacket, WritesTheAnswersOfXsensByteByByte) {
  EXPECT_EQ(write_ack(Verb::Start, Dialect::Recording, ""), "<StartRecordingAck Result=\"TRUE\"/>\0"s);
  EXPECT_EQ(write_ack(Verb::Stop, Dialect::Recording, ""), "<StopRecordingAck Result=\"TRUE\"/>\0"s);
  EXPECT_EQ(write_ack(Verb::Start, Dialect::CaptureAck, "no \"disk\""),
            "<CaptureStartAck Result=\"FALSE\" Reason=\"no &quot;disk&quot;\"/>\0"s);
}

TEST(XmlPacket, ReadsBackEveryCharacterThatItWrites) {
  const std::string text = "<&>\"' \t\n\r caf\xC3\xA9";

  const auto request = read_xml(write_capture({.verb = Verb::Start, .name = text}), false);

  ASSERT_TRUE(request) << request.error().message;
  EXPECT_EQ(request->name, text);
}

}  // namespace xml_packet_test
}  // namespace mocap::trigger
