// Reading files from outside: whole, or a reason why not.

#include "youbot_base_sim/text/text_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <thread>

#include "temporary_folder.h"

namespace youbot_base_sim {
namespace {

class TextFileTest : public testing::Test {
 protected:
  static std::string reason(const std::string& path, std::size_t max_bytes = 1000) {
    try {
      read_text_file(path, max_bytes);
    } catch (const UnreadableFile& error) {
      return error.what();
    }
    ADD_FAILURE() << path << " was read";
    return "";
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
  try {
    read_text_file("/proc/kmsg", 1 << 20);
  } catch (const UnreadableFile& error) {
    EXPECT_EQ(std::string(error.what()).find("cannot be read ("), 0u) << error.what();
  }
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
