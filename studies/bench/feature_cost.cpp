// Does what the programs do, one feature at a time, for an instruction counter to look at: see scripts/study
// feature_cost.

#include <fmt/format.h>
#include <ros/serialization.h>
#include <rosgraph_msgs/Clock.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/bag.h"
#include "youbot_base_sim/simulation.h"

namespace {

using namespace youbot_base_sim;

constexpr double kControlPeriod = 1e-3;  // s, of the node's loop and the driver by default

/// The least that simulate could do: a row each 1 / output_rate that is not looked at.
void run_rows(const Scene& scene) {
  Simulation simulation(scene);
  const double end = scene.duration * (1 - 1e-12);
  for (int k = 1; k / scene.output_rate < end; ++k) simulation.advance_to(k / scene.output_rate);
  simulation.advance_to(scene.duration);
}

/// What the node is commanded at the start, for the whole run: a turn to the left, sideways.
DriveCommand curve() { return drive_command(DriveMode::kVelocity, DriverKinematics().wheel_rates({0.3, 0.15, 0.4})); }

/// The least that the node could do: control periods, driven as the node is.
void run_periods(const Scene& scene) {
  BaseDriver driver({});
  driver.command(0, curve());
  Simulation simulation(scene);
  advance_to(simulation, scene.duration, [&](double t, const State& x) { return driver.sample(t, x.dphi()); });
}

/// Makes the bytes of a message, as publishing to a subscriber does.
template <class Message>
void send(const Message& message) {
  static std::size_t sent = 0;
  sent += ros::serialization::serializeMessage(message).num_bytes;
}

/// BaseNode's work by the wall clock, without waiting and without a master. If all topics, /clock too, are `listened`
/// to, it stops each control period, without a bag or listeners 50 times a second. `bag_file` is empty for none.
void run_node(const Scene& scene, double publish_rate, const std::string& bag_file, bool rollers, bool listened) {
  LoopSettings settings;
  settings.scene = scene;
  settings.publish_rate = publish_rate;
  BaseLoop loop(settings);
  Telemetry::Options options;
  options.rollers = rollers;
  Telemetry telemetry(scene, options);
  loop.push(0, curve());
  const auto bag = bag_file.empty() ? nullptr : std::make_unique<BagWriter>(bag_file);
  const bool telemetry_wanted = bag || listened;
  while (loop.time() < scene.duration - 0.5 * kControlPeriod) {
    const double stop = telemetry_wanted ? loop.next_instant() : loop.time() + 0.02;
    loop.advance_periods(listened ? 1 : loop.periods_until(stop));
    loop.take_driver_events();
    const double t = loop.time();
    const bool is_due = loop.meet_instant();
    const Events events = loop.take_events();
    if (listened) {
      rosgraph_msgs::Clock message;
      message.clock = stamp_of(t);
      send(message);
    }
    if (bag) bag->write(telemetry, events);
    for (const RollerSwitch& event : events.switches) {
      if (listened) send(roller_switch_message(event, stamp_of(event.t)));
    }
    if (!is_due || !telemetry_wanted) continue;
    if (bag) bag->write(telemetry, loop.simulation(), loop.sensors(), t);
    if (!listened) continue;
    telemetry.visit(loop.simulation(), loop.sensors(), stamp_of(t),
                    [](const char*, const auto& make) { send(make()); });
  }
  if (bag) bag->commit();
}

}  // namespace

int main(int argc, char** argv) try {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const std::string what = words.size() < 2 ? "" : words[0];
  SceneSettings settings;
  if (what != "rows") settings.emplace_back("solver.control_period", kControlPeriod);
  const Scene scene = what.empty() ? Scene() : load_scene(words[1], settings);
  if (what == "rows") {
    run_rows(scene);
  } else if (what == "periods") {
    run_periods(scene);
  } else if (what == "node" && words.size() == 6) {
    run_node(scene, std::atof(words[2].c_str()), words[3], words[4] == "rollers", words[5] == "all");
  } else {
    throw std::invalid_argument("usage: rows|periods SCENE, or node SCENE PUBLISH_RATE BAG|'' rollers|'' all|''");
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "feature_cost: {}\n", error.what());
  return 2;
}
