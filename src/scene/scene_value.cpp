#include "youbot_base_sim/scene/scene_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "youbot_base_sim/scene/scene_setting.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/suggestion.h"

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxShown = 60;  // characters of a value

/// The value as YAML in one line.
std::string in_flow_style(const YAML::Node& node) {
  YAML::Node flow = YAML::Clone(node);
  if (!flow.IsScalar()) flow.SetStyle(YAML::EmitterStyle::Flow);
  YAML::Emitter emitter;
  emitter << YAML::Flow << flow;
  return emitter.c_str();
}

/// The value as it may stand in one line.
std::string shown(const YAML::Node& node) {
  if (!node.IsDefined()) return "(left out)";
  if (node.IsNull()) return "(empty)";
  if (node.IsScalar()) return node.Scalar().empty() ? "\"\"" : quote(node.Scalar(), kMaxShown);
  return quote(in_flow_style(node), kMaxShown);
}

std::string key_of(const YAML::Node& node) { return node.IsScalar() ? node.Scalar() : shown(node); }

}  // namespace

std::string alternatives(const std::vector<std::string>& names) {
  if (names.size() < 2) return fmt::format("{}", fmt::join(names, ""));
  return fmt::format("{} or {}", fmt::join(names.begin(), names.end() - 1, ", "), names.back());
}

SceneValue::SceneValue(const std::string& file, const std::string& path, const YAML::Node& node, const char* kind,
                       bool resolves)
    : file_(file), path_(path), node_(node), kind_(kind) {
  if (resolves) resolved_.emplace(YAML::NodeType::Map);
  if (!path.empty() || node.IsMap()) return;
  // A file of another kind may be private, so messages do not quote it.
  const std::string value = node.IsNull() ? shown(node) : node.IsScalar() ? "(text)" : "(list)";
  throw SceneError(fmt::format("{}: {} = {}: must be keys with values", file_, kind, value));
}

void SceneValue::refuse(const std::string& allowed) const { refuse_for("must be " + allowed); }

void SceneValue::refuse_for(const std::string& reason) const {
  throw SceneError(fmt::format("{}{}{} = {}: {}", file_, file_.empty() ? "" : ": ", path_, shown(node_), reason));
}

void SceneValue::require_list() const {
  if (!given() || !node_.IsSequence() || node_.size() == 0) refuse("a list with at least one entry");
}

double SceneValue::checked(const YAML::Node& entry, const Range& range, const std::string& allowed) const {
  double number = 0;
  if (!entry.IsScalar() || !YAML::convert<double>::decode(entry, number) || !contains(range, number)) refuse(allowed);
  return number;
}

void SceneValue::resolve(const std::string& value) const {
  if (around_) (*around_)[key_] = value;
}

void SceneValue::resolve(double value) const {
  if (around_) resolve(fmt::format("{}", value));
}

void SceneValue::resolve(const Eigen::Ref<const Eigen::ArrayXd>& values) const {
  if (!around_) return;
  YAML::Node list(YAML::NodeType::Sequence);
  list.SetStyle(YAML::EmitterStyle::Flow);
  for (Eigen::Index k = 0; k < values.size(); ++k) list.push_back(fmt::format("{}", values[k]));
  (*around_)[key_] = list;
}

void SceneValue::unresolve() const {
  if (around_) around_->remove(key_);
}

const SceneValue& SceneValue::number(double& value, const Range& range) const {
  if (given()) value = checked(node_, range, text_of(range));
  if (contains(range, value)) resolve(value);
  return *this;
}

const SceneValue& SceneValue::whole_number(int& value, int min, int max) const {
  const std::string allowed = fmt::format("a whole number from {} to {}", min, max);
  const double number = given() ? checked(node_, {double(min), double(max), ""}, allowed) : value;
  if (number != std::floor(number)) refuse(allowed);
  value = static_cast<int>(number);
  resolve(number);
  return *this;
}

const SceneValue& SceneValue::numbers(Eigen::Ref<Eigen::ArrayXd> values, const Range& range) const {
  if (given()) {
    const std::string allowed = fmt::format("a list of {} numbers, each {}", values.size(), text_of(range));
    if (!node_.IsSequence() || node_.size() != static_cast<std::size_t>(values.size())) refuse(allowed);
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      values[k] = checked(node_[static_cast<std::size_t>(k)], range, allowed);
    }
  }
  resolve(values);
  return *this;
}

const SceneValue& SceneValue::number_or_wheels(Wheels& values, const Range& range) const {
  if (!given() || !node_.IsScalar()) return numbers(values, range);
  values.setConstant(checked(node_, range, text_of(range)));
  resolve(values);
  return *this;
}

const SceneValue& SceneValue::text(std::string& value, const std::string& allowed) const {
  if (!given()) return *this;
  // A file name would end at a NUL.
  if (!node_.IsScalar() || node_.Scalar().empty() || node_.Scalar().find('\0') != std::string::npos) refuse(allowed);
  value = node_.Scalar();
  resolve(value);
  return *this;
}

const SceneValue& SceneValue::choice(std::string& value, const std::vector<std::string>& names) const {
  const std::string allowed = alternatives(names);
  text(value, allowed);
  if (given() && std::find(names.begin(), names.end(), value) == names.end())
    refuse(allowed + suggestion(value, names));
  if (!value.empty()) resolve(value);
  return *this;
}

std::vector<std::string> SceneValue::entries() const {
  require_list();
  std::vector<std::string> entries;
  for (const auto& entry : node_) entries.push_back(in_flow_style(entry));
  return entries;
}

std::vector<SceneValue> SceneValue::sections() const {
  require_list();
  std::vector<SceneValue> sections;
  for (std::size_t k = 0; k < node_.size(); ++k) {
    SceneValue& section = sections.emplace_back(file_, fmt::format("{}[{}]", path_, k), node_[k]);
    if (around_) (*around_)[key_].push_back(section.resolved_.emplace(YAML::NodeType::Map));
  }
  return sections;
}

SceneValue SceneValue::operator[](const std::string& key) {
  known_.push_back(key);
  if (around_ && !resolved_) (*around_)[key_] = resolved_.emplace(YAML::NodeType::Map);
  // A constant node adds nothing to the file.
  SceneValue value(file_, full(key), is_section() ? std::as_const(node_)[key] : YAML::Node(YAML::NodeType::Undefined));
  value.key_ = key;
  value.around_ = resolved_;
  return value;
}

std::string SceneValue::resolved() const {
  if (!resolved_) return "";
  YAML::Emitter emitter;
  emitter << *resolved_;
  return std::string(emitter.c_str()) + "\n";
}

SceneValue SceneValue::required(const std::string& key) {
  const SceneValue value = (*this)[key];
  if (!value.given() && missing_.empty()) missing_ = key;
  return value;
}

bool SceneValue::has_known_key() const {
  return std::any_of(node_.begin(), node_.end(), [&](const auto& entry) {
    const std::string key = key_of(entry.first);
    return std::find(known_.begin(), known_.end(), key) != known_.end() || !suggestion(key, known_).empty();
  });
}

void SceneValue::finish() const {
  if (given() && !node_.IsMap()) {
    throw SceneError(
        fmt::format("{}: {} = {}: must be keys with values: {}", file_, path_, shown(node_), fmt::join(known_, ", ")));
  }
  if (path_.empty() && node_.size() > 0 && !has_known_key()) {  // not shown, as above
    throw SceneError(fmt::format("{}: is not a {}: must have some of {}", file_, kind_, fmt::join(known_, ", ")));
  }
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = key_of(entry.first);
    if (!seen.insert(key).second) {
      throw SceneError(
          fmt::format("{}: {} = {}: given twice; allowed once", file_, full(quote(key)), shown(entry.second)));
    }
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    if (key == "<<")
      throw SceneError(fmt::format("{}: {}: a merge key: must be left out; write its keys here", file_, full(key)));
    throw SceneError(fmt::format("{}: {} = {}: unknown key; allowed here: {}{}", file_, full(quote(key)),
                                 shown(entry.second), fmt::join(known_, ", "), suggestion(key, known_)));
  }
  require_all();
}

void SceneValue::require_all() const {
  if (missing_.empty()) return;
  throw SceneError(fmt::format("{}: {} is left out; it must be given", file_, full(missing_)));
}

}  // namespace youbot_base_sim
