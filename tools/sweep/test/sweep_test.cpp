// The program `sweep` as a user runs it: its table, messages and exit status, and that the table is the same by
// whatever number of threads, ranks and restarts.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <thread>

#include "physics/random_states.h"
#include "program.h"
#include "promises/small_disk.h"
#include "terminal.h"

namespace youbot_base_sim {
namespace {

namespace fs = std::filesystem;

/// A table of CSV by its columns.
class Table {
 public:
  explicit Table(const std::string& text) {
    std::istringstream stream(text);
    std::string line;
    std::getline(stream, line);
    const std::vector<std::string> names = cells(line);
    while (std::getline(stream, line)) {
      const std::vector<std::string> row = cells(line);
      EXPECT_EQ(row.size(), names.size()) << line;
      for (std::size_t k = 0; k < std::min(row.size(), names.size()); ++k) columns_[names[k]].push_back(row[k]);
    }
  }
  const std::vector<std::string>& operator[](const std::string& name) const { return columns_.at(name); }
  std::size_t rows() const { return columns_.empty() ? 0 : columns_.begin()->second.size(); }

 private:
  static std::vector<std::string> cells(const std::string& line) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == ',' && !quoted) cells.emplace_back();
      if (c != '"' && (c != ',' || quoted)) cells.back() += c;
    }
    return cells;
  }
  std::map<std::string, std::vector<std::string>> columns_;
};

class SweepTest : public testing::Test {
 protected:
  SweepTest() {
    folder_.write("scene.yaml",
                  "duration: 0.3\noutput_rate: 50\nsolver: {relative_tolerance: 1.0e-5}\ninitial: {wheel_angles: [0.1, "
                  "0.2, 0.3, 0.4]}\ndrive: {torque: [{start: 0, constant: [2, 1, -1, 2]}]}\n");
  }

  /// A family of `draws` runs.
  std::string family(int draws, const std::string& more = "") {
    return folder_.write("family.yaml",
                         "scene: scene.yaml\naxes:\n  - {key: 'initial.wheel_angles[1]', uniform: {from: 0, to: 1}}\n"
                         "  - {key: floor.friction, log_uniform: {from: 0.01, to: 1}}\ndraws: " +
                             std::to_string(draws) + "\nsampling: latin_hypercube\n" + more);
  }

  /// The table that `sweep` makes with these further arguments.
  std::string table(const std::string& family, std::vector<std::string> further = {}) {
    further.insert(further.begin(), {family, "--csv", folder_.path("table.csv"), "--quiet"});
    Program sweep(SWEEP, further);
    EXPECT_EQ(sweep.wait(), 0) << sweep.err();
    EXPECT_FALSE(folder_.has("table.csv.journal"));
    return folder_.read("table.csv");
  }

  std::string journal() const { return folder_.read("table.csv.journal"); }

  static long lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

  TemporaryFolder folder_;
};

// Values with line ends, which rows of the journal cannot have.
TEST_F(SweepTest, ValuesInBlockStyleAreThoseInFlowStyle) {
  const std::string begin = "scene: scene.yaml\naxes:\n  - key: initial.wheel_angles\n    values:";
  const std::string flow = table(folder_.write("flow.yaml", begin + " [[0.1, 0.2, 0.3, 0.4], [0.5, 0.6, 0.7, 0.8]]\n"));
  const std::string block =
      folder_.write("block.yaml", begin +
                                      "\n    - - 0.1\n      - 0.2\n      - 0.3\n      - 0.4\n    - - 0.5\n      - 0.6\n"
                                      "      - 0.7\n      - 0.8\n");
  EXPECT_EQ(table(block), flow);
  EXPECT_EQ(lines(flow), 3);
}

// A pipe ends with its first reading, and a table of --reuse is read twice.
TEST_F(SweepTest, RefusesToReuseAPipe) {
  const std::string f = family(4);
  table(f);
  Program shell("/bin/sh", {"-c", R"(cat "$1" | exec "$0" "$2" --csv "$3" --reuse /dev/stdin)", SWEEP,
                            folder_.path("table.csv"), f, folder_.path("other.csv")});
  EXPECT_EQ(shell.wait(), 2);
  EXPECT_EQ(shell.err(), "sweep: --reuse = /dev/stdin: must be a file, which is read twice, rather than a pipe\n");
}

TEST_F(SweepTest, ARowIsWhatSimulateMakesOfItsScene) {
  const std::string f = family(4);
  const Table rows(table(f));
  ASSERT_EQ(rows.rows(), 4u);
  for (std::size_t run = 0; run < 4; ++run) {
    Program print(SWEEP, {f, "--scene", std::to_string(run)});
    ASSERT_EQ(print.wait(), 0) << print.err();
    const std::string scene = folder_.write("run.yaml", print.out());
    Program simulate(SIMULATE, {scene, "--quiet", "--summary", folder_.path("summary")});
    ASSERT_EQ(simulate.wait(), 0) << simulate.err();
    const auto summary = nlohmann::json::parse(folder_.read("summary"));
    EXPECT_EQ(rows["run"][run], std::to_string(run));
    EXPECT_EQ(rows["status"][run], "done");
    EXPECT_EQ(rows["reliable"][run], summary["reliable"] ? "true" : "false");
    for (const char* name : {"x", "y", "psi", "V_X", "V_Y", "Omega"}) {
      EXPECT_EQ(std::stod(rows[name][run]), summary["final"][name].get<double>()) << name;
    }
    EXPECT_EQ(std::stod(rows["path_length"][run]), summary["path_length"]["base"].get<double>());
    EXPECT_EQ(std::stod(rows["drive_work"][run]), summary["energy"]["drive_work"].get<double>());
    EXPECT_EQ(std::stod(rows["energy_balance_error"][run]), summary["energy"]["max_balance_error"].get<double>());
    EXPECT_EQ(std::stod(rows["switches"][run]), summary["switches"].get<double>());
    EXPECT_GT(std::stod(rows["largest_slip"][run]), 0);
    EXPECT_GT(std::stod(rows["odometry_error"][run]), 0);
  }
}

TEST_F(SweepTest, SameTableByAnyNumberOfThreads) {
  const std::string f = family(40);
  const std::string one = table(f, {"--threads", "1"});
  EXPECT_EQ(lines(one), 41);
  EXPECT_EQ(table(f, {"--threads", "2"}), one);
  EXPECT_EQ(table(f, {"--threads", "3"}), one);
  EXPECT_EQ(table(f), one);
}

TEST_F(SweepTest, SlicesPutTogetherAreTheWhole) {
  const std::string f = family(23), whole = table(f);
  std::string together;
  for (int k = 1; k <= 4; ++k) {
    const std::string slice = table(f, {"--slice", std::to_string(k) + "/4"});
    together += k == 1 ? slice : slice.substr(slice.find('\n') + 1);
  }
  EXPECT_EQ(together, whole);
}

/// A table grows by draws and by points of the grid, and no run that it has is simulated again.
TEST_F(SweepTest, ReusesTheRowsOfAnotherTable) {
  const auto family_of = [&](int draws, const std::string& masses, const std::string& more = "") {
    return folder_.write("grown.yaml", "scene: scene.yaml\naxes:\n  - {key: robot.body_mass, values: " + masses +
                                           "}\n  - {key: floor.friction, uniform: {from: 0.1, to: 1}}\ndraws: " +
                                           std::to_string(draws) + "\nsampling: sobol\n" + more);
  };
  const std::string old = folder_.write("old.csv", table(family_of(4, "[20, 40]"))),
                    whole = table(family_of(8, "[20, 40, 30]"));
  EXPECT_EQ(table(family_of(8, "[20, 40, 30]"), {"--reuse", old}), whole);
  // A row that is not among those made again says which ones are taken.
  std::string marked = folder_.read("old.csv");
  const std::size_t row = marked.find("\n2,") + 1;
  marked.insert(marked.find('\n', row), "taken");
  folder_.write("old.csv", marked);
  EXPECT_EQ(lines(table(family_of(8, "[20, 40, 30]"), {"--reuse", old})), lines(whole));
  EXPECT_NE(folder_.read("table.csv").find("taken\n"), std::string::npos);

  const auto expect_refused = [&](const std::string& f, const std::vector<std::string>& words) {
    Program sweep(SWEEP, {f, "--csv", folder_.path("other.csv"), "--reuse", old});
    EXPECT_EQ(sweep.wait(), 2);
    for (const std::string& word : words) EXPECT_NE(sweep.err().find(word), std::string::npos) << sweep.err();
    EXPECT_FALSE(folder_.has("other.csv"));
  };
  expect_refused(family_of(8, "[20, 30]"), {"old.csv: row 4: ", "robot.body_mass = 40: must be 20"});
  expect_refused(family_of(8, "[20, 40]", "seed: 2\n"), {"row 0: ", "floor.friction = 0."});
  expect_refused(family_of(8, "[20, 40]", "quantities: [x, psi]\n"), {"column y: must be psi"});
  expect_refused(family(40), {"latin_hypercube: must be independent or sobol"});
  folder_.write("old.csv", whole.substr(0, whole.size() - 5));
  expect_refused(family_of(8, "[20, 40, 30]"), {"is torn"});
  folder_.write("old.csv", whole);
  folder_.write("scene.yaml",
                "duration: 0.3\noutput_rate: 50\ndrive: {torque: [{start: 0, constant: [2, 1, 1, 2]}]}\n");
  expect_refused(family_of(8, "[20, 40, 30]"), {"run 0: x = ", "by this scene"});
}

TEST_F(SweepTest, KilledAtAnyMomentItGoesOn) {
  const std::string f = family(400), whole = table(f);
  Random random(7);
  int kills = 0;
  std::size_t most = 0;
  for (int trial = 0; trial < 3; ++trial) {
    fs::remove(folder_.path("table.csv"));
    // Each may take longer than the one before, so that there is an end on a machine of any speed.
    for (int status = -1, attempt = 1; status != 0; ++attempt, ++kills) {
      Program sweep(SWEEP, {f, "--csv", folder_.path("table.csv"), "--threads", std::to_string(1 + attempt % 3)});
      std::this_thread::sleep_for(std::chrono::duration<double>(random.uniform(0, 0.05 * attempt)));
      sweep.kill();
      status = sweep.wait();
      if (folder_.has("table.csv")) {
        EXPECT_EQ(folder_.read("table.csv"), whole);
      }
      if (status != 0) most = std::max(most, journal().size());
    }
    EXPECT_EQ(folder_.read("table.csv"), whole);
    EXPECT_FALSE(folder_.has("table.csv.journal"));
  }
  EXPECT_GT(kills, 3) << "no kill came in time";
  EXPECT_GT(most, 1000u) << "no row was ever kept";
}

TEST_F(SweepTest, ASignalEndsItWithALineThatSaysHowToGoOn) {
  const std::string f = family(1000), whole = table(f, {"--threads", "1"});
  int stopped = 0;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    fs::remove(folder_.path("table.csv"));
    Program sweep(SWEEP, {f, "--csv", folder_.path("table.csv"), "--threads", "1", "--quiet"});
    for (int tries = 0; lines(journal()) < 8 && tries < 30000; ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    sweep.send(signal);
    if (sweep.wait() == 0) continue;  // it was faster
    ++stopped;
    EXPECT_TRUE(std::regex_match(sweep.err(), std::regex("sweep: stopped by signal [0-9]+, .*; [0-9]+ of 1000 runs are "
                                                         "in .*journal; the same command goes on from there\n")))
        << sweep.err();
    Program again(SWEEP, {f, "--csv", folder_.path("table.csv")});
    EXPECT_EQ(again.wait(), 0) << again.err();
    EXPECT_NE(again.out().find(" of 1000 runs were finished before\n"), std::string::npos) << again.out();
    EXPECT_EQ(folder_.read("table.csv"), whole);
  }
  EXPECT_GT(stopped, 0);
}

TEST_F(SweepTest, AFullDiskEndsItAndItGoesOn) {
  const std::string f = family(60), whole = table(f);
  fs::create_directory(folder_.path("disk"));
  const SmallDisk disk(folder_.path("disk"), "8k");
  if (!disk.mounted()) GTEST_SKIP() << "only root may mount a disk";
  const std::string at = folder_.path("disk/table.csv");
  Program sweep(SWEEP, {f, "--csv", at, "--quiet"});
  EXPECT_EQ(sweep.wait(), 1);
  EXPECT_NE(sweep.err().find("no space left"), std::string::npos) << sweep.err();
  EXPECT_EQ(lines(sweep.err()), 1);
  fs::copy(at + ".journal", folder_.path("table.csv.journal"));
  fs::remove(folder_.path("table.csv"));
  EXPECT_GT(lines(journal()), 8);
  EXPECT_EQ(table(f), whole);
}

TEST_F(SweepTest, AFileThatMayNotGrowEndsItAndItGoesOn) {
  const std::string f = family(60), whole = table(f);
  fs::remove(folder_.path("table.csv"));
  const std::string command = " '" + f + "' --csv '" + folder_.path("table.csv") + "' --quiet";
  for (const char* blocks : {"4", "16"}) {
    Program sweep("/bin/sh", {"-c", std::string("trap '' XFSZ; ulimit -f ") + blocks + "; exec " SWEEP + command});
    EXPECT_EQ(sweep.wait(), 1);
    EXPECT_NE(sweep.err().find("no space left"), std::string::npos) << sweep.err();
    EXPECT_FALSE(folder_.has("table.csv"));
  }
  EXPECT_EQ(table(f), whole);
}

TEST_F(SweepTest, WithoutAnySpaceItIsNotCompletedAndLeavesNothing) {
  const std::string command = " '" + family(6, "trajectories: {every: 1}\n") + "' --quiet --csv ";
  std::set<std::string> before, after;
  for (const auto& entry : fs::directory_iterator(folder_.path(""))) before.insert(entry.path().filename());
  // Standard error is no file, which could not grow either.
  Program sweep("/bin/sh", {"-c", "{ (trap '' XFSZ; ulimit -f 0; exec " SWEEP + command + "'" +
                                      folder_.path("table.csv") + "'); echo status $?; } 2>&1 | cat"});
  sweep.wait();
  EXPECT_TRUE(std::regex_match(
      sweep.out(), std::regex("sweep: .*table.csv.journal: cannot be written: no space left for it .*\nstatus 1\n")))
      << sweep.out();
  for (const auto& entry : fs::directory_iterator(folder_.path(""))) after.insert(entry.path().filename());
  EXPECT_EQ(after, before);
}

TEST_F(SweepTest, GoesOnWithTheSameFamilyOnly) {
  const std::string f = family(20000);
  {
    Program sweep(SWEEP, {f, "--csv", folder_.path("table.csv"), "--threads", "1"});
    for (int tries = 0; lines(journal()) < 6 && tries < 3000; ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    Program beside(SWEEP, {f, "--csv", folder_.path("table.csv")});
    EXPECT_EQ(beside.wait(), 2);
    EXPECT_NE(beside.err().find("is being written by another sweep"), std::string::npos) << beside.err();
  }  // killed
  const std::string before = journal();
  family(20000, "seed: 2\n");
  Program other(SWEEP, {f, "--csv", folder_.path("table.csv")});
  EXPECT_EQ(other.wait(), 2);
  EXPECT_NE(other.err().find("was begun with another family.yaml"), std::string::npos) << other.err();
  EXPECT_EQ(journal(), before);
}

TEST_F(SweepTest, RunsThatAreRefusedOrFailAreRowsWithTheirReasons) {
  // A radius that is fine by itself is refused beside some of the others; a tall load tips over when the base brakes.
  folder_.write("brake.yaml",
                "duration: 0.5\noutput_rate: 20\nrobot: {profile: measured, normal_reactions: dynamic}\n"
                "loads: [{mass: 25, position: [0, 0, 0.1]}]\ninitial: {twist: [0, 0.6, 0]}\n"
                "drive: {torque: [{start: 0, constant: [3, -3, -3, 3]}]}\n");
  const std::string f =
      folder_.write("brake_family.yaml",
                    "scene: brake.yaml\naxes:\n  - {key: 'loads[0].position[2]', values: [0.1, 0.9]}\n"
                    "  - {key: robot.wheel_radius, values: [0.05, 0.06]}\n  - {key: robot.roller_axis_radius, values: "
                    "[0.045, 0.055]}\n"
                    "quantities: [x, largest_slip]\n");
  Program sweep(SWEEP, {f, "--csv", folder_.path("table.csv"), "--quiet"});
  // The trial of roller_axis_radius = 0.055 beside the wheel_radius in the middle, 0.06, is fine.
  EXPECT_EQ(sweep.wait(), 0) << sweep.err();
  const Table rows(folder_.read("table.csv"));
  ASSERT_EQ(rows.rows(), 8u);
  int refused = 0, failed = 0;
  for (std::size_t run = 0; run < 8; ++run) {
    const std::string& status = rows["status"][run];
    refused += status == "refused";
    failed += status == "failed";
    EXPECT_EQ(status == "refused",
              rows["robot.wheel_radius"][run] == "0.05" && rows["robot.roller_axis_radius"][run] == "0.055");
    EXPECT_EQ(rows["x"][run].empty(), status != "done");
    EXPECT_EQ(rows["reason"][run].empty(), status == "done");
    const std::string why = status == "refused" ? "less than wheel_radius" : status == "failed" ? "tip" : "";
    EXPECT_NE(rows["reason"][run].find(why), std::string::npos) << rows["reason"][run];
  }
  EXPECT_EQ(refused, 2);
  EXPECT_EQ(failed, 3);
  EXPECT_NE(sweep.err().find("3 failed, 2 refused"), std::string::npos) << sweep.err();
}

TEST_F(SweepTest, ListSaysHowManyRunsAndHowLong) {
  Program sweep(SWEEP, {family(60), "--list", "--threads", "2"});
  EXPECT_EQ(sweep.wait(), 0) << sweep.err();
  const std::string out = sweep.out();
  EXPECT_EQ(out.find("60 runs of "), 0u) << out;
  EXPECT_NE(out.find("floor.friction: log-uniform from 0.01 to 1"), std::string::npos) << out;
  EXPECT_TRUE(std::regex_search(out, std::regex("the first run took .* s; at that, all take .* on 2 threads"))) << out;
}

TEST_F(SweepTest, TellsTheSpreadOfEachQuantity) {
  const std::string f = folder_.write("spread.yaml",
                                      "scene: scene.yaml\naxes: [{key: 'initial.pose[0]', values: [1, 2, 5]}]\n"
                                      "quantities: [x, y, V_X]\n");
  folder_.write("scene.yaml",
                "duration: 0.1\ninitial: {pose: [0, 0, 90], twist: [-1.0e-20, 0, 0]}\ndrive: {torque: [{start: 0, "
                "constant: [0, 0, 0, 0]}]}\n");
  Program sweep(SWEEP, {f, "--csv", folder_.path("table.csv")});
  EXPECT_EQ(sweep.wait(), 0) << sweep.err();
  EXPECT_NE(sweep.err().find("sweep: warning: initial.pose has 90 rad"), std::string::npos) << sweep.err();
  std::smatch found;
  const std::string out = sweep.out();
  ASSERT_TRUE(std::regex_search(out, found, std::regex("\nx +(\\S+) +(\\S+) +(\\S+) +(\\S+) +(\\S+)\n"))) << out;
  const double expected[] = {1, 5, 4, 8.0 / 3, std::sqrt(13.0 / 3)};
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(std::stod(found[k + 1]), expected[k], 0.01) << k;
  EXPECT_TRUE(std::regex_search(out, std::regex("\nV_X( +0){5}\n"))) << out;
}

TEST_F(SweepTest, KeepsTrajectories) {
  const std::string f = family(11, "trajectories: {every: 5}\n");
  table(f);
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_.path("table_runs"))) names.insert(entry.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{"run_00.csv", "run_05.csv", "run_10.csv"}));
  Program print(SWEEP, {f, "--scene", "5"});
  print.wait();
  Program simulate(SIMULATE, {folder_.write("run.yaml", print.out()), "--quiet", "--csv", folder_.path("motion")});
  EXPECT_EQ(simulate.wait(), 0);
  EXPECT_EQ(folder_.read("table_runs/run_05.csv"), folder_.read("motion"));
#ifdef YOUBOT_BASE_SIM_ROS
  // Many bags at once: rosbag is not made for that.
  const Table rows(table(family(40, "trajectories: {format: bag}\n"), {"--threads", "4"}));
  for (const std::string& status : rows["status"]) EXPECT_EQ(status, "done");
  EXPECT_TRUE(folder_.has("table_runs/run_00.bag"));
  EXPECT_TRUE(folder_.has("table_runs/run_39.bag"));
#endif
}

TEST_F(SweepTest, ShowsABarOnATerminal) {
  const Terminal terminal;
  Program sweep("/bin/sh", {"-c", "exec " SWEEP " '" + family(10000) + "' --csv '" + folder_.path("table.csv") +
                                      "' --threads 1 > /dev/null 2> " + terminal.path()});
  // Until a run is finished the number of runs a second is not known.
  for (int tries = 0; lines(journal()) < 8 && tries < 30000; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(1800));
  sweep.send(SIGINT);
  EXPECT_EQ(sweep.wait(), 1);
  const std::string text = terminal.text();
  EXPECT_TRUE(std::regex_search(text, std::regex("\r\\[[# ]+\\] [0-9]+ of 10000 runs, \\S+ a second, .* left")))
      << text;
  EXPECT_TRUE(std::regex_search(Terminal::lines(text)[0], std::regex("^sweep: stopped by signal"))) << text;
}

#ifdef MPIRUN
/// A sweep by several ranks on this machine.
class RanksTest : public SweepTest {
 protected:
  std::vector<std::string> arguments(int ranks, const std::string& family) const {
    return {"--allow-run-as-root",     "--oversubscribe", "-n", std::to_string(ranks), SWEEP, family, "--csv",
            folder_.path("table.csv"), "--quiet"};
  }
};

TEST_F(RanksTest, SameTableByAnyNumberOfRanks) {
  const std::string f = family(40), whole = table(f);
  for (const int ranks : {1, 2, 4}) {
    fs::remove(folder_.path("table.csv"));
    Program sweep(MPIRUN, arguments(ranks, f));
    EXPECT_EQ(sweep.wait(), 0) << sweep.err();
    EXPECT_EQ(folder_.read("table.csv"), whole) << ranks;
  }
}

TEST_F(RanksTest, ADeadRankEndsTheJobWhichGoesOn) {
  const std::string f = family(400), whole = table(f);
  fs::remove(folder_.path("table.csv"));
  {
    Program sweep(MPIRUN, arguments(3, f));
    for (int tries = 0; lines(journal()) < 20 && tries < 10000; ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    const std::string id = std::to_string(sweep.id());
    std::ifstream children("/proc/" + id + "/task/" + id + "/children");
    pid_t rank = 0;
    while (children >> rank) continue;
    ASSERT_GT(rank, 0);
    ::kill(rank, SIGKILL);
    EXPECT_NE(sweep.wait(), 0);
  }
  EXPECT_FALSE(folder_.has("table.csv"));
  EXPECT_GT(lines(journal()), 19);
  Program again(MPIRUN, arguments(2, f));
  EXPECT_EQ(again.wait(), 0) << again.err();
  EXPECT_EQ(folder_.read("table.csv"), whole);
}

TEST_F(RanksTest, ARefusedFamilyIsOneLine) {
  Program sweep(MPIRUN, arguments(3, folder_.write("bad.yaml", "scene: scene.yaml\n")));
  EXPECT_EQ(sweep.wait(), 2);
  // MPI may have lines of its own before it, as where there is no /sys.
  const std::string err = sweep.err();
  const std::size_t line = err.find("sweep: ");
  ASSERT_NE(line, std::string::npos) << err;
  EXPECT_TRUE(line == 0 || err[line - 1] == '\n') << err;
  EXPECT_EQ(err.find("sweep: ", line + 1), std::string::npos) << err;
}
#endif

}  // namespace
}  // namespace youbot_base_sim
