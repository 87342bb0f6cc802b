// Text from outside: numbers, files, whole or with a reason why not, and what messages show of it.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "errors.h"
#include "temporary_folder.h"
#include "youbot_base_sim/text/number.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {
namespace {

TEST(NumberTest, AllOfTheTextIsANumber) {
  double number = 0;
  EXPECT_TRUE(read_number("-1.5e3", number));
  EXPECT_EQ(number, -1500);
  for (const std::string_view text : {"", "1x", "1 ", " 1", "\t1", "x", "1,2", "0x1p3", "0X10", "-0x1"})
    EXPECT_FALSE(read_number(text, number)) << text;
  EXPECT_FALSE(read_number(std::string_view("1\0x", 3), number));
}

TEST(NumberTest, RangesIncludeTheirEnds) {
  constexpr Range range{2, 3, "m", true};
  for (const double number : {0.0, 2.0, 3.0}) EXPECT_TRUE(contains(range, number)) << number;
  for (const double number : {1.9, 3.1, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(contains(range, number)) << number;
  }
}

TEST(NumberTest, RangesAreToldInWords) {
  EXPECT_EQ(text_of({1e-6, 1e6, "kg"}), "a finite number > 0, from 1e-06 to 1e+06 kg");
  EXPECT_EQ(text_of({0, 100, ""}), "a finite number >= 0, up to 100");
  EXPECT_EQ(text_of({1e-6, 10, "s", true}), "a finite number >= 0: 0 or from 1e-06 to 10 s");
  EXPECT_EQ(text_of({-3, 3, "m"}), "a finite number from -3 to 3 m");
}

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

class TextFileTest : public testing::Test {
 protected:
  static std::string reason(const std::string& path, std::size_t max_bytes = 1000) {
    return error_of<UnreadableFile>([&] { read_text_file(path, max_bytes); });
  }

  std::string pipe() {
    const std::string path = folder_.path("pipe");
    EXPECT_EQ(mkfifo(path.c_str(), 0600), 0);
    return path;
  }

  TemporaryFolder folder_;
};

TEST_F(TextFileTest, ReadsAllOfAFileButItsByteOrderMark) {
  EXPECT_EQ(read_text_file(folder_.write("a", "one\ntwo"), 7), "one\ntwo");
  EXPECT_EQ(read_text_file(folder_.write("a", "\xEF\xBB\xBFone"), 10), "one");
  EXPECT_EQ(read_text_file(folder_.write("a", ""), 0), "");
  const std::string long_text(200'000, 'x');
  EXPECT_EQ(read_text_file(folder_.write("a", long_text), long_text.size()), long_text);
}

TEST_F(TextFileTest, RefusesWhatIsNoTextByAReason) {
  EXPECT_EQ(reason(folder_.path("")), "is a folder");
  EXPECT_EQ(reason("/dev/zero"), "is neither a file nor a pipe");
  EXPECT_EQ(reason(folder_.path("missing")), "cannot be read (No such file or directory)");
  EXPECT_EQ(reason("/proc/self/mem"), "cannot be read (Input/output error)");  // opens, but cannot be read from 0 on
  EXPECT_EQ(reason(folder_.write("long", "12345"), 4), "is longer than 4 bytes");
}

// A regular file by its type, which waits for the next message. Not all may open it, and a message may have come.
TEST_F(TextFileTest, DoesNotWaitForTheKernelsLog) {
  const std::string error = reason("/proc/kmsg", 1 << 20);
  EXPECT_TRUE(error.empty() || error.find("cannot be read (") == 0) << error;
}

TEST_F(TextFileTest, ReadsAPipeWhoseWriterTakesItsTime) {
  const std::string path = pipe();
  std::thread writer([&] {
    std::ofstream out(path);
    for (const char* part : {"one", " two"}) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      out << part << std::flush;
    }
  });
  EXPECT_EQ(read_text_file(path, 1000), "one two");
  writer.join();
}

TEST_F(TextFileTest, StopsAtTheLimitOfAPipeThatNeverEnds) {
  const std::string path = pipe();
  std::thread writer([&] {
    std::ofstream out(path);
    out << std::string(5000, 'x');  // less than a pipe holds, so that no signal ends the test
  });
  EXPECT_EQ(reason(path), "is longer than 1000 bytes");
  writer.join();
}

TEST_F(TextFileTest, RefusesAPipeWithoutAWriter) { EXPECT_EQ(reason(pipe()), "is a pipe without a writer"); }

}  // namespace
}  // namespace youbot_base_sim
