#pragma once

#include <fmt/format.h>
#include <nav_msgs/Odometry.h>
#include <std_srvs/Empty.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <string>
#include <vector>

#include "program.h"
#include "rostest.h"

namespace youbot_base_sim {

/// /use_sim_time for the nodes that start meanwhile.
struct SimulatedTime {
  SimulatedTime() { ros::param::set("/use_sim_time", true); }
  ~SimulatedTime() { ros::param::del("/use_sim_time"); }
};

/// A base_node that a test starts and ends itself, in a namespace of its own, whose odometry is heard.
class BaseProcess {
 public:
  /// `prefix` is a program that becomes base_node, with its arguments.
  BaseProcess(const std::string& ns, std::vector<std::string> parameters, std::vector<std::string> prefix = {})
      : ns_("/" + ns), program_(start(parameters, prefix)) {
    const auto take = [this](const nav_msgs::Odometry::ConstPtr& message) {
      stamps_.push_back(message->header.stamp);
      velocity_ = message->twist.twist.linear.x;
    };
    subscriber_ = node_.subscribe<nav_msgs::Odometry>(ns_ + "/odom", 1000, take);
  }

  /// Stamps of the odometry that has come.
  const std::vector<ros::Time>& stamps() const { return stamps_; }

  void expect_instants(std::size_t n) {
    const std::size_t before = stamps_.size();
    wait_for("odometry", [&] { return stamps_.size() >= before + n; });
  }

  /// Waits for so much simulated time, s.
  void expect_simulated(double time) {
    expect_instants(1);
    const ros::Time end = stamps_.back() + ros::Duration(time);
    wait_for("time to pass", [&] { return stamps_.back() >= end; });
  }

  /// Of the odometry that came last, m/s.
  double velocity() const { return velocity_; }

  /// Memory that the node holds, MB.
  double memory() const {
    std::ifstream file(fmt::format("/proc/{}/statm", program_.id()));
    std::size_t total = 0, resident = 0;
    file >> total >> resident;
    return 1e-6 * static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
  }

  /// Calls a service that the loop answers, once the node is there.
  bool call(const std::string& name) {
    std_srvs::Empty service;
    return ros::service::waitForService(ns_ + name, ros::Duration(20)) && call_service(ns_ + name, service);
  }

  void send(int signal) { program_.send(signal); }

  void expect_end(int exit_status, const std::string& word = "") {
    EXPECT_EQ(program_.wait(), exit_status) << said();
    EXPECT_NE(said().find(word), std::string::npos) << said();
  }
  void interrupt(const std::string& word = "") {
    send(SIGINT);
    expect_end(0, word);
  }

  /// All that the node has printed; complete when it has ended.
  std::string said() const { return program_.out() + program_.err(); }

 private:
  Program start(std::vector<std::string>& parameters, std::vector<std::string>& prefix) const {
    parameters.insert(parameters.end(), {"__ns:=" + ns_, "__name:=base"});
    if (prefix.empty()) return Program(BASE_NODE, parameters);
    const std::string program = prefix.front();
    prefix.erase(prefix.begin());
    prefix.push_back(BASE_NODE);
    prefix.insert(prefix.end(), parameters.begin(), parameters.end());
    return Program(program, prefix);
  }

  std::string ns_;
  ros::NodeHandle node_;
  std::vector<ros::Time> stamps_;
  double velocity_ = 0;
  Program program_;
  ros::Subscriber subscriber_;
};

}  // namespace youbot_base_sim
