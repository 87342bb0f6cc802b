// The journal of a sweep: cut short or damaged anywhere, it goes on with whole rows, and never with another family's.

#include "youbot_base_sim/sweep/journal.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "errors.h"
#include "physics/random_states.h"
#include "temporary_folder.h"

namespace youbot_base_sim {
namespace {

const std::vector<std::string> kHead = {"1234 build of sweep", "5678 family.yaml"};
constexpr std::uint64_t kRuns = 12;
constexpr RunRange kAll{0, kRuns};

Row row_of(std::uint64_t run) {
  const RunStatus status = run % 5 == 4 ? RunStatus::kFailed : RunStatus::kDone;
  return {run, status, std::to_string(run) + ",0." + std::string(run, '7') + ",\"a, b\""};
}

class JournalTest : public testing::Test {
 protected:
  std::string path() const { return folder_.path("journal"); }

  std::vector<std::string> rows(const Journal& journal) {
    std::vector<std::string> texts;
    journal.for_each_row([&](const Row& row) { texts.push_back(row.text); });
    return texts;
  }

  /// Finishes the journal that is there, and expects all rows in it.
  void expect_goes_on(std::uint64_t least) {
    Journal journal(path(), kHead, kAll);
    EXPECT_GE(journal.tally().runs, least);
    for (std::uint64_t run = 0; run < kRuns; ++run) {
      if (!journal.finished().contains(run)) journal.append(row_of(run));
    }
    EXPECT_EQ(journal.tally().runs, kRuns);
    EXPECT_EQ(journal.tally().failed, 2u);
    const std::vector<std::string> found = rows(journal);
    ASSERT_EQ(found.size(), kRuns);
    for (std::uint64_t run = 0; run < kRuns; ++run) EXPECT_EQ(found[run], row_of(run).text);
  }

  std::string refusal(const std::vector<std::string>& head) {
    return error_of<OutputError>([&] { const Journal journal(path(), head, kAll); });
  }

  /// A journal with these runs, and its text.
  std::string written(const std::vector<std::uint64_t>& runs) {
    {
      Journal journal(path(), kHead, kAll);
      for (const std::uint64_t run : runs) journal.append(row_of(run));
    }
    return folder_.read("journal");
  }

  TemporaryFolder folder_;
};

TEST_F(JournalTest, ThatIsALinkLeavesNeitherLinkNorTarget) {
  std::filesystem::create_directory(folder_.path("elsewhere"));
  std::filesystem::create_symlink("elsewhere/link", path());
  std::filesystem::create_symlink("target", folder_.path("elsewhere/link"));
  expect_goes_on(0);
  EXPECT_TRUE(folder_.has("elsewhere/target"));
  Journal(path(), kHead, kAll).remove();
  for (const char* name : {"journal", "elsewhere/link", "elsewhere/target"})
    EXPECT_FALSE(std::filesystem::is_symlink(folder_.path(name)) || folder_.has(name)) << name;
}

TEST_F(JournalTest, GoesOnFromWhereverItWasCut) {
  const std::string text = written({1, 0, 2, 5, 4, 3});
  std::size_t ends = 0;
  for (std::size_t size = 0; size <= text.size(); ++size) {
    SCOPED_TRACE(size);
    folder_.write("journal", text.substr(0, size));
    ends += size > 0 && text[size - 1] == '\n' && size > text.find("\n\n") + 2;
    expect_goes_on(ends);
  }
  EXPECT_EQ(ends, 6u);
}

TEST_F(JournalTest, TakesNoDamagedRow) {
  const std::string text = written({0, 1, 2, 3, 4, 5});
  const std::size_t begin = text.find("\n\n") + 2;
  Random random(6);
  for (int trial = 0; trial < 200; ++trial) {
    std::string damaged = text;
    const auto at =
        static_cast<std::size_t>(random.uniform(static_cast<double>(begin), static_cast<double>(text.size())));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << static_cast<int>(random.uniform(0, 8))));
    SCOPED_TRACE(at);
    folder_.write("journal", damaged);
    expect_goes_on(0);
  }
}

TEST_F(JournalTest, KeepsTheRowsAfterADamagedOne) {
  std::string text = written({0, 1, 2, 3, 4, 5});
  text[text.find("\n\n") + 4] ^= 1;
  folder_.write("journal", text);
  expect_goes_on(5);
}

TEST_F(JournalTest, TakesNoRowTwiceAndNoneBeyondTheLast) {
  const std::string text = written({0, 1}), line = text.substr(text.rfind('\n', text.size() - 2) + 1);
  folder_.write("journal", text + line);
  EXPECT_EQ(Journal(path(), kHead, kAll).tally().runs, 2u);
  folder_.write("journal", text);
  EXPECT_EQ(Journal(path(), kHead, {0, 1}).tally().runs, 1u);
}

TEST_F(JournalTest, IsRefusedUnlessItIsThisSweeps) {
  written({0});
  EXPECT_NE(refusal({"1234 build of sweep", "9999 family.yaml"}).find("another family.yaml"), std::string::npos);
  EXPECT_NE(refusal({"9999 build of sweep", "5678 family.yaml"}).find("another build of sweep"), std::string::npos);
  EXPECT_NE(refusal({"1234 build of sweep"}).find("more files"), std::string::npos);
  EXPECT_NE(refusal({"1234 build of sweep", "5678 family.yaml", "1 x.csv"}).find("another x.csv"), std::string::npos);
  folder_.write("journal", "my diary\n");
  EXPECT_NE(refusal(kHead).find("no journal"), std::string::npos);
  EXPECT_EQ(folder_.read("journal"), "my diary\n");
}

TEST_F(JournalTest, HasOneWriter) {
  const Journal journal(path(), kHead, kAll);
  EXPECT_NE(refusal(kHead).find("another sweep"), std::string::npos);
}

TEST_F(JournalTest, OfASliceHasTheRunsOfThat) {
  Journal journal(path(), kHead, {5, 8});
  for (const std::uint64_t run : {7u, 5u, 6u}) {
    EXPECT_FALSE(journal.is_complete());
    journal.append(row_of(run));
  }
  EXPECT_TRUE(journal.is_complete());
  EXPECT_EQ(rows(journal), (std::vector<std::string>{row_of(5).text, row_of(6).text, row_of(7).text}));
}

TEST(FinishedRuns, AreRememberedInAnyOrderWithinTheWindow) {
  constexpr std::uint64_t kWindow = FinishedRuns::kWindow;
  FinishedRuns finished(0);
  std::set<std::uint64_t> expected;
  Random random(3);
  while (finished.first_open() < 3 * kWindow) {
    const auto ahead = static_cast<std::uint64_t>(random.uniform(0, random.uniform(0, 1) < 0.001 ? kWindow : 20));
    const std::uint64_t run = finished.first_open() + ahead;
    ASSERT_TRUE(finished.has_room_for(run));
    ASSERT_EQ(finished.contains(run), expected.count(run) == 1);
    finished.insert(run);
    expected.insert(run);
    expected.erase(expected.begin(), expected.lower_bound(finished.first_open()));
    ASSERT_EQ(expected.count(finished.first_open()), 0u);
  }
  EXPECT_FALSE(finished.has_room_for(finished.first_open() + kWindow));
  EXPECT_TRUE(finished.contains(0));
}

}  // namespace
}  // namespace youbot_base_sim
