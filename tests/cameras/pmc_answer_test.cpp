#include "cameras/ptp/pmc_answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace mocap::cameras {
namespace pmc_answer_test {

using ::testing::HasSubstr;

// As pmc of linuxptp 3.1.1 prints it.
std::string printed(const std::string& state, const std::string& has_master, const std::string& offset = "238") {
  return "sending: GET TIME_STATUS_NP\n"
         "sending: GET PORT_DATA_SET\n"
         "\t86927e.fffe.3d2643-0 seq 0 RESPONSE MANAGEMENT TIME_STATUS_NP \n"
         "\t\tmaster_offset              " +
         offset +
         "\n"
         "\t\tingress_time               1795772164700852004\n"
         "\t\tcumulativeScaledRateOffset +0.000000000\n"
         "\t\tgmPresent                  " +
         has_master +
         "\n"
         "\t\tgmIdentity                 7adcdf.fffe.341041\n"
         "\t86927e.fffe.3d2643-1 seq 1 RESPONSE MANAGEMENT PORT_DATA_SET \n"
         "\t\tportIdentity            86927e.fffe.3d2643-1\n"
         "\t\tportState               " +
         state + "\n";
}

TEST(PmcAnswer, OfASlaveHasOffsetInstantAndGrandmaster) {
  const auto answer = parse_pmc(printed("SLAVE", "true", "-1520"));

  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->grandmaster, 0x7adcdffffe341041u);
  EXPECT_EQ(answer->offset.count(), -1520);
  ASSERT_TRUE(answer->measured);
  EXPECT_EQ(answer->measured->count(), 1795772164700852004);
}

TEST(PmcAnswer, OfTheGrandmasterHasNoOffset) {
  const auto answer = parse_pmc(printed("MASTER", "false", "0"));

  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->offset, Duration{});
  EXPECT_FALSE(answer->measured);
}

TEST(PmcAnswer, WithoutAMasterNamesTheStateOfThePort) {
  const auto answer = parse_pmc(printed("LISTENING", "false"));

  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, ErrorCode::NotFound);
  EXPECT_THAT(answer.error().message, HasSubstr("LISTENING"));
}

TEST(PmcAnswer, ThatIsMissingHasTheReportOfPmc) {
  const auto refused =
      parse_pmc("sending: GET TIME_STATUS_NP\npmc[4823.123]: uds: sendto failed: Connection refused\nmore\n");
  const auto silent = parse_pmc("sending: GET TIME_STATUS_NP\nsending: GET PORT_DATA_SET\n");

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "ptp4l does not answer; pmc prints: uds: sendto failed: Connection refused");
  ASSERT_FALSE(silent);
  EXPECT_EQ(silent.error().message, "ptp4l does not answer");
}

TEST(PmcAnswer, IsMissingOrMalformed) {
  for (const std::string& text :
       {std::string{}, std::string("uds: sendto failed: Connection refused\n"), printed("SLAVE", "true", "12x"),
        printed("SLAVE", "true", "99999999999999999999"), printed("SLAVE", "true").substr(0, 120)}) {
    const auto answer = parse_pmc(text);

    ASSERT_FALSE(answer) << text;
    EXPECT_EQ(answer.error().code, ErrorCode::NotFound);
  }
}

}  // namespace pmc_answer_test
}  // namespace mocap::cameras
