#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <string>
#include <vector>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Numbers that a key may have.
struct Range {
  double low;
  double high;
  bool includes_low;
  const char* text;  ///< "a number > 0"
};

constexpr double kUnbounded = 1.7976931348623157e308;
constexpr Range kAnyNumber{-kUnbounded, kUnbounded, true, "a finite number"};
constexpr Range kPositive{0, kUnbounded, false, "a finite number > 0"};
constexpr Range kNotNegative{0, kUnbounded, true, "a finite number >= 0"};

/// One mapping of a scene file, read strictly: each key once, each value of its type and in its range, none unknown.
/// All functions throw SceneError, in one line that names the file, the key, the value and what is allowed.
class SceneSection {
 public:
  /// `path` is the section's own key with those above it, empty for the whole file; `allowed` the keys it may have.
  SceneSection(const std::string& file, const std::string& path, const YAML::Node& node,
               const std::vector<std::string>& allowed);

  bool has(const std::string& key) const { return node_[key].IsDefined(); }

  /// The key's section, empty if it is left out.
  SceneSection section(const std::string& key, const std::vector<std::string>& allowed) const;
  /// The key's list of sections.
  std::vector<SceneSection> sections(const std::string& key, const std::vector<std::string>& allowed) const;

  // The value, or what is given where the key is left out.
  double number(const std::string& key, double left_out, const Range& range) const;
  int whole_number(const std::string& key, int left_out, int low, int high) const;
  std::string text(const std::string& key, const std::string& left_out) const;
  std::vector<double> numbers(const std::string& key, std::size_t count, const std::vector<double>& left_out,
                              const Range& range) const;
  Wheels wheels(const std::string& key, const Wheels& left_out, const Range& range) const;
  /// One number for all wheels, or one for each.
  Wheels number_or_wheels(const std::string& key, const Wheels& left_out, const Range& range) const;

  void require(const std::string& key) const;

  /// Throws: the key's value is not `allowed`.
  [[noreturn]] void refuse(const std::string& key, const std::string& allowed) const;

 private:
  std::string full(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  double checked(const YAML::Node& value, const std::string& key, const Range& range, const std::string& allowed) const;

  std::string file_;
  std::string path_;
  YAML::Node node_;
};

}  // namespace youbot_base_sim
