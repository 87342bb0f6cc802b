// Does what the programs do, one feature at a time, for an instruction counter to look at: see scripts/feature_cost.

#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <cstdio>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "youbot_base_sim/simulation.h"
#ifdef YOUBOT_BASE_SIM_ROS
#include <ros/serialization.h>
#include <rosgraph_msgs/Clock.h>

#include "youbot_base_sim/ros/bag.h"
#include "youbot_base_sim/ros/telemetry.h"
#endif

namespace {

using namespace youbot_base_sim;

constexpr double kControlPeriod = 1e-3;  // s, of the node's loop

/// The least that simulate could do: a row each 1 / output_rate that nobody looks at.
void run_rows(const Scene& scene) {
  Simulation simulation(scene);
  for (std::int64_t k = 1;; ++k) {
    const double t = static_cast<double>(k) / scene.output_rate;
    if (t >= scene.duration * (1 - 1e-12)) break;
    simulation.advance_to(t);
  }
  simulation.advance_to(scene.duration);
}

/// The least that the node could do: control periods.
void run_periods(const Scene& scene) {
  Simulation simulation(scene);
  while (simulation.time() < scene.duration - 0.5 * kControlPeriod) simulation.advance_periods(1);
}

#ifdef YOUBOT_BASE_SIM_ROS
struct NodeFeatures {
  double publish_rate = 50;        // Hz
  std::set<std::string> listened;  // topics with a subscriber
  bool rollers = false;
  std::string bag;  // empty: none
};

/// Makes a message and the bytes of it, as publishing to a subscriber does.
template <class Message>
void send(const Message& message) {
  static std::size_t sent = 0;
  sent += ros::serialization::serializeMessage(message).num_bytes;
}

/// The node's loop without ROS around it: control periods, and what BaseNode::publish_instant does at the end of each.
void run_node(const Scene& scene, const NodeFeatures& features) {
  Simulation simulation(scene);
  Telemetry::Options options;
  options.rollers = features.rollers;
  Telemetry telemetry(simulation, exact_readings(simulation), options);
  const auto bag = features.bag.empty() ? nullptr : std::make_unique<BagWriter>(features.bag);
  const bool clock_listened = features.listened.count(kClockTopic);
  const bool switches_listened = features.listened.count(kRollerSwitchesTopic);
  std::int64_t instants = 0;
  while (simulation.time() < scene.duration - 0.5 * kControlPeriod) {
    simulation.advance_periods(1);
    const double t = simulation.time();
    const bool is_due = t >= static_cast<double>(instants) / features.publish_rate - 1e-6 * kControlPeriod;
    const std::vector<RollerSwitch> switches = simulation.take_switches();
    if (clock_listened) {
      rosgraph_msgs::Clock message;
      message.clock = stamp_of(t);
      send(message);
    }
    if (bag) bag->write(switches);
    if (switches_listened) {
      for (const RollerSwitch& event : switches) send(roller_switch_message(event, stamp_of(event.t)));
    }
    if (!is_due) continue;
    ++instants;
    telemetry.update(simulation, exact_readings(simulation));
    if (bag) bag->write(telemetry, t);
    telemetry.visit(stamp_of(t), [&](const char* topic, const auto& make) {
      if (features.listened.count(topic)) send(make());
    });
  }
  if (bag) bag->commit();
}

/// Names of all topics of which there may be messages.
void print_topics(const Scene& scene) {
  const Simulation simulation(scene);
  Telemetry(simulation, exact_readings(simulation), {}).visit(ros::Time(), [](const char* topic, const auto&) {
    fmt::print("{}\n", topic);
  });
  fmt::print("{}\n{}\n", kRollerSwitchesTopic, kClockTopic);
}
#endif

}  // namespace

int main(int argc, char** argv) {
  namespace po = boost::program_options;
  std::string what, path, model;
  std::vector<std::string> listened;
  double publish_rate = 50;
  std::string bag;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("what", po::value(&what)->required(), "rows, periods, node or topics")
    ("scene", po::value(&path)->required(), "scene file")
    ("model", po::value(&model), "no_slip, viscous or coulomb, in place of the scene's")
    ("publish-rate", po::value(&publish_rate), "Hz, of the node")
    ("listen", po::value(&listened)->composing(), "topic of the node that has a subscriber; may be repeated")
    ("rollers", "the node's joint states tell of the rollers")
    ("bag", po::value(&bag), "file that the node records to");
  // clang-format on
  po::positional_options_description positional;
  positional.add("what", 1).add("scene", 1);
  try {
    po::variables_map given;
    po::store(po::command_line_parser(argc, argv).options(options).positional(positional).run(), given);
    po::notify(given);
    SceneOverrides overrides;
    overrides.model = model;
    if (what != "rows") overrides.control_period = kControlPeriod;
    const Scene scene = load_scene(path, overrides);
    if (what == "rows") {
      run_rows(scene);
    } else if (what == "periods") {
      run_periods(scene);
#ifdef YOUBOT_BASE_SIM_ROS
    } else if (what == "node") {
      run_node(scene, {publish_rate, {listened.begin(), listened.end()}, given.count("rollers") > 0, bag});
    } else if (what == "topics") {
      print_topics(scene);
#endif
    } else {
      throw std::invalid_argument(
          fmt::format("{}: must be rows, periods, node or topics (the last two with ROS)", what));
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "feature_cost: {}\n", error.what());
    return 2;
  }
  return 0;
}
