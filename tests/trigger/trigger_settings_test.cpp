#include "trigger/trigger_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mocap::trigger {
namespace trigger_settings_test {

using ::testing::HasSubstr;

TriggerSettings listening() {
  TriggerSettings settings;
  settings.listen = "0.0.0.0";
  settings.senders = {"192.168.1.20"};
  return settings;
}

std::string fault_of(const TriggerSettings& settings, const std::string& key) {
  for (const KeyFault& fault : faults_of(settings)) {
    if (fault.key == key) return fault.message;
  }
  return {};
}

TEST(TriggerSettings, AreOffByDefault) {
  const TriggerSettings settings;

  EXPECT_FALSE(settings.listens());
  EXPECT_TRUE(faults_of(settings).empty());
  EXPECT_TRUE(sockets_of(settings).empty());
}

TEST(TriggerSettings, RefuseToListenToEverybody) {
  TriggerSettings settings = listening();
  EXPECT_TRUE(faults_of(settings).empty());

  settings.senders.clear();

  EXPECT_THAT(fault_of(settings, "senders"), HasSubstr("senders is empty, expected the IPv4 addresses"));
}

TEST(TriggerSettings, NameEachWrongAddress) {
  TriggerSettings settings = listening();
  settings.listen = "studio";
  settings.senders = {"192.168.1.20", "192.168.1"};
  settings.xml_receivers = {"192.168.1.30"};
  settings.osc_receivers = {"192.168.1.30:99999"};

  EXPECT_THAT(fault_of(settings, "listen"), HasSubstr("listen is 'studio', expected an IPv4 address"));
  EXPECT_THAT(fault_of(settings, "senders"), HasSubstr("has '192.168.1', expected IPv4 addresses"));
  EXPECT_THAT(fault_of(settings, "xml_receivers"), HasSubstr("has '192.168.1.30', expected ADDRESS:PORT"));
  EXPECT_THAT(fault_of(settings, "osc_receivers"), HasSubstr("has '192.168.1.30:99999', expected ADDRESS:PORT"));
}

TEST(TriggerSettings, HaveEachPortOnceAndAtLeastOne) {
  TriggerSettings settings = listening();
  settings.xml_ports = {30, 8989};
  settings.osc_ports = {8989};
  EXPECT_THAT(fault_of(settings, "osc_ports"), HasSubstr("has 8989, which is there twice"));

  settings.xml_ports.clear();
  settings.osc_ports.clear();
  EXPECT_THAT(fault_of(settings, "listen"), HasSubstr("but no port"));
}

TEST(TriggerSettings, GiveEachPortItsSocketAndOneForAnswers) {
  TriggerSettings settings = listening();
  settings.xml_ports = {30, 8989};
  settings.xsens_ports = {6004};
  settings.osc_ports = {8000};
  settings.osc_receivers = {"10.0.0.7:8000"};

  const std::vector<SocketUse> sockets = sockets_of(settings);

  ASSERT_EQ(sockets.size(), 5U);
  EXPECT_EQ(sockets[1].port, 8989);
  EXPECT_EQ(sockets[2].protocol, Protocol::Xsens);
  EXPECT_EQ(sockets[3].protocol, Protocol::Osc);
  EXPECT_EQ(sockets[4].protocol, Protocol::Answers);
}

}  // namespace trigger_settings_test
}  // namespace mocap::trigger
