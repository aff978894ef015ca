// Counts the calls of operator new in this program. ZeroMQ allocates its buffers with malloc; they are not counted.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <vector>

#include "random_model.h"
#include "sample_description.h"
#include "wire/codec/encode.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_subscriber.h"

namespace {
thread_local std::size_t allocations = 0;
}  // namespace

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCanCount = false;  // the sanitizer replaces operator new
#else
constexpr bool kCanCount = true;

namespace {

void* counted(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace mocap::wire {
namespace allocation_test {

Snapshot with_subjects(std::uint32_t count, testing::RandomModel& random) {
  Snapshot snapshot;
  snapshot.views.resize(8);
  for (std::uint32_t s = 0; s < count; ++s) {
    SubjectLabels& labels = snapshot.labels.push_back({});
    labels.subject = SubjectId{s};
    for (int i = 0; i < 41; ++i) labels.markers.push_back(random.label());
    SubjectPose& pose = snapshot.poses.push_back({});
    pose.subject = SubjectId{s};
    pose.bones.resize(24);
  }
  snapshot.unlabelled.resize(10 * count);
  return snapshot;
}

TEST(ZmqPublisher, DoesNotAllocateAfterWarmUp) {
  if (!kCanCount) GTEST_SKIP() << "a sanitizer owns the heap";
  testing::RandomModel random(31);
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher) << publisher.error().message;
  const Timestamp now = host_now();
  Snapshot large = with_subjects(3, random);
  large.instants = {now, now, now, now, std::nullopt};
  Snapshot small = with_subjects(1, random);
  Snapshot empty;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE((*publisher)->publish(large));
    ASSERT_TRUE((*publisher)->publish(empty));
  }

  const std::size_t before = allocations;
  for (int i = 0; i < 10000; ++i) {
    if (!(*publisher)->publish(large) || !(*publisher)->publish(small) || !(*publisher)->publish(empty)) break;
  }
  const std::size_t after = allocations;

  EXPECT_EQ(after - before, 0U);
}

// The subscriber reads nothing, so that the messages that it does not take are dropped.
TEST(ZmqPublisher, DoesNotAllocateForLiteMessages) {
  if (!kCanCount) GTEST_SKIP() << "a sanitizer owns the heap";
  testing::RandomModel random(32);
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*", .lite_hz = 1000.0});
  ASSERT_TRUE(publisher) << publisher.error().message;
  ASSERT_TRUE((*publisher)->describe(testing::sample_description()));
  const auto subscriber = ZmqSubscriber::open({.endpoint = (*publisher)->endpoint(), .topics = {"lite/actor"}});
  ASSERT_TRUE(subscriber);
  while ((*publisher)->feed().subscriptions < 1) (*publisher)->serve();
  Snapshot snapshot = with_subjects(1, random);
  ASSERT_TRUE((*publisher)->publish(snapshot));

  const std::size_t before = allocations;
  for (int i = 0; i < 1000; ++i) {
    snapshot.instants.exposed_at += std::chrono::milliseconds(2);
    if (!(*publisher)->publish(snapshot)) break;
  }
  const std::size_t after = allocations;

  EXPECT_EQ(after - before, 0U);
  EXPECT_TRUE((*subscriber)->next(std::chrono::seconds(20)));  // messages were sent
}

TEST(Allocations, AreCounted) {
  if (!kCanCount) GTEST_SKIP() << "a sanitizer owns the heap";
  const std::size_t before = allocations;
  auto* number = new std::vector<int>(100);
  const std::size_t after = allocations;
  delete number;

  EXPECT_EQ(after - before, 2U);
}

}  // namespace allocation_test
}  // namespace mocap::wire
