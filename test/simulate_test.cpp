// The program `simulate` as a user runs it: its files, messages and exit status.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "errors.h"
#include "program.h"
#include "terminal.h"

namespace youbot_base_sim {
namespace {

namespace fs = std::filesystem;

const std::string kMotion =
    "initial: {wheel_angles: [0.5, 0.5, 0.5, 0.5]}\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n";
const std::string kScene = "duration: 0.25\noutput_rate: 10\n" + kMotion;
const std::string kLongRow = "duration: 1.0e+5\noutput_rate: 1.0e-5\n";  // a day in one row

class SimulateTest : public testing::Test {
 protected:
  static long lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

  /// A command line of sh, for limits and redirections; `simulate` stands for the program.
  static std::vector<std::string> shell(const std::string& command) {
    return {"-c", "simulate() { " SIMULATE " \"$@\"; }; " + command};
  }

  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path(""))) names.insert(entry.path().filename());
    return names;
  }

  /// The one that is kept of output `name` of a run that ended early; empty if there is none.
  std::string incomplete(const std::string& name) const {
    for (const std::string& file : files()) {
      if (file.find(name + ".incomplete-") == 0) return file;
    }
    return "";
  }

  /// Waits until a run has opened output `name`, but not forever.
  void await_output(const std::string& name) const {
    for (int tries = 0; incomplete(name).empty() && tries < 3000; ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  TemporaryFolder folder_;
};

// A comment, which tells what made the file, then the same rows; the printed scene is the same motion.
TEST_F(SimulateTest, SaysWhatMadeItsFiles) {
  const std::string scene = folder_.write("scene.yaml", kScene), printed = folder_.path("printed.yaml");
  const auto run = [&](const std::string& command) {
    Program sh("/bin/sh", shell(command));
    EXPECT_EQ(sh.wait(), 0) << sh.err();
  };
  const std::string options = " --relative-tolerance 1e-5 --quiet ";
  run("simulate --print-scene " + scene + options + "> " + printed);
  run("simulate " + scene + options + "--csv " + folder_.path("plain.csv") + " --summary " + folder_.path("s.json"));
  run("simulate " + printed + " --csv-comment --csv " + folder_.path("a.csv") + " --switches " + folder_.path("s.csv"));
  const auto summary = nlohmann::json::parse(folder_.read("s.json"));
  const std::string comment = "# youbot_base_sim " + summary["version"].get<std::string>() + ", scene " +
                              summary["scene"].get<std::string>() + "\n";
  EXPECT_EQ(summary["scene"].get<std::string>().size(), 16u);
  EXPECT_EQ(folder_.read("printed.yaml").find(comment), 0u);
  EXPECT_EQ(folder_.read("a.csv"), comment + folder_.read("plain.csv"));
  EXPECT_EQ(folder_.read("s.csv").find(comment + "t,wheel"), 0u);
}

TEST_F(SimulateTest, WritesWhatItIsAskedFor) {
  const std::string scene = folder_.write("scene.yaml", kScene);
  Program simulate(SIMULATE, {scene, "--csv", folder_.path("a.csv"), "--switches", folder_.path("s.csv"), "--summary",
                              folder_.path("s.json")});
  ASSERT_EQ(simulate.wait(), 0) << simulate.err();
  const std::string csv = folder_.read("a.csv");
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "t,x,y,psi,V_X,V_Y,Omega,phi_fl,phi_fr,phi_bl,phi_br,dphi_fl,dphi_fr,dphi_bl,dphi_br,"
            "dgamma_fl,dgamma_fr,dgamma_bl,dgamma_br");
  EXPECT_EQ(lines(csv), 1 + 4);  // t = 0, 0.1, 0.2 and the end, 0.25
  EXPECT_NE(csv.find("\n0.25,"), std::string::npos);
  const std::string switches = folder_.read("s.csv");
  EXPECT_EQ(switches.substr(0, switches.find('\n')), "t,wheel,roller_from,roller_to,phi,direction,count");
  const std::string first = switches.substr(switches.find('\n') + 1);
  EXPECT_EQ(first.substr(first.find('\n') - 2, 2), ",1") << "located";
  const auto summary = nlohmann::json::parse(folder_.read("s.json"));
  EXPECT_EQ(summary["simulated_time"], 0.25);
  EXPECT_EQ(summary["switches"], lines(switches) - 1);
  EXPECT_GE(lines(switches) - 1, 4);  // all four wheels pass 30 deg
  EXPECT_LT(summary["energy_balance_error"], 1e-4);
  for (const char* key : {"wall_time", "real_time_factor", "steps", "rejected_steps"})
    EXPECT_GE(summary[key], 0) << key;
  for (const char* key : {"x", "y", "psi", "V_X", "V_Y", "Omega"}) EXPECT_TRUE(summary["final"].contains(key)) << key;
  EXPECT_EQ(simulate.out().find("final pose      x "), 0u) << simulate.out();
  EXPECT_EQ(simulate.out().find("roller switches"), std::string::npos) << "counters without --verbose";
  Program verbose(SIMULATE, {scene, "--verbose"});
  ASSERT_EQ(verbose.wait(), 0) << verbose.err();
  EXPECT_NE(verbose.out().find("roller switches"), std::string::npos) << verbose.out();
  EXPECT_EQ(simulate.err(), "");  // no progress bar into a file
  Program rest(SIMULATE, {folder_.write("rest.yaml",
                                        "duration: 0.01\ninitial: {twist: [-1.0e-20, 0, 0]}\n"
                                        "drive: {torque: [{start: 0, constant: [0, 0, 0, 0]}]}\n")});
  ASSERT_EQ(rest.wait(), 0) << rest.err();
  EXPECT_EQ(rest.out().find("-0.0"), std::string::npos) << rest.out();
}

TEST_F(SimulateTest, NumbersReadBackToTheSameDouble) {
  const std::string scene = folder_.write("scene.yaml", kScene);
  Program simulate(SIMULATE, {scene, "--quiet", "--csv", folder_.path("a.csv"), "--summary", folder_.path("s.json")});
  ASSERT_EQ(simulate.wait(), 0) << simulate.err();
  EXPECT_EQ(simulate.out(), "");
  const std::string csv = folder_.read("a.csv");
  const std::string last = csv.substr(csv.rfind('\n', csv.size() - 2) + 1);
  const double x = std::strtod(last.c_str() + last.find(',') + 1, nullptr);
  EXPECT_EQ(x, nlohmann::json::parse(folder_.read("s.json"))["final"]["x"].get<double>());
}

TEST_F(SimulateTest, ModelAndToleranceFromTheCommandLine) {
  const std::string scene = folder_.write("scene.yaml", kScene);
  Program simulate(SIMULATE,
                   {scene, "--model", "no_slip", "--relative-tolerance", "1e-5", "--summary", folder_.path("s.json")});
  ASSERT_EQ(simulate.wait(), 0) << simulate.err();
  const auto summary = nlohmann::json::parse(folder_.read("s.json"));
  EXPECT_EQ(summary["model"], "no_slip");
  EXPECT_EQ(summary["relative_tolerance"], 1e-5);
  EXPECT_EQ(summary["switches"], 0);
}

TEST_F(SimulateTest, SummaryTellsWhatTheRunTook) {
  // Coasting sideways into rest: the energy is known at the start, and no drive works.
  const std::string scene = folder_.write("scene.yaml",
                                          "duration: 2\noutput_rate: 1000\ninitial: {twist: [0, 0.5, 0]}\n"
                                          "drive: {torque: [{start: 0, constant: [0, 0, 0, 0]}]}\n");
  ASSERT_EQ(Program(SIMULATE, {scene, "--quiet", "--summary", folder_.path("s.json")}).wait(), 0);
  const auto summary = nlohmann::json::parse(folder_.read("s.json"));
  EXPECT_EQ(summary["completed"], true);
  const auto& slowest = summary["slowest_period"];
  EXPECT_NEAR(slowest["length"], 1e-3, 1e-9);
  EXPECT_NEAR(slowest["cost"].get<double>(), slowest["cpu_time"].get<double>() / 1e-3, 1e-6);
  EXPECT_LE(slowest["cpu_time"], summary["cpu_time"]);
  EXPECT_EQ(summary["periods"]["count"], 2000);
  EXPECT_LE(summary["periods"]["cpu_time_99_9"], slowest["cpu_time"]);
  EXPECT_GE(summary["energy"]["max_balance_error"], summary["energy_balance_error"]);
  EXPECT_GE(summary["energy"]["max_kinetic"], 0.5 * 35.6 * 0.25);
  EXPECT_EQ(summary["energy"]["drive_work"], 0);
  EXPECT_GE(summary["path_length"]["base"].get<double>(),
            std::hypot(summary["final"]["x"].get<double>(), summary["final"]["y"].get<double>()));
  EXPECT_EQ(summary["path_length"]["wheels"].size(), 4);
}

TEST_F(SimulateTest, CheckGivesAnErrorBarAndChangesNothing) {
  const std::string scene = folder_.write("scene.yaml", kScene);
  ASSERT_EQ(Program(SIMULATE, {scene, "--quiet", "--csv", folder_.path("a.csv")}).wait(), 0);
  Program simulate(SIMULATE, {scene, "--check", "--csv", folder_.path("b.csv"), "--summary", folder_.path("s.json")});
  ASSERT_EQ(simulate.wait(), 0);
  EXPECT_EQ(simulate.err(), "");
  EXPECT_NE(simulate.out().find("error bar"), std::string::npos);
  EXPECT_EQ(folder_.read("b.csv"), folder_.read("a.csv"));
  const auto summary = nlohmann::json::parse(folder_.read("s.json"));
  EXPECT_TRUE(summary["reliable"]);
  const auto& check = summary["check"];
  EXPECT_GT(check["position_difference"], 0);
  EXPECT_GT(check["heading_difference"], 0);
  EXPECT_LT(check["position_difference"].get<double>(), check["promised"].get<double>());
  EXPECT_LT(check["promised"], 1e-5);  // at 3e-7, on a path of some centimetres
}

// The heading is a driven pendulum in its chaotic range, 0.4 times critically damped at 2/3 of its own frequency: a
// push holds it, and torques swing it. The energy balance closes all the same.
TEST_F(SimulateTest, CheckWarnsOfAChaoticMotion) {
  const std::string scene = folder_.write(
      "scene.yaml",
      "model: no_slip\nduration: 60\nrobot: {com: [0, 0], wheel_damping: 0.049, roller_damping: 0}\n"
      "initial: {twist: [0, 0, 1]}\nwrenches: [{force: [200, 0, 0], point: [0.465, 0, 0], frame: fixed}]\n"
      "drive: {torque: [{start: 0, cos: [-3.47, 3.47, -3.47, 3.47], period: 2.356}]}\n");
  const std::string json = folder_.path("s.json");
  Program unchecked(SIMULATE, {scene, "--quiet", "--summary", json});
  ASSERT_EQ(unchecked.wait(), 0);
  EXPECT_EQ(unchecked.err(), "");
  EXPECT_TRUE(nlohmann::json::parse(folder_.read("s.json"))["reliable"]);

  Program simulate(SIMULATE, {scene, "--quiet", "--check", "--summary", json});
  ASSERT_EQ(simulate.wait(), 0);
  EXPECT_NE(simulate.err().find("unreliable: a twin at half the tolerance parts from it by "), std::string::npos);
  EXPECT_EQ(lines(simulate.err()), 1);
  const auto summary = nlohmann::json::parse(folder_.read("s.json"));
  EXPECT_FALSE(summary["reliable"]);
  EXPECT_GT(summary["check"]["position_difference"].get<double>(), summary["check"]["promised"].get<double>());
}

TEST_F(SimulateTest, CpuLimitEndsTheRunAndTheSummaryTells) {
  const std::string scene = folder_.write("scene.yaml", kScene);
  Program simulate(SIMULATE,
                   {scene, "--cpu-limit", "1e-9", "--csv", folder_.path("a.csv"), "--summary", folder_.path("s.json")});
  EXPECT_EQ(simulate.wait(), 1) << simulate.err();
  const auto summary = nlohmann::json::parse(folder_.read("s.json"));
  EXPECT_EQ(summary["completed"], false);
  EXPECT_EQ(summary["simulated_time"], 0.1);
  EXPECT_FALSE(folder_.has("a.csv"));
  EXPECT_EQ(lines(folder_.read(incomplete("a.csv"))), 3);  // header, t = 0 and 0.1
  EXPECT_EQ(Program(SIMULATE, {scene, "--cpu-limit", "0"}).wait(), 2);
}

TEST_F(SimulateTest, WarnsOfRollersThatTaperToAPoint) {
  const std::string scene = folder_.write("scene.yaml", kScene + "robot: {rollers_per_wheel: 4}\n");
  Program told(SIMULATE, {scene}), quiet(SIMULATE, {scene, "--quiet"});
  EXPECT_EQ(told.wait(), 0);
  EXPECT_NE(told.err().find("robot.roller_axis_radius = 0.0355: 4 rollers"), std::string::npos) << told.err();
  EXPECT_EQ(quiet.wait(), 0);
  EXPECT_EQ(quiet.err(), "");
}

// /proc/self/fd/1 rather than /dev/stdout, here and below: nothing can be put in its place, even by mistake and by
// root.
TEST_F(SimulateTest, WhatIsNoFileIsWrittenStraight) {
  const std::string scene = folder_.write("scene.yaml", kScene);
  const std::string in_folder = "cd " + folder_.path("") + "; ";
  Program fifo("/bin/sh", shell(in_folder + "mkfifo f; cat f > read & simulate scene.yaml --quiet --csv f; wait"));
  EXPECT_EQ(fifo.wait(), 0) << fifo.err();
  EXPECT_EQ(lines(folder_.read("read")), 5);
  EXPECT_TRUE(fs::is_fifo(folder_.path("f")));
  folder_.write("log", "before\n");
  Program log("/bin/sh", shell(in_folder + "simulate scene.yaml --quiet --csv /proc/self/fd/1 >> log"));
  EXPECT_EQ(log.wait(), 0) << log.err();
  EXPECT_EQ(lines(folder_.read("log")), 6);
  EXPECT_EQ(files(), (std::set<std::string>{"f", "log", "read", "scene.yaml"}));
}

TEST_F(SimulateTest, AFullDiskEndsOneOutputAndKeepsTheOthers) {
  folder_.write("scene.yaml", kScene);
  folder_.write("long.yaml", "duration: 2\noutput_rate: 1000\n" + kMotion);
  Program full("/bin/sh", shell("ulimit -f 200; cd " + folder_.path("") +
                                "; simulate long.yaml --quiet --csv a.csv --switches s.csv --summary s.json"));
  EXPECT_EQ(full.wait(), 1) << full.err();
  EXPECT_EQ(lines(full.err()), 1) << full.err();
  expect_words(full.err(), {"a.csv: cannot be written: no space", incomplete("a.csv")});
  const std::string kept = folder_.read(incomplete("a.csv"));
  EXPECT_GT(lines(kept), 100);
  EXPECT_EQ(kept.back(), '\n');
  EXPECT_EQ(nlohmann::json::parse(folder_.read("s.json"))["completed"], true);
  EXPECT_GT(lines(folder_.read("s.csv")), 4);
  EXPECT_FALSE(folder_.has("a.csv"));

  for (const char* command :
       {"simulate scene.yaml > /dev/full", "simulate scene.yaml --quiet --csv /proc/self/fd/1 > /dev/full",
        "simulate scene.yaml --quiet --summary /proc/self/fd/1 > /dev/full"}) {
    Program simulate("/bin/sh", shell("cd " + folder_.path("") + "; " + command));
    EXPECT_EQ(simulate.wait(), 1) << command;
    EXPECT_EQ(lines(simulate.err()), 1) << simulate.err();
    EXPECT_NE(simulate.err().find("no space"), std::string::npos) << simulate.err();
  }
  // Nobody reads on.
  Program pipe(
      "/bin/sh",
      shell("cd " + folder_.path("") +
            "; { simulate long.yaml --quiet --csv /proc/self/fd/1 --switches s.csv; echo $? > status; } | head -1"));
  EXPECT_EQ(pipe.wait(), 0);
  EXPECT_EQ(folder_.read("status"), "1\n");
}

TEST_F(SimulateTest, AClosedStandardOutputLosesNothingInSilence) {
  folder_.write("scene.yaml", kScene);
  Program report("/bin/sh", shell("cd " + folder_.path("") + "; simulate scene.yaml --csv a.csv >&-"));
  EXPECT_EQ(report.wait(), 1);
  EXPECT_EQ(report.err(), "simulate: standard output: cannot be written: Bad file descriptor\n");
  EXPECT_EQ(lines(folder_.read("a.csv")), 5);
  Program rows("/bin/sh", shell("cd " + folder_.path("") + "; simulate scene.yaml --quiet --csv /proc/self/fd/1 >&-"));
  EXPECT_EQ(rows.wait(), 2);
  EXPECT_EQ(lines(rows.err()), 1) << rows.err();
  Program quiet("/bin/sh", shell("cd " + folder_.path("") + "; simulate scene.yaml --quiet --csv b.csv >&- 2>&-"));
  EXPECT_EQ(quiet.wait(), 0);
}

TEST_F(SimulateTest, SignalsEndItWithMarkedFiles) {
  const std::string torque = "drive: {torque: [{start: 0, cos: [1, 0.5, 0.2, -1], sin: [1, 1, 1, 1], period: 3}]}\n";
  // In one control period too.
  const std::string scenes[] = {kLongRow + torque, kLongRow + "solver: {control_period: 10}\n" + torque,
                                "model: no_slip\n" + kLongRow + torque};
  const int signals[] = {SIGINT, SIGTERM, SIGHUP};
  for (int k = 0; k < 3; ++k) {
    const std::string scene = folder_.write("scene.yaml", scenes[k]);
    Program simulate(SIMULATE, {scene, "--csv", folder_.path("a.csv"), "--summary", folder_.path("s.json")});
    await_output("s.json");
    simulate.send(signals[k]);
    simulate.send(signals[k]);  // as `timeout` does
    EXPECT_EQ(simulate.wait(), 1) << simulate.err();
    EXPECT_EQ(lines(simulate.err()), 1) << simulate.err();
    expect_words(simulate.err(), {"by signal", incomplete("a.csv")});
    EXPECT_EQ(lines(folder_.read(incomplete("a.csv"))), 2);
    EXPECT_EQ(files().size(), 2u) << "the scene and what is kept";
    fs::remove(folder_.path(incomplete("a.csv")));
  }
}

TEST_F(SimulateTest, SignalsEndItWhereNobodyReadsItsPipe) {
  const std::string scene = folder_.write("scene.yaml", "duration: 10\noutput_rate: 1000\n" + kMotion);
  const std::string pipe = folder_.path("pipe");
  mkfifo(pipe.c_str(), 0600);
  const auto send_until_it_ends = [](Program& simulate, int signal) {
    for (int tries = 0; ::kill(simulate.id(), 0) == 0 && simulate.err().empty() && tries < 3000; ++tries) {
      simulate.send(signal);  // again and again: one that comes just before the program waits does not wake it
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_EQ(simulate.wait(), 1);
    EXPECT_EQ(lines(simulate.err()), 1) << simulate.err();
    EXPECT_EQ(simulate.err().find("system call"), std::string::npos) << simulate.err();
  };
  const auto await = [](const auto& condition) {
    for (int tries = 0; !condition() && tries < 3000; ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  };
  const auto catches = [](pid_t id, int signal) {  // see proc(5)
    std::ifstream status("/proc/" + std::to_string(id) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.rfind("SigCgt:", 0) == 0) return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1) != 0;
    }
    return false;
  };
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string stopped = "by signal " + std::to_string(signal) + ", ";
    {
      Program simulate(SIMULATE, {scene, "--csv", pipe, "--quiet"});
      await([&] { return catches(simulate.id(), signal); });
      send_until_it_ends(simulate, signal);
      EXPECT_EQ(simulate.err().find("simulate: stopped " + stopped), 0u) << simulate.err();
      EXPECT_NE(simulate.err().find("pipe"), std::string::npos) << simulate.err();
    }
    const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
    Program simulate(SIMULATE, {scene, "--csv", pipe, "--switches", folder_.path("s.csv"), "--quiet"});
    int waiting = 0, before = -1;
    await([&] {  // until no more comes
      const bool same = ioctl(reader, FIONREAD, &waiting) == 0 && waiting > 40000 && waiting == before;
      before = waiting;
      return same;
    });
    send_until_it_ends(simulate, signal);
    EXPECT_EQ(simulate.err().find("simulate: stopped after t = "), 0u) << simulate.err();
    EXPECT_NE(simulate.err().find(stopped), std::string::npos) << simulate.err();
    ASSERT_NE(incomplete("s.csv"), "");
    EXPECT_NE(simulate.err().find(incomplete("s.csv")), std::string::npos) << simulate.err();
    fs::remove(folder_.path(incomplete("s.csv")));
    close(reader);
  }
}

TEST_F(SimulateTest, WarnsOfAResultThatIsNotToBeTrusted) {
  const std::string good = folder_.write("good.yaml", kScene);
  const std::string off = folder_.write("off.yaml", kScene + "solver: {method: dopri5, absolute_tolerance: 1}\n");
  for (const bool reliable : {true, false}) {
    Program simulate(SIMULATE, {reliable ? good : off, "--quiet", "--summary", folder_.path("s.json")});
    EXPECT_EQ(simulate.wait(), 0);
    EXPECT_EQ(nlohmann::json::parse(folder_.read("s.json"))["reliable"], reliable);
    EXPECT_EQ(lines(simulate.err()), reliable ? 0 : 1) << simulate.err();
  }
  // Rows that are far apart hide nothing: the base is at rest again at each.
  const std::string seldom =
      folder_.write("seldom.yaml",
                    "duration: 10\noutput_rate: 0.1\nsolver: {method: dopri5, absolute_tolerance: 1}\n"
                    "drive: {torque: [{start: 0, sin: [1, 1, 1, 1], period: 2}]}\n");
  Program blind(SIMULATE, {seldom, "--quiet", "--summary", folder_.path("s.json")});
  EXPECT_EQ(blind.wait(), 0);
  EXPECT_EQ(nlohmann::json::parse(folder_.read("s.json"))["reliable"], false);
  Program simulate(SIMULATE, {off, "--quiet"});  // without a summary too
  EXPECT_EQ(simulate.wait(), 0);
  EXPECT_NE(simulate.err().find("warning: the result is unreliable"), std::string::npos);
}

// Whoever reads the pipe of --csv decides how long the run takes: longer than a second, so that there is a bar.
TEST_F(SimulateTest, LinesOnATerminalStandApartFromTheProgressBar) {
  const std::string scene = folder_.write("scene.yaml", "duration: 2\noutput_rate: 1000\n" + kMotion);
  const auto run = [&](const std::string& name, const Terminal& terminal) {
    mkfifo(folder_.path(name).c_str(), 0600);
    return std::make_unique<Program>("/bin/sh",
                                     shell("simulate '" + scene + "' --csv '" + folder_.path(name) + "' --switches '" +
                                           folder_.path(name + ".switches") + "' > " + terminal.path() + " 2>&1"));
  };
  const Terminal of_whole, of_broken, of_rows;
  Program rows_on_terminal("/bin/sh",
                           shell("simulate '" + scene + "' --csv /dev/stdout > " + of_rows.path() + " 2>&1"));
  const auto whole = run("whole", of_whole), broken = run("broken", of_broken);
  std::ifstream whole_pipe(folder_.path("whole")), broken_pipe(folder_.path("broken"));
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  std::vector<char> rows(100000);
  broken_pipe.read(rows.data(), static_cast<std::streamsize>(rows.size()));
  broken_pipe.close();
  while (whole_pipe.read(rows.data(), static_cast<std::streamsize>(rows.size()))) {
  }
  EXPECT_EQ(whole->wait(), 0);
  EXPECT_EQ(broken->wait(), 1);

  const auto expect_line = [](const std::string& text, const std::string& beginning) {
    EXPECT_NE(text.find("\r[###"), std::string::npos) << "no bar: " << text;
    const std::vector<std::string> lines = Terminal::lines(text);
    EXPECT_TRUE(std::any_of(
        lines.begin(), lines.end(),
        [&](const std::string& line) { return line.find(beginning) == 0 && line.find("###") == std::string::npos; }))
        << beginning << " begins no line of: " << text;
  };
  EXPECT_EQ(of_rows.text().find("###"), std::string::npos) << "a bar between rows";
  EXPECT_EQ(rows_on_terminal.wait(), 0);
  expect_line(of_whole.text(), "model coulomb");
  expect_line(of_broken.text(), "simulate: " + folder_.path("broken"));
}

TEST_F(SimulateTest, HelpSaysHowTheToleranceWasChosen) {
  Program simulate(SIMULATE, {"--help"});
  EXPECT_EQ(simulate.wait(), 0);
  EXPECT_NE(simulate.out().find("1e-5 m"), std::string::npos);
}

TEST_F(SimulateTest, LoadsNoLibraryOfRosUnlessItWritesABag) {
  Program ldd("/bin/sh", {"-c", "ldd " SIMULATE});
  EXPECT_EQ(ldd.wait(), 0) << ldd.err();
  EXPECT_EQ(ldd.out().find("libros"), std::string::npos) << ldd.out();
}

TEST_F(SimulateTest, SaysTheVersionOfThePackage) {
  Program simulate(SIMULATE, {"--version"});
  EXPECT_EQ(simulate.wait(), 0);
  const std::string out = simulate.out(), name = "simulate ";
  ASSERT_EQ(out.substr(0, name.size()), name);
  const std::string version = out.substr(name.size(), out.size() - name.size() - 1);
  std::ifstream manifest(YOUBOT_BASE_SIM_SOURCE_DIR "/package.xml");
  const std::string text{std::istreambuf_iterator<char>(manifest), {}};
  EXPECT_NE(text.find("<version>" + version + "</version>"), std::string::npos) << out;
}

}  // namespace
}  // namespace youbot_base_sim
