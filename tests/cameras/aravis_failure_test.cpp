#include "cameras/aravis/aravis_failure.h"

#include <gtest/gtest.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <utility>
#include <vector>

namespace mocap::cameras {
namespace aravis_failure_test {

void fail(GError** error, GQuark domain, int code) { g_set_error_literal(error, domain, code, "no answer"); }

TEST(AravisFailure, HasNotHappenedBeforeACall) {
  const AravisFailure failure;

  EXPECT_FALSE(failure.happened());
  EXPECT_EQ(failure.text(), "no reason given");
  EXPECT_EQ(failure.error("cannot read").code, ErrorCode::Io);
}

TEST(AravisFailure, HoldsTheErrorOfTheLastCallOnly) {
  AravisFailure failure;

  fail(failure, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_TIMEOUT);
  EXPECT_TRUE(failure.happened());
  EXPECT_EQ(failure.text(), "no answer");
  static_cast<void>(static_cast<GError**>(failure));  // the next call succeeds

  EXPECT_FALSE(failure.happened());
}

TEST(AravisFailure, TranslatesTheCodeOfAravis) {
  const std::vector<std::pair<int, ErrorCode>> expected{
      {ARV_DEVICE_ERROR_NOT_FOUND, ErrorCode::NotFound},
      {ARV_DEVICE_ERROR_FEATURE_NOT_FOUND, ErrorCode::Unsupported},
      {ARV_DEVICE_ERROR_WRONG_FEATURE, ErrorCode::Unsupported},
      {ARV_DEVICE_ERROR_NOT_CONTROLLER, ErrorCode::Busy},
      {ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED, ErrorCode::Busy},
      {ARV_DEVICE_ERROR_PROTOCOL_ERROR_BUSY, ErrorCode::Busy},
      {ARV_DEVICE_ERROR_TIMEOUT, ErrorCode::Io}};
  for (const auto& [code, translated] : expected) {
    AravisFailure failure;
    fail(failure, ARV_DEVICE_ERROR, code);

    const Error error = failure.error("cannot open 127.0.0.2");

    EXPECT_EQ(error.code, translated) << code;
    EXPECT_EQ(error.message, "cannot open 127.0.0.2: no answer");
  }
}

TEST(AravisFailure, OfAnotherLibraryIsAnInputOutputError) {
  AravisFailure failure;
  // The same number as ARV_DEVICE_ERROR_NOT_FOUND in another domain.
  fail(failure, G_FILE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND);

  EXPECT_EQ(failure.error("x").code, ErrorCode::Io);
}

}  // namespace aravis_failure_test
}  // namespace mocap::cameras
