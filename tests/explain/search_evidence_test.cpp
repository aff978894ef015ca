#include "explain/search_evidence.h"

#include <gtest/gtest.h>

namespace mocap::explain {
namespace search_evidence_test {

SearchEvidence every_fact() {
  SearchEvidence evidence;
  evidence.subject = "anna";
  evidence.marker_set = "baseline41";
  for (int m = 0; m < 41; ++m) evidence.marker_names.push_back("marker" + std::to_string(m));
  evidence.needed = 35;
  evidence.views_needed = 3;
  evidence.known = KnownSet{"openmocap18", 18};
  evidence.facts.markers = 41;
  for (std::uint32_t m = 0; m < 20; ++m) evidence.facts.missing.push_back({m, {}, m % 5});
  for (int c = 0; c < 64; ++c) evidence.cameras.push_back({"camera" + std::to_string(c), true, 0, 0, {}, 41});
  return evidence;
}

TEST(SentenceOf, IsOneLineThatFitsIntoHealthForEveryCause) {
  SearchEvidence evidence = every_fact();
  for (int cause = 1; cause < kSearchCauses; ++cause) {
    evidence.facts.cause = static_cast<SearchCause>(cause);

    const std::string text = sentence_of(evidence);

    EXPECT_EQ(text.rfind("anna is not found: ", 0), 0U) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos);
    EXPECT_LE(text.size(), 511U) << text;
  }
}

TEST(SentenceOf, IsEmptyWithoutACause) { EXPECT_TRUE(sentence_of(every_fact()).empty()); }

TEST(MisfitsOf, AreCamerasWhoseBlobsJoinNoMarkers) {
  SearchEvidence evidence;
  evidence.cameras = {
      {"a", true, 40, 30, {}, 0}, {"b", true, 40, 2, {}, 0}, {"c", true, 3, 0, {}, 0}, {"d", false, 40, 0, {}, 0}};

  const auto misfits = misfits_of(evidence);

  ASSERT_EQ(misfits.size(), 1U);
  EXPECT_EQ(misfits[0]->name, "b");
}

TEST(MisfitsOf, AreNoCamerasWhoseMarkersTooFewOthersSee) {
  SearchEvidence evidence;
  evidence.views_needed = 3;
  evidence.cameras = {{"a", true, 40, 0, {}, 0}, {"b", true, 40, 0, {}, 0}, {"c", true, 3, 0, {}, 0}};

  EXPECT_TRUE(misfits_of(evidence).empty());
}

TEST(SuspectsOf, AreBlindCamerasWithManyMarkersInView) {
  SearchEvidence evidence;
  evidence.cameras = {{"a", true, 0, 0, {}, 30}, {"b", true, 0, 0, {}, 2}, {"c", true, 3, 0, {}, 30}};

  const auto suspects = suspects_of(evidence);

  ASSERT_EQ(suspects.size(), 1U);
  EXPECT_EQ(suspects[0]->name, "a");
}

}  // namespace search_evidence_test
}  // namespace mocap::explain
