#include "wire/codec/blob_columns.h"

#include <gtest/gtest.h>

#include "mocap/v1/blobs.pb.h"
#include "mocap/v1/take.pb.h"

namespace mocap::wire {
namespace blob_columns_test {

Blob example() {
  Blob blob;
  blob.centroid.v = {1.5, 2.25};
  blob.sigma_px = 0.125;
  blob.area_px2 = 40.0;
  blob.peak = 200.0;
  blob.roundness = 0.75;
  blob.axis_rad = -0.5;
  blob.saturated = 0.25;
  blob.touches_border = true;
  blob.merged = true;
  return blob;
}

template <class Message>
class BlobColumns : public ::testing::Test {};
using Messages = ::testing::Types<v1::CameraBlobs, v1::BlobPicture>;
TYPED_TEST_SUITE(BlobColumns, Messages);

TYPED_TEST(BlobColumns, ABlobReturnsAsItWas) {
  TypeParam message;
  add_blob(message, Blob{});
  add_blob(message, example());

  const Blob blob = blob_at(message, 1);

  EXPECT_TRUE(columns_agree(message));
  EXPECT_EQ(blob.centroid.v, example().centroid.v);
  EXPECT_EQ(blob.sigma_px, 0.125);
  EXPECT_EQ(blob.area_px2, 40.0);
  EXPECT_EQ(blob.peak, 200.0);
  EXPECT_EQ(blob.roundness, 0.75);
  EXPECT_EQ(blob.axis_rad, -0.5);
  EXPECT_EQ(blob.saturated, 0.25);
  EXPECT_TRUE(blob.touches_border);
  EXPECT_TRUE(blob.merged);
}

TYPED_TEST(BlobColumns, AgreeOnlyIfAllHaveTheSameLength) {
  TypeParam whole;
  add_blob(whole, example());
  int columns = 0;
  const auto* descriptor = whole.GetDescriptor();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const auto* field = descriptor->field(i);
    if (!field->is_repeated() || whole.GetReflection()->FieldSize(whole, field) == 0) continue;
    TypeParam shorter = whole;
    shorter.GetReflection()->RemoveLast(&shorter, field);
    EXPECT_FALSE(columns_agree(shorter)) << field->name();
    ++columns;
  }
  EXPECT_EQ(columns, 9);
}

}  // namespace blob_columns_test
}  // namespace mocap::wire
