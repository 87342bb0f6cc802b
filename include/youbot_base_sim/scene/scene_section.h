#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "youbot_base_sim/physics/state.h"
#include "youbot_base_sim/text/number.h"

namespace youbot_base_sim {

/// A value of an enum and its name in a scene file.
template <class Value>
struct Named {
  const char* name;
  Value value;
};

constexpr Named<bool> kFlags[] = {{"true", true}, {"false", false}};

/// "a, b or c"
std::string alternatives(const std::vector<std::string>& names);

class SceneSection;

/// The value of one key. The functions that read it leave their argument, the default, as it is where the key is left
/// out, and return the value itself, for checks that follow. They throw SceneError, one line that names the file
/// (unless `file` is empty), the key, the value and what is allowed.
///
/// Values that they read, and defaults within the range, they also `resolve`.
class SceneValue {
 public:
  /// A value of no section.
  SceneValue(const std::string& file, const std::string& path, const YAML::Node& node)
      : SceneValue(file, path, node, path, YAML::Node(YAML::NodeType::Undefined)) {}
  /// The value of `key` in a section, of which `resolved` takes the resolved values if it is defined.
  SceneValue(const std::string& file, const std::string& path, const YAML::Node& node, const std::string& key,
             const YAML::Node& resolved)
      : file_(file), path_(path), node_(node), key_(key), resolved_(resolved) {}

  bool given() const { return node_.IsDefined(); }
  bool is_section() const { return given() && node_.IsMap(); }

  const SceneValue& number(double& value, const Range& range) const;
  /// From `min` to `max`.
  const SceneValue& whole_number(int& value, int min, int max) const;
  /// A list with as many numbers as `values` has.
  const SceneValue& numbers(Eigen::Ref<Eigen::ArrayXd> values, const Range& range) const;
  /// One number for all wheels, or one for each.
  const SceneValue& number_or_wheels(Wheels& values, const Range& range) const;
  /// Anything that is neither empty nor a list nor a section; `allowed` says what the text means.
  const SceneValue& text(std::string& value, const std::string& allowed) const;
  /// One of `names`.
  const SceneValue& choice(std::string& value, const std::vector<std::string>& names) const;
  template <class Value, std::size_t size>
  const SceneValue& choice(Value& value, const Named<Value> (&allowed)[size]) const {
    std::vector<std::string> names;
    for (const Named<Value>& candidate : allowed) names.push_back(candidate.name);
    std::string name;
    choice(name, names);
    for (const Named<Value>& candidate : allowed) {
      if (name == candidate.name) value = candidate.value;
      if (value == candidate.value) resolve(candidate.name);
    }
    return *this;
  }

  /// The entries that the value lists, at least one, each as YAML.
  std::vector<std::string> entries() const;

  /// The section that the value is, empty where the key is left out.
  SceneSection section() const;
  /// The sections that the value lists, at least one.
  std::vector<SceneSection> sections() const;

  /// Sets what the section resolves to at this key: an override, or a default that other keys decide.
  void resolve(const std::string& value) const;
  void resolve(double value) const;
  void resolve(const Eigen::Ref<const Eigen::ArrayXd>& values) const;
  /// Leaves the key out of what the section resolves to.
  void unresolve() const;

  /// Throws: the value must be `allowed`.
  [[noreturn]] void refuse(const std::string& allowed) const;
  /// Throws; `reason` says what is wrong and what the value must be.
  [[noreturn]] void refuse_for(const std::string& reason) const;

 private:
  void require_list() const;
  YAML::Node resolved_section() const;
  double checked(const YAML::Node& entry, const Range& range, const std::string& allowed) const;

  std::string file_;
  std::string path_;  // the key with those of the sections around it
  YAML::Node node_;
  std::string key_;
  mutable YAML::Node resolved_;  // shared with the section
};

/// One mapping of a scene file or the like. It records the keys that are read and refuses all others at the end.
class SceneSection {
 public:
  /// `file` is the file's name as messages show it; `path` is the section's own key with those above it, empty for the
  /// whole file, which is a `kind`. Throws SceneError for a whole file that is no mapping.
  SceneSection(const std::string& file, const std::string& path, const YAML::Node& node, const char* kind = "scene",
               const YAML::Node& resolved = YAML::Node(YAML::NodeType::Undefined));

  SceneValue operator[](const std::string& key);
  /// A key without which `finish` throws.
  SceneValue required(const std::string& key);

  /// To be called after all keys were read, before checks that involve several. Throws SceneError if this is no
  /// mapping, for a key given twice or never read, then for a required one that is missing.
  void finish() const;

  /// The keys read so far.
  const std::vector<std::string>& known() const { return known_; }

  /// The values read so far, with defaults and overrides, as YAML; empty unless made with a `resolved` to collect them.
  std::string resolved() const;

 private:
  /// True if the file has a key that was read, or one that resembles it.
  bool has_known_key() const;
  std::string full(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

  std::string file_;
  std::string path_;
  YAML::Node node_;
  std::vector<std::string> known_;
  std::string missing_;  // the first required key that is not given
  const char* kind_;
  YAML::Node resolved_;
};

}  // namespace youbot_base_sim
