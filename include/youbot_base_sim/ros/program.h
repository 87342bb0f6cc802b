#pragma once

#include <ros/node_handle.h>

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/text/number.h"

namespace youbot_base_sim {

/// A wrong parameter: one line with its name, its value and what is allowed.
struct ParameterError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads the parameters of a node, or describes them. An empty text, and "unset", which launch files pass on, count as
/// not set.
class Parameters {
 public:
  /// Parameters in the namespace of `node`. Errors write `prefix` before the name: "~" for private ones.
  Parameters(const ros::NodeHandle& node, std::string prefix) : node_(node), prefix_(std::move(prefix)) {}
  /// None is set, and each `read` prints a line: the name, the default and what is allowed. Needs no master.
  explicit Parameters(std::string prefix) : prefix_(std::move(prefix)) {}

  /// Sets `value`, the default, if the parameter is set. Returns whether it is. Throws ParameterError unless its value
  /// is what is `allowed`. `unset`: the default in words, where the value does not say it.
  bool read(const std::string& name, std::string& value, const std::string& allowed = "a text");
  bool read_choice(const std::string& name, std::string& value, const std::vector<std::string>& allowed);
  bool read(const std::string& name, bool& value, const char* unset = nullptr);
  bool read(const std::string& name, double& value, const Range& range, const char* unset = nullptr);
  /// A list with as many numbers as `values` has.
  bool read(const std::string& name, Eigen::Ref<Eigen::ArrayXd> values, const Range& range,
            const char* unset = nullptr);
  bool read(const std::string& name, std::vector<std::string>& texts);
  /// Without a default: the scene has it.
  template <class Value, class... Limits>
  bool read(const std::string& name, std::optional<Value>& value, const Limits&... limits) {
    Value set{};
    if (!read(name, set, limits..., "the scene's")) return false;
    value = set;
    return true;
  }

  /// Reads it in the nearest namespace upwards that has the parameter.
  bool search(const std::string& name, std::string& value, const std::string& allowed) const;

  /// Throws unless `holds`: "parameter ~name = value: must be ...".
  void require(bool holds, const std::string& name, const std::string& value, const std::string& allowed) const;

  /// Throws if a parameter is set that has not been read: it is probably misspelt.
  void refuse_others() const;

 private:
  using Decode = std::function<bool(XmlRpc::XmlRpcValue& set)>;  // returns whether the value is allowed
  bool read(const std::string& name, const std::string& unset, const std::string& allowed, const Decode& decode);

  std::optional<ros::NodeHandle> node_;  // empty: describes
  std::string prefix_;
  std::set<std::string> known_;
};

/// The scene of a node that runs until it is ended: that of the parameter `scene` (a scene file) with these settings
/// and those of the parameters `profile` and `friction_scale`. Without a file: the paper's robot with the measured
/// profile, at rest at the origin, and a relative tolerance of 1e-5. Throws ParameterError.
Scene read_scene(Parameters& parameters, SceneSettings settings);

/// The common part of all nodes' main functions: initializes ROS, refuses command line arguments that ROS does not
/// know, and runs `body`. --help prints `about` and calls `describe` instead, without a master. SIGINT, SIGTERM and
/// SIGHUP set `stop_requested` (offline_program.h) and shut ROS down, upon which `body` has to return. Returns the exit
/// status: 0; 2 for a refused argument or a ParameterError, 1 for any other exception, both with a line in the log.
int run_program(
    int argc, char** argv, const char* name, const std::function<void()>& body, const char* about = "",
    const std::function<void()>& describe = [] {});

}  // namespace youbot_base_sim
