// simulate is killed, stopped, interrupted, denied space and run twenty times at once, at random moments: what stands
// under an output's name is always whole, what it was before or what the run makes, and what else is left tells by its
// name that it is incomplete.

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "physics/random_states.h"
#include "program.h"
#include "refusals.h"
#include "small_disk.h"

namespace youbot_base_sim {
namespace {

using Clock = std::chrono::steady_clock;

#ifdef YOUBOT_BASE_SIM_ROS
const std::vector<std::string> kOutputs = {"csv", "switches", "summary", "bag"};
#else
const std::vector<std::string> kOutputs = {"csv", "switches", "summary"};
#endif

/// The scene as a file, whose rows are many, so that most of a run is writing.
std::string scene_text(double torque) {
  return "duration: 1\noutput_rate: 1000\nsolver: {relative_tolerance: 1e-4}\ndrive: {torque: [{start: 0, constant: [" +
         std::to_string(torque) + ", 2, -1, 1]}]}\n";
}

std::vector<std::string> arguments(const std::string& scene, const std::string& folder) {
  std::vector<std::string> result = {scene, "--quiet"};
  for (const std::string& output : kOutputs) result.insert(result.end(), {"--" + output, folder + "/" + output});
  return result;
}

/// What a summary says of the motion: all but what it cost.
nlohmann::json motion_of(const std::string& summary) {
  const auto json = nlohmann::json::parse(summary, nullptr, false);
  return json.is_object() ? json.value("final", nlohmann::json()) : nlohmann::json();
}

bool same(const std::string& output, const std::string& a, const std::string& b) {
  return output == "summary" && a != b ? !motion_of(a).is_null() && motion_of(a) == motion_of(b) : a == b;
}

class InterruptedRunsTest : public testing::Test {
 protected:
  void SetUp() override {
    scene_ = folder_.write("scene.yaml", scene_text(1));
    const Clock::time_point start = Clock::now();
    Program run(SIMULATE, arguments(scene_, place("whole")));
    ASSERT_EQ(run.wait(), 0) << run.err();
    length_ = std::chrono::duration<double>(Clock::now() - start).count();
    whole_ = read(place("whole"));
  }

  /// A folder in the temporary one.
  std::string place(const std::string& name) const {
    std::filesystem::create_directories(folder_.path(name));
    return folder_.path(name);
  }

  /// The outputs in a folder, by their names.
  std::map<std::string, std::string> read(const std::string& folder) const {
    std::map<std::string, std::string> contents;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      std::ostringstream text;
      text << std::ifstream(entry.path()).rdbuf();
      contents[entry.path().filename()] = text.str();
    }
    return contents;
  }

  /// Outputs of an earlier run, of some length.
  void fill(const std::string& folder) const {
    for (const std::string& output : kOutputs) std::ofstream(folder + "/" + output) << kOld;
  }

  /// Each output must be whole, and all of them the run's if it is `done`. What else is there must be marked; of text,
  /// it must be the beginning of the whole, to the end of a line if `in_lines`.
  void expect_whole(const std::string& folder, bool done, bool in_lines) const {
    std::map<std::string, std::string> left = read(folder);
    for (const std::string& output : kOutputs) {
      ASSERT_TRUE(left.count(output)) << output << " is gone";
      EXPECT_TRUE((!done && left[output] == kOld) || same(output, left[output], whole_.at(output)))
          << output << " is neither old nor whole: " << left[output].size() << " of " << whole_.at(output).size();
      left.erase(output);
    }
    for (const auto& [name, content] : left) {
      const std::string output = name.substr(0, name.find('.'));
      EXPECT_NE(name.find(".incomplete-"), std::string::npos) << name;
      EXPECT_FALSE(done) << name << " is left though the run is done";
      if (output != "csv" && output != "switches") continue;
      EXPECT_EQ(whole_.at(output).compare(0, content.size(), content), 0) << name << " is no beginning of the whole";
      EXPECT_TRUE(!in_lines || content.empty() || content.back() == '\n') << name << " ends within a line";
    }
  }

  /// Sends a signal at a random moment of a run, again and again.
  void interrupt(int signal, unsigned seed) {
    Random random(seed);
    int ended = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      SCOPED_TRACE(testing::Message() << "signal " << signal << ", trial " << trial);
      const std::string folder = place("signal" + std::to_string(trial));
      fill(folder);
      Program run(SIMULATE, arguments(scene_, folder));
      std::this_thread::sleep_for(std::chrono::duration<double>(random.uniform(0, length_)));
      run.send(signal);
      const int status = run.wait();
      ended += status != 0;
      expect_whole(folder, status == 0, signal != SIGKILL);
    }
    EXPECT_GT(ended, 0) << "no signal came in time";
  }

  /// Runs where there is too little space; the run may not know it in advance.
  void run_out_of_space(const std::string& folder, Program& run) {
    EXPECT_EQ(run.wait(), 1);
    std::istringstream lines(run.err());
    int count = 0;
    for (std::string line; std::getline(lines, line); ++count)
      expect_refusal(line, {folder, "no space"});  // one for each
    EXPECT_GT(count, 0);
    expect_whole(folder, false, true);
  }

  static constexpr int kTrials = 6;
  static constexpr char kOld[] = "what was here before\n";

  TemporaryFolder folder_;
  std::string scene_;
  double length_ = 0;  // s of a run
  std::map<std::string, std::string> whole_;
};

TEST_F(InterruptedRunsTest, KilledAtAnyMoment) { interrupt(SIGKILL, 1); }
TEST_F(InterruptedRunsTest, ToldToEndAtAnyMoment) { interrupt(SIGTERM, 2); }
TEST_F(InterruptedRunsTest, InterruptedAtAnyMoment) { interrupt(SIGINT, 3); }
TEST_F(InterruptedRunsTest, TerminalGoneAtAnyMoment) { interrupt(SIGHUP, 4); }

TEST_F(InterruptedRunsTest, FilesMayNotGrow) {
  Random random(5);
  for (int trial = 0; trial < kTrials; ++trial) {
    const int blocks = static_cast<int>(std::pow(10, random.uniform(0.6, 3)));  // of 512 bytes; the motion is of 350 kB
    SCOPED_TRACE(testing::Message() << blocks << " blocks");
    const std::string folder = place("limit" + std::to_string(trial));
    fill(folder);
    // What is sent instead of an error ends a program as kill -9 does, unless it is ignored.
    std::string command = "trap '' XFSZ; ulimit -f " + std::to_string(blocks) + "; exec " SIMULATE;
    for (const std::string& argument : arguments(scene_, folder)) command += " '" + argument + "'";
    Program run("/bin/sh", {"-c", command});
    run_out_of_space(folder, run);
  }
}

TEST_F(InterruptedRunsTest, DiskIsFull) {
  std::vector<const char*> sizes = {"20k", "100k", "300k"};
#ifdef YOUBOT_BASE_SIM_ROS
  sizes.insert(sizes.end(), {"500k", "1m"});  // the motion finds room, its bag does not
#endif
  for (const char* size : sizes) {
    SCOPED_TRACE(size);
    const std::string folder = place(std::string("disk") + size);
    const SmallDisk disk(folder, size);
    if (!disk.mounted()) GTEST_SKIP() << "only root may mount a disk";
    fill(folder);
    Program run(SIMULATE, arguments(scene_, folder));
    run_out_of_space(folder, run);
  }
}

TEST_F(InterruptedRunsTest, TwentyWritersOfTheSameOutputs) {
  const std::string other = folder_.write("other.yaml", scene_text(-1));
  ASSERT_EQ(Program(SIMULATE, arguments(other, place("other"))).wait(), 0);
  const std::map<std::string, std::string> of_other = read(place("other"));
  const std::string folder = place("shared");
  std::vector<std::unique_ptr<Program>> runs;
  for (int k = 0; k < 20; ++k) {
    runs.push_back(std::make_unique<Program>(SIMULATE, arguments(k % 2 == 0 ? scene_ : other, folder)));
  }
  for (const auto& run : runs) EXPECT_EQ(run->wait(), 0) << run->err();
  const std::map<std::string, std::string> left = read(folder);
  EXPECT_EQ(left.size(), kOutputs.size());
  for (const std::string& output : kOutputs) {
    EXPECT_TRUE(same(output, left.at(output), whole_.at(output)) || same(output, left.at(output), of_other.at(output)))
        << output << " is of no run";
  }
}

}  // namespace
}  // namespace youbot_base_sim
