// Outputs: whole ones under their names, marked ones otherwise, and nothing else touched.

#include "youbot_base_sim/record/output_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <set>

#include "errors.h"
#include "promises/small_disk.h"
#include "temporary_folder.h"

namespace youbot_base_sim {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public testing::Test {
 protected:
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path(""))) names.insert(entry.path().filename());
    return names;
  }

  mode_t mode(const std::string& name) const {
    struct stat status {};
    stat(folder_.path(name).c_str(), &status);
    return status.st_mode & 07777;
  }

  std::string error_at(const std::string& path, OutputFile::Access access = OutputFile::Access::kInOrder) const {
    return error_of<OutputError>([&] { OutputFile(path, access); });
  }

  TemporaryFolder folder_;
};

TEST_F(OutputFileTest, AppearsWhenCommitted) {
  folder_.write("a.csv", "before\n");
  OutputFile file(folder_.path("a.csv"));
  file.write("after\n");
  EXPECT_EQ(folder_.read("a.csv"), "before\n");
  file.commit();
  EXPECT_EQ(folder_.read("a.csv"), "after\n");
  EXPECT_EQ(files(), std::set<std::string>{"a.csv"});
}

TEST_F(OutputFileTest, IsKeptUnderANameThatTellsUnlessCommitted) {
  folder_.write("a.csv", "before\n");
  std::string kept;
  {
    OutputFile file(folder_.path("a.csv"));
    file.write("1\n");
    kept = file.name();
  }
  EXPECT_EQ(folder_.read("a.csv"), "before\n");
  EXPECT_EQ(kept.find(folder_.path("a.csv.incomplete-")), 0u) << kept;
  EXPECT_EQ(folder_.read(fs::path(kept).filename()), "1\n");
  { OutputFile nothing_written(folder_.path("b.csv")); }
  EXPECT_EQ(files().size(), 2u);
}

TEST_F(OutputFileTest, TwoWritersAreBothWholeAndTheLastOneStands) {
  folder_.write("a.csv.part", "of the user\n");
  OutputFile first(folder_.path("a.csv")), second(folder_.path("a.csv"));
  first.write("first\n");
  second.write("second\n");
  second.commit();
  EXPECT_EQ(folder_.read("a.csv"), "second\n");
  first.commit();
  EXPECT_EQ(folder_.read("a.csv"), "first\n");
  EXPECT_EQ(folder_.read("a.csv.part"), "of the user\n");
  EXPECT_EQ(files().size(), 2u);
}

TEST_F(OutputFileTest, KeepsTheModeAndANewFileHasTheUmasks) {
  for (const mode_t kept : {0640, 0600, 0777}) {
    folder_.write("a.csv", "before\n");
    chmod(folder_.path("a.csv").c_str(), kept);
    OutputFile file(folder_.path("a.csv"));
    file.write("after\n");
    EXPECT_EQ(mode(fs::path(file.name()).filename()) & 077, kept & 077) << "meanwhile";
    file.commit();
    EXPECT_EQ(mode("a.csv"), kept);
    EXPECT_EQ(folder_.read("a.csv"), "after\n");
  }
  const mode_t before = umask(027);
  OutputFile(folder_.path("b.csv")).commit();
  umask(before);
  EXPECT_EQ(mode("b.csv"), 0640u);
}

TEST_F(OutputFileTest, AFileThatMayNotBeWrittenIsRefusedOrKeepsItsMode) {
  folder_.write("a.csv", "before\n");
  chmod(folder_.path("a.csv").c_str(), 0400);
  const std::string error = error_at(folder_.path("a.csv"));
  if (geteuid() == 0) {  // who may write everything
    EXPECT_EQ(error, "");
    OutputFile(folder_.path("a.csv")).commit();
  } else {
    EXPECT_NE(error.find("Permission denied"), std::string::npos) << error;
  }
  EXPECT_EQ(mode("a.csv"), 0400u);
}

TEST_F(OutputFileTest, FollowsSymbolicLinks) {
  fs::create_directory(folder_.path("there"));
  folder_.write("there/a.csv", "before\n");
  fs::create_symlink("there/a.csv", folder_.path("link"));
  fs::create_symlink(folder_.path("link"), folder_.path("link_to_link"));
  fs::create_symlink("there/new.csv", folder_.path("dangling"));
  for (const char* name : {"link_to_link", "dangling"}) {
    OutputFile file(folder_.path(name));
    file.write("after\n");
    file.commit();
    EXPECT_TRUE(fs::is_symlink(folder_.path(name)));
  }
  EXPECT_EQ(folder_.read("there/a.csv"), "after\n");
  EXPECT_EQ(folder_.read("there/new.csv"), "after\n");
  fs::create_symlink("round", folder_.path("round"));
  EXPECT_NE(error_at(folder_.path("round")).find("symbolic links"), std::string::npos);
}

TEST_F(OutputFileTest, WritesStraightToWhatIsNoFile) {
  // A device that no mistake can replace: no user may make files beside it.
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_TRUE(grantpt(terminal) == 0 && unlockpt(terminal) == 0);
  const std::string device = ptsname(terminal);
  OutputFile straight(device);
  straight.write("1\n");
  EXPECT_EQ(straight.name(), device);
  straight.commit();
  char line[4] = "";
  EXPECT_EQ(read(terminal, line, 3), 3);
  EXPECT_STREQ(line, "1\r\n");
  close(terminal);

  mkfifo(folder_.path("fifo").c_str(), 0600);
  const int reader = open(folder_.path("fifo").c_str(), O_RDONLY | O_NONBLOCK);
  OutputFile fifo(folder_.path("fifo"));
  fifo.write("1\n");
  char text[3] = "";
  EXPECT_EQ(read(reader, text, 2), 2) << "at once";
  EXPECT_STREQ(text, "1\n");
  fifo.commit();
  close(reader);
  EXPECT_EQ(files(), std::set<std::string>{"fifo"});
  EXPECT_NE(error_at(folder_.path("fifo"), OutputFile::Access::kAnywhere).find("pipe"), std::string::npos);
}

TEST_F(OutputFileTest, AnOwnDescriptorGoesOnWhereItIs) {
  const int log = open(folder_.path("log").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ASSERT_EQ(write(log, "before\n", 7), 7);
  for (const char* folder : {"/dev/fd/", "/proc/self/fd/"}) {
    OutputFile file(folder + std::to_string(log));
    file.write("after\n");
    file.commit();
  }
  close(log);
  EXPECT_EQ(folder_.read("log"), "before\nafter\nafter\n");
  EXPECT_NE(error_at("/dev/fd/" + std::to_string(log)), "") << "closed";
}

TEST_F(OutputFileTest, RefusesWhatCannotBeWritten) {
  folder_.write("file", "");
  for (const std::string& path :
       {std::string(), folder_.path(""), folder_.path("."), folder_.path("no/a.csv"), folder_.path("no/"),
        folder_.path("file/a.csv"), folder_.path(std::string(300, 'a')), std::string("/proc/a.csv")}) {
    const std::string error = error_at(path);
    EXPECT_NE(error, "") << path;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 0) << error;
  }
  EXPECT_EQ(files(), std::set<std::string>{"file"});
  OutputFile longest(folder_.path(std::string(255, 'a')));
  longest.commit();
  EXPECT_TRUE(folder_.has(std::string(255, 'a')));
}

TEST_F(OutputFileTest, KnowsAFileByAllItsNames) {
  folder_.write("a.csv", "");
  fs::create_hard_link(folder_.path("a.csv"), folder_.path("hard"));
  fs::create_symlink("a.csv", folder_.path("soft"));
  fs::create_symlink(".", folder_.path("here"));
  fs::create_symlink("here/new.csv", folder_.path("dangling"));
  const auto identity = [](const std::string& path) { return OutputFile::place_of(path).identity(); };
  const std::string a = identity(folder_.path("a.csv")), next = identity(folder_.path("new.csv"));
  for (const char* name : {"hard", "soft", "./a.csv", "here/a.csv"}) EXPECT_EQ(identity(folder_.path(name)), a) << name;
  for (const char* name : {"here/new.csv", "dangling"}) EXPECT_EQ(identity(folder_.path(name)), next) << name;
  EXPECT_NE(a, next);
  EXPECT_NE(identity(folder_.path("b.csv")), next);
  EXPECT_EQ(identity("/dev/null"), "") << "everybody's";
  EXPECT_NE(identity("/dev/full"), "");
}

TEST_F(OutputFileTest, OpenerRefusesInputsAndOtherOutputs) {
  OutputOpener opener({folder_.write("in.csv", "t\n"), folder_.path("missing")});
  const auto refusal = [&](const std::string& path) {
    return error_of<OutputError>([&] { opener.open("--csv", path); });
  };
  const OutputFile first = opener.open("--summary", folder_.path("out"));
  EXPECT_NE(refusal(folder_.path("./in.csv")).find("in.csv: must not be a file that is read"), std::string::npos);
  EXPECT_NE(refusal(folder_.path("./out")).find("out: must not be the file of --summary"), std::string::npos);
  EXPECT_EQ(refusal(folder_.path("other")), "");
}

TEST_F(OutputFileTest, OpenerKeepsPlacesForAllThatWillComeInAFolder) {
  fs::create_directory(folder_.path("runs"));
  const auto refusal = [&]() -> std::string {
    OutputOpener opener({folder_.write("in.csv", "t\n")});
    return error_of<OutputError>([&] {
      opener.keep("--csv", folder_.path("table"));
      opener.keep_all("runs", folder_.path("runs"), [](const std::string& name) { return name.size() == 1; });
      opener.keep_all("none", folder_.path("missing"), [](const std::string&) { return true; });
    });
  };
  folder_.write("runs/a", "of an earlier run\n");
  fs::create_symlink("../elsewhere", folder_.path("runs/b"));
  fs::create_symlink("../in.csv", folder_.path("runs/of nobody"));
  EXPECT_EQ(refusal(), "");
  for (const auto& [target, part] : std::map<std::string, std::string>{{"../in.csv", "a file that is read"},
                                                                       {"../table", "the file of --csv"},
                                                                       {"a", "the file of runs"},
                                                                       {"x", "the file of runs"},
                                                                       {"/dev/null", "must be a regular file"},
                                                                       {".", "Is a directory"}}) {
    SCOPED_TRACE(target);
    fs::create_symlink(target, folder_.path("runs/c"));
    EXPECT_NE(refusal().find("runs"), std::string::npos) << refusal();
    EXPECT_NE(refusal().find(part), std::string::npos) << refusal();
    fs::remove(folder_.path("runs/c"));
  }
  EXPECT_EQ(files(), (std::set<std::string>{"in.csv", "runs"})) << "opened something";
}

TEST_F(OutputFileTest, KeepsWholeLinesOnAFullDisk) {
  const std::string row(99, '1');
  const FileSizeLimit limit(100'050);
  OutputFile file(folder_.path("a.csv"));
  const std::string error = error_of<OutputError>([&] {
    for (int k = 0; k < 2000; ++k) file.write(row + "\n");
  });
  expect_words(error, {"a.csv: cannot be written: no space", "a.csv.incomplete-"});
  EXPECT_EQ(files().size(), 1u);
  EXPECT_EQ(fs::file_size(file.name()), 100'000u);
}

TEST_F(OutputFileTest, FailsToCommitOnAFullDisk) {
  const int full = open("/dev/full", O_WRONLY);
  EXPECT_THROW(OutputFile("/proc/self/fd/" + std::to_string(full)).write("1\n"), OutputError);
  close(full);
  const FileSizeLimit limit(10);
  OutputFile file(folder_.path("a.csv"));
  file.write("1234\n1234\n1234\n");  // not yet on the disk
  EXPECT_THROW(file.commit(), OutputError);
  EXPECT_FALSE(folder_.has("a.csv"));
  EXPECT_EQ(fs::file_size(file.name()), 10u);
}

TEST_F(OutputFileTest, TakesRoomBeforehandAndGivesItBack) {
  OutputFile file(folder_.path("a.bag"), OutputFile::Access::kAnywhere);
  EXPECT_EQ(file.reserve(1 << 20), 0);
  file.write("1\n");
  file.commit();
  struct stat status {};
  ASSERT_EQ(stat(folder_.path("a.bag").c_str(), &status), 0);
  EXPECT_EQ(status.st_size, 2);
  EXPECT_LT(status.st_blocks * 512, 1 << 16);
  const FileSizeLimit limit(1 << 20);
  EXPECT_EQ(OutputFile(folder_.path("b.bag")).reserve(2 << 20), EFBIG);
}

}  // namespace
}  // namespace youbot_base_sim
