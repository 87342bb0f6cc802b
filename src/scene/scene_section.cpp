#include "scene_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

namespace {

// The value as it may stand in one line.
std::string shown(const YAML::Node& node) {
  if (!node.IsDefined()) return "(left out)";
  if (node.IsNull()) return "(empty)";
  YAML::Emitter out;
  out.SetSeqFormat(YAML::Flow);
  out.SetMapFormat(YAML::Flow);
  out << node;
  std::string text = out.c_str();
  std::replace(text.begin(), text.end(), '\n', ' ');
  constexpr std::size_t kLongest = 120;
  return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

SceneSection::SceneSection(const std::string& file, const std::string& path, const YAML::Node& node,
                           const std::vector<std::string>& allowed)
    : file_(file), path_(path), node_(node) {
  if (!node.IsMap()) {
    throw SceneError(
        fmt::format("{}: {} = {}: must be keys with values", file_, path_.empty() ? "scene" : path_, shown(node)));
  }
  std::set<std::string> seen;
  for (const auto& entry : node) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : shown(entry.first);
    if (std::find(allowed.begin(), allowed.end(), key) == allowed.end()) {
      throw SceneError(fmt::format("{}: {} = {}: unknown key; allowed here: {}", file_, full(key), shown(entry.second),
                                   joined(allowed)));
    }
    if (!seen.insert(key).second) {
      throw SceneError(fmt::format("{}: {} = {}: given twice; allowed once", file_, full(key), shown(entry.second)));
    }
  }
}

void SceneSection::refuse(const std::string& key, const std::string& allowed) const {
  throw SceneError(fmt::format("{}: {} = {}: must be {}", file_, full(key), shown(node_[key]), allowed));
}

void SceneSection::require(const std::string& key) const {
  if (!has(key)) throw SceneError(fmt::format("{}: {} is left out; it must be given", file_, full(key)));
}

SceneSection SceneSection::section(const std::string& key, const std::vector<std::string>& allowed) const {
  return SceneSection(file_, full(key), has(key) ? node_[key] : YAML::Node(YAML::NodeType::Map), allowed);
}

std::vector<SceneSection> SceneSection::sections(const std::string& key,
                                                 const std::vector<std::string>& allowed) const {
  const YAML::Node list = node_[key];
  if (!list.IsSequence() || list.size() == 0) refuse(key, "a list with at least one entry");
  std::vector<SceneSection> sections;
  for (std::size_t i = 0; i < list.size(); ++i) {
    sections.emplace_back(file_, fmt::format("{}[{}]", full(key), i), list[i], allowed);
  }
  return sections;
}

double SceneSection::checked(const YAML::Node& value, const std::string& key, const Range& range,
                             const std::string& allowed) const {
  double number = 0;
  if (!value.IsScalar() || !YAML::convert<double>::decode(value, number) || !std::isfinite(number) ||
      number < range.low || number > range.high || (number == range.low && !range.includes_low)) {
    refuse(key, allowed);
  }
  return number;
}

double SceneSection::number(const std::string& key, double left_out, const Range& range) const {
  return has(key) ? checked(node_[key], key, range, range.text) : left_out;
}

int SceneSection::whole_number(const std::string& key, int left_out, int low, int high) const {
  if (!has(key)) return left_out;
  const std::string allowed = fmt::format("a whole number from {} to {}", low, high);
  const Range range{double(low), double(high), true, ""};
  const double number = checked(node_[key], key, range, allowed);
  if (number != std::floor(number)) refuse(key, allowed);
  return static_cast<int>(number);
}

std::string SceneSection::text(const std::string& key, const std::string& left_out) const {
  if (!has(key)) return left_out;
  if (!node_[key].IsScalar()) refuse(key, "a word");
  return node_[key].Scalar();
}

std::vector<double> SceneSection::numbers(const std::string& key, std::size_t count,
                                          const std::vector<double>& left_out, const Range& range) const {
  if (!has(key)) return left_out;
  const YAML::Node list = node_[key];
  const std::string allowed = fmt::format("a list of {} numbers, each {}", count, range.text);
  if (!list.IsSequence() || list.size() != count) refuse(key, allowed);
  std::vector<double> numbers;
  for (const auto& value : list) numbers.push_back(checked(value, key, range, allowed));
  return numbers;
}

Wheels SceneSection::wheels(const std::string& key, const Wheels& left_out, const Range& range) const {
  const std::vector<double> n = numbers(key, kWheels, {left_out[0], left_out[1], left_out[2], left_out[3]}, range);
  return {n[0], n[1], n[2], n[3]};
}

Wheels SceneSection::number_or_wheels(const std::string& key, const Wheels& left_out, const Range& range) const {
  if (has(key) && node_[key].IsScalar()) return Wheels::Constant(number(key, 0, range));
  return wheels(key, left_out, range);
}

}  // namespace youbot_base_sim
