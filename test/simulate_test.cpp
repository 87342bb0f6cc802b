// The program `simulate` as a user runs it: its files, messages and exit status.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "program.h"

namespace youbot_base_sim {
namespace {

const char kScene[] =
    "duration: 0.25\noutput_rate: 10\ninitial: {wheel_angles: [0.5, 0.5, 0.5, 0.5]}\n"
    "drive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n";

class SimulateTest : public testing::Test {
 protected:
  static long lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

  TemporaryFolder folder_;
};

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
  EXPECT_NE(simulate.out().find("roller switches"), std::string::npos);
  EXPECT_EQ(simulate.err(), "");  // no progress bar into a file
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

TEST_F(SimulateTest, CpuLimitEndsTheRunAndTheSummaryTells) {
  const std::string scene = folder_.write("scene.yaml", kScene);
  Program simulate(SIMULATE,
                   {scene, "--cpu-limit", "1e-9", "--csv", folder_.path("a.csv"), "--summary", folder_.path("s.json")});
  EXPECT_EQ(simulate.wait(), 1) << simulate.err();
  const auto summary = nlohmann::json::parse(folder_.read("s.json"));
  EXPECT_EQ(summary["completed"], false);
  EXPECT_EQ(summary["simulated_time"], 0.1);
  EXPECT_FALSE(folder_.has("a.csv") || folder_.has("a.csv.part"));
  EXPECT_EQ(Program(SIMULATE, {scene, "--cpu-limit", "0"}).wait(), 2);
}

TEST_F(SimulateTest, RefusedInputExitsWith2AndOneLineAndLeavesNothing) {
  const std::string good = folder_.write("scene.yaml", kScene);
  for (std::vector<std::string> arguments :
       std::vector<std::vector<std::string>>{{folder_.write("bad.yaml", "duration: -1\n")},
                                             {folder_.path("missing.yaml")},
                                             {folder_.path("")},
                                             {folder_.write("idle.yaml", "duration: 1\n")},
                                             {good, "--model", "rigid"},
                                             {good, "--relative-tolerance", "2"},
                                             {good, "--relative-tolerance", "nan"},
                                             {good, "--relative-tolerance", "x"},
                                             {good, "--colour", "red"},
                                             {good, good},
                                             {}}) {
    const std::string what = arguments.empty() ? "no scene" : arguments.back();
    arguments.insert(arguments.end(), {"--csv", folder_.path("a.csv")});
    Program simulate(SIMULATE, arguments);
    EXPECT_EQ(simulate.wait(), 2) << what;
    EXPECT_EQ(lines(simulate.err()), 1) << simulate.err();
    EXPECT_FALSE(folder_.has("a.csv") || folder_.has("a.csv.part")) << what;
  }
}

TEST_F(SimulateTest, WarnsOfRollersThatTaperToAPoint) {
  const std::string scene = folder_.write("scene.yaml", kScene + std::string("robot: {rollers_per_wheel: 4}\n"));
  Program told(SIMULATE, {scene}), quiet(SIMULATE, {scene, "--quiet"});
  EXPECT_EQ(told.wait(), 0);
  EXPECT_NE(told.err().find("robot.roller_axis_radius = 0.0355: 4 rollers"), std::string::npos) << told.err();
  EXPECT_EQ(quiet.wait(), 0);
  EXPECT_EQ(quiet.err(), "");
}

TEST_F(SimulateTest, UnwritableFileExitsWith1) {
  const std::string scene = folder_.write("scene.yaml", kScene);
  Program simulate(SIMULATE, {scene, "--csv", folder_.path("no/such/folder.csv")});
  EXPECT_EQ(simulate.wait(), 1);
  EXPECT_NE(simulate.err().find("no/such/folder.csv"), std::string::npos);
}

TEST_F(SimulateTest, HelpSaysHowTheToleranceWasChosen) {
  Program simulate(SIMULATE, {"--help"});
  EXPECT_EQ(simulate.wait(), 0);
  EXPECT_NE(simulate.out().find("1e-5 m"), std::string::npos);
}

}  // namespace
}  // namespace youbot_base_sim
