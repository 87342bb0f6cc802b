#include "scene_settings.h"

#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <string_view>

#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxDigits = 6;  // of a number in brackets

/// One step of a key: the name of what a section has, or the number of what a list has.
struct Step {
  std::string_view name;  // empty for a number
  std::size_t number = 0;
  std::string_view until;  // the key up to this step
};

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes a step off the front of `rest`, the end of `key`. Returns whether there is one.
bool take_step(std::string_view key, std::string_view& rest, Step& step) {
  const bool first = rest.size() == key.size(), bracket = !first && rest.front() == '[';
  if (!first && !bracket && rest.front() != '.') return false;
  if (!first) rest.remove_prefix(1);
  std::size_t length = 0;
  if (bracket) {
    while (length < rest.size() && is_digit(rest[length])) ++length;
    const bool canonical = length == 1 || (length > 1 && length <= kMaxDigits && rest[0] != '0');
    if (!canonical || length == rest.size() || rest[length] != ']') return false;
    std::from_chars(rest.data(), rest.data() + length, step.number);
    step.name = {};
    ++length;
  } else {
    while (length < rest.size() && (is_letter(rest[length]) || (length > 0 && is_digit(rest[length])))) ++length;
    if (length == 0) return false;
    step.name = rest.substr(0, length);
  }
  rest.remove_prefix(length);
  step.until = key.substr(0, key.size() - rest.size());
  return true;
}

/// Puts one setting into a document. Nodes on the way are made anew, for aliases may share the old ones.
class Setter {
 public:
  Setter(const std::string& file, const SceneSetting& setting) : file_(file), setting_(setting) {
    std::string_view rest = setting.key;
    do {
      if (!take_step(setting.key, rest, steps_.emplace_back()))
        refuse("must be a key of a scene such as floor.friction or initial.wheel_angles[0]");
    } while (!rest.empty());
  }

  YAML::Node applied(const YAML::Node& node) const { return applied(node, 0); }

 private:
  YAML::Node applied(const YAML::Node& node, std::size_t depth) const {
    if (depth == steps_.size()) return YAML::Load(setting_.value);
    const Step& step = steps_[depth];
    return step.name.empty() ? in_list(node, step, depth) : in_section(node, step, depth);
  }

  YAML::Node in_section(const YAML::Node& node, const Step& step, std::size_t depth) const {
    const bool missing = !node.IsDefined() || node.IsNull();
    if (!missing && !node.IsMap()) refuse_around(step, "a section");
    YAML::Node section(YAML::NodeType::Map);
    bool found = false;
    if (!missing) {
      for (const auto& entry : node) {
        // A key that stands there twice remains, to be refused.
        const bool is_key = !found && entry.first.IsScalar() && entry.first.Scalar() == step.name;
        section.force_insert(entry.first, is_key ? applied(entry.second, depth + 1) : entry.second);
        found = found || is_key;
      }
    }
    if (!found) section.force_insert(std::string(step.name), applied(missing_node(), depth + 1));
    return section;
  }

  YAML::Node in_list(const YAML::Node& node, const Step& step, std::size_t depth) const {
    const bool missing = !node.IsDefined() || node.IsNull();
    if (!missing && !node.IsSequence()) refuse_around(step, "a list");
    const std::size_t size = missing ? 0 : node.size();
    if (step.number > size) {
      refuse(fmt::format("{} has {} entries; must be one of them, numbered from 0, or the next", list_of(step), size));
    }
    YAML::Node list(YAML::NodeType::Sequence);
    for (std::size_t k = 0; k < size; ++k) list.push_back(k == step.number ? applied(node[k], depth + 1) : node[k]);
    if (step.number == size) list.push_back(applied(missing_node(), depth + 1));
    return list;
  }

  static YAML::Node missing_node() { return YAML::Node(YAML::NodeType::Undefined); }

  /// What the step goes into.
  static std::string_view list_of(const Step& step) { return step.until.substr(0, step.until.rfind('[')); }

  [[noreturn]] void refuse_around(const Step& step, const char* what) const {
    const std::string_view around = step.name.empty() ? list_of(step) : step.until.substr(0, step.until.rfind('.'));
    refuse(fmt::format("unknown key: {} is not {} there", quote(around), what));
  }

  [[noreturn]] void refuse(const std::string& reason) const {
    throw SceneError(fmt::format("{}: {} = {}: {}", file_, quote(setting_.key), quote(setting_.value), reason));
  }

  const std::string& file_;
  const SceneSetting& setting_;
  std::vector<Step> steps_;
};

}  // namespace

YAML::Node with_settings(const std::string& file, const YAML::Node& root, const std::vector<SceneSetting>& settings) {
  YAML::Node document = root;
  for (const SceneSetting& setting : settings) document.reset(Setter(file, setting).applied(document));
  return document;
}

}  // namespace youbot_base_sim
