// What messages show of text from outside.

#include "youbot_base_sim/text/quote.h"

#include <gtest/gtest.h>

namespace youbot_base_sim {
namespace {

TEST(QuoteTest, OrdinaryTextStaysAsItIs) {
  for (const char* text : {"", "0.1", "[1, 2, 3, 4]", "Grüße ½ 車輪 🤖", "a b\"c'd/e"})
    EXPECT_EQ(quote(text), text);
}

TEST(QuoteTest, NothingReachesTheTerminalAsAControlCharacter) {
  EXPECT_EQ(quote("two\nlines\r\tand"), "two\\nlines\\r\\tand");
  EXPECT_EQ(quote("\x1b[31mred\x07\x7f"), "\\x1b[31mred\\x07\\x7f");
  EXPECT_EQ(quote(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(quote("C:\\n"), "C:\\\\n");                                       // not to be taken for a newline
  EXPECT_EQ(quote("\u0085 \u009b31m \u2028"), "\\u0085 \\u009b31m \\u2028");  // next line, CSI, line separator
  EXPECT_EQ(quote("\u202e\u2066\ufeff"), "\\u202e\\u2066\\ufeff");            // turn the direction of writing; BOM
}

TEST(QuoteTest, BytesThatAreNotUtf8AreEscaped) {
  EXPECT_EQ(quote("\xff\xfe"), "\\xff\\xfe");
  EXPECT_EQ(quote("\xc3"), "\\xc3");                             // ends too early
  EXPECT_EQ(quote("\xc3(\x80"), "\\xc3(\\x80");                  // no continuation; a lone one
  EXPECT_EQ(quote("\xc0\xaf"), "\\xc0\\xaf");                    // longer than it need be
  EXPECT_EQ(quote("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // half of a UTF-16 pair
  EXPECT_EQ(quote("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond U+10FFFF
  EXPECT_EQ(quote("\xf8\x88\x80\x80\x80"), "\\xf8\\x88\\x80\\x80\\x80");
}

TEST(QuoteTest, LongTextIsCutBetweenCharacters) {
  EXPECT_EQ(quote(std::string(60, 'x')), std::string(60, 'x'));
  EXPECT_EQ(quote(std::string(5'000'000, 'x')), std::string(60, 'x') + "...");
  EXPECT_EQ(quote("üüü", 2), "üü...");
  EXPECT_EQ(quote("\n\n\n", 2), "\\n\\n...");
}

TEST(QuoteTest, LongNamesOfFilesKeepTheirEnd) {
  EXPECT_EQ(quote_path("/tmp/a\nb/scene.yaml"), "/tmp/a\\nb/scene.yaml");
  const std::string end = std::string(190, 'y') + "scene.yaml";
  EXPECT_EQ(quote_path(end), end);
  EXPECT_EQ(quote_path("z" + end), "..." + end);
  EXPECT_EQ(quote_path(std::string(5'000'000, 'x') + end), "..." + end);
}

}  // namespace
}  // namespace youbot_base_sim
