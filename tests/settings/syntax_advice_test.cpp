#include "settings/toml/syntax_advice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "settings/toml/toml_file.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace syntax_advice_test {

using ::testing::HasSubstr;

// The fault of a file that the parser refuses.
std::string fault_of(const std::string& text) {
  const support::TemporaryFolder folder;
  const auto file = TomlFile::open(folder.write("a.toml", text));
  if (file) return "no fault";
  const Fault& fault = file.error().list.at(0);
  return std::to_string(fault.line) + ": " + fault.message;
}

TEST(SyntaxAdvice, ExplainsAMissingQuote) {
  EXPECT_EQ(fault_of("a = 1\nname = \"west\nb = 2\n"),
            "2: a quote is missing in: name = \"west; a text begins and ends with \" on one line");
  EXPECT_THAT(fault_of("name = west\" # the \"west\" one\n"), HasSubstr("1: a quote is missing in: name = west\""));
  EXPECT_THAT(fault_of("names = [\"a\", \"b]\n"), HasSubstr("1: a quote is missing in: names"));
}

TEST(SyntaxAdvice, ExplainsATextWithoutQuotes) {
  EXPECT_EQ(fault_of("name = west\n"), "1: the value of name has no quotes; a text needs them: name = \"west\"");
  EXPECT_THAT(fault_of("rig = ../rig.toml # ours\n"), HasSubstr("needs them: rig = \"../rig.toml\""));
  EXPECT_THAT(fault_of("address = 192.168.10.2\n"), HasSubstr("needs them: address = \"192.168.10.2\""));
  EXPECT_THAT(fault_of("endpoint = tcp://127.0.0.1:5570\n"), HasSubstr("needs them: endpoint = \"tcp:"));
  EXPECT_THAT(fault_of("lock_memory = True\n"), HasSubstr("lock_memory is True, expected true or false"));
  EXPECT_THAT(fault_of("a =\n"), HasSubstr("1: a has no value"));
}

TEST(SyntaxAdvice, ExplainsWrongHeadings) {
  EXPECT_THAT(fault_of("[[camera]\nname = \"a\"\n"), HasSubstr("do not match, expected [[camera]]"));
  EXPECT_THAT(fault_of("[capture\nrig = \"a\"\n"), HasSubstr("do not match, expected [capture]"));
  EXPECT_THAT(fault_of("[camera]\nname = \"a\"\n[camera]\nname = \"b\"\n"),
              HasSubstr("[camera] is there twice, expected [[camera]] with two brackets"));
  EXPECT_THAT(fault_of("[capture]\na = 1\n[capture]\nb = 1\n"), HasSubstr("'capture' is there twice, expected once"));
}

TEST(SyntaxAdvice, ExplainsALineThatIsNoSetting) {
  EXPECT_THAT(fault_of("a = 1\n// a comment\n"), HasSubstr("2: '// a comment' is neither a heading"));
}

TEST(SyntaxAdvice, KeepsTheMessageOfTheParserForOtherCauses) {
  EXPECT_EQ(explain_syntax("a = 07\n", 1, "leading zeroes are prohibited"), "leading zeroes are prohibited");
}

}  // namespace syntax_advice_test
}  // namespace mocap::settings
