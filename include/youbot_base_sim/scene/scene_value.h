#pragma once

#include <yaml-cpp/yaml.h>

#include <optional>
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

template <class Value, std::size_t size>
std::vector<std::string> names_of(const Named<Value> (&named)[size]) {
  std::vector<std::string> names;
  for (const Named<Value>& candidate : named) names.push_back(candidate.name);
  return names;
}

/// "a, b or c"
std::string alternatives(const std::vector<std::string>& names);

/// One value of a scene file or the like, which may be a section, and then records the keys that are read.
///
/// The functions that read it leave their argument, the default, as it is where the key is left out, and return the
/// value itself, for checks that follow. They throw SceneError, one line that names the file (unless `file` is empty),
/// the key, the value and what is allowed. Values that they read, and defaults within the range, they also `resolve`.
class SceneValue {
 public:
  /// `file` is the file's name as messages show it; `path` is the key with those of the sections around it, empty for
  /// the whole file, which is a `kind` and collects what it resolves to if it `resolves`. Throws SceneError for a whole
  /// file that is no mapping.
  SceneValue(const std::string& file, const std::string& path, const YAML::Node& node, const char* kind = "scene",
             bool resolves = false);

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
    std::string name;
    choice(name, names_of(allowed));
    for (const Named<Value>& candidate : allowed) {
      if (name == candidate.name) value = candidate.value;
      if (value == candidate.value) resolve(candidate.name);
    }
    return *this;
  }

  /// The entries that the value lists, at least one, each as YAML.
  std::vector<std::string> entries() const;
  /// The sections that the value lists, at least one.
  std::vector<SceneValue> sections() const;

  /// The value of a key of this section, which is empty where it is left out.
  SceneValue operator[](const std::string& key);
  /// A key without which `finish` throws.
  SceneValue required(const std::string& key);
  /// Call it after all keys of a section were read, before checks that involve several. Throws SceneError if this
  /// is no mapping, for a key given twice or never read, then for a required one that is missing.
  void finish() const;
  /// Throws SceneError for a required key that is missing: what `finish` does where other keys may stand.
  void require_all() const;
  /// The keys read so far.
  const std::vector<std::string>& known() const { return known_; }

  /// Sets what the value resolves to: an override, or a default that other keys decide.
  void resolve(const std::string& value) const;
  void resolve(double value) const;
  void resolve(const Eigen::Ref<const Eigen::ArrayXd>& values) const;
  /// Leaves the value out of what the section around it resolves to.
  void unresolve() const;
  /// The values of a whole file that were read so far, with defaults and overrides, as YAML; empty unless it resolves.
  std::string resolved() const;

  /// Throws: the value must be `allowed`.
  [[noreturn]] void refuse(const std::string& allowed) const;
  /// Throws; `reason` says what is wrong and what the value must be.
  [[noreturn]] void refuse_for(const std::string& reason) const;

 private:
  void require_list() const;
  double checked(const YAML::Node& entry, const Range& range, const std::string& allowed) const;
  /// True if the file has a key that was read, or one that resembles it.
  bool has_known_key() const;
  std::string full(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

  std::string file_;
  std::string path_;
  YAML::Node node_;
  const char* kind_;
  std::vector<std::string> known_;
  std::string missing_;                                  // the first required key that is not given
  std::string key_;                                      // in the section around it
  mutable std::optional<YAML::Node> around_, resolved_;  // what that section, and this one, resolve to; if asked for
};

}  // namespace youbot_base_sim
