#include "youbot_base_sim/scene/yaml_file.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <sstream>
#include <string_view>

#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxBytes = 1'000'000;  // of a scene; its nodes may take a hundred times as much memory
constexpr int kMaxDepth = 32;                 // of lists and sections in each other; a scene has 5

std::string located(const std::string& path, const YAML::Mark& mark) {
  return fmt::format("{}:{}:{}", quote_path(path), mark.line + 1, mark.column + 1);
}

/// Where UTF-8 has a NUL, which yaml-cpp takes for a character of a text or for a wrong escape. UTF-16 and UTF-32,
/// which it reads too, have NULs among their first four bytes.
std::optional<YAML::Mark> find_nul(const std::string& text) {
  const std::size_t nul = text.find('\0');
  if (nul == std::string::npos || nul < 4) return std::nullopt;
  YAML::Mark mark;
  mark.line = static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(nul), '\n'));
  const std::size_t line = text.rfind('\n', nul);
  mark.column = static_cast<int>(line == std::string::npos ? nul : nul - line - 1);
  return mark;
}

/// Refuses a document too many or too deep while it is parsed, before memory or stack is used up.
class Bounds : public YAML::EventHandler {
 public:
  Bounds(const std::string& path, const char* kind) : path_(path), kind_(kind) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ == 1) return;
    throw SceneError(fmt::format("{}: a second document (---); a {} is one", located(path_, mark), kind_));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    begin(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    begin(mark);
  }
  void OnMapEnd() override { --depth_; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}

 private:
  void begin(const YAML::Mark& mark) {
    if (++depth_ <= kMaxDepth) return;
    throw SceneError(fmt::format("{}: more than {} lists and sections in each other", located(path_, mark), kMaxDepth));
  }

  const std::string& path_;
  const char* kind_;
  int documents_ = 0;
  int depth_ = 0;
};

constexpr std::size_t kMaxDigits = 6;  // of a number in brackets
constexpr std::string_view kDigits = "0123456789",
                           kNameCharacters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789";

/// Puts one setting into a document. Nodes on the way are made anew, for aliases may share the old ones.
class Setter {
 public:
  Setter(const std::string& file, const SceneSetting& setting) : file_(file), setting_(setting) {
    std::string_view rest = setting.key;
    do {
      take_step(rest);
    } while (!rest.empty());
  }

  /// The value in place of the node to which the key leads from here on, which is `depth` steps into the document.
  YAML::Node applied(const YAML::Node& node, std::size_t depth = 0) const {
    if (depth == steps_.size()) return YAML::Load(setting_.value);
    return steps_[depth].name.empty() ? in_list(node, depth) : in_section(node, depth);
  }

 private:
  /// One step of a key: the name of what a section has, or the number of what a list has.
  struct Step {
    std::string name;  // empty for a number
    std::size_t number = 0;
    std::string_view around;  // the key of the section or list; of a step from the document itself, the step's own
  };

  /// Takes a step off the front of `rest`, the end of the key.
  void take_step(std::string_view& rest) {
    const std::string_view key = setting_.key;
    const bool first = steps_.empty(), bracket = !first && rest.front() == '[';
    Step step;
    step.around = key.substr(0, key.size() - rest.size());
    if (!first && !bracket && rest.front() != '.') refuse_key();
    if (!first) rest.remove_prefix(1);
    std::size_t length = std::min(rest.find_first_not_of(bracket ? kDigits : kNameCharacters), rest.size());
    const std::string text(rest.substr(0, length));
    const bool begins_with_digit = kDigits.find(text[0]) != std::string_view::npos;
    if (bracket) {
      const bool canonical = length == 1 || (length > 1 && length <= kMaxDigits && text[0] != '0');
      if (!canonical || length == rest.size() || rest[length] != ']') refuse_key();
      step.number = std::stoul(text);
      ++length;
    } else {
      if (length == 0 || begins_with_digit) refuse_key();
      step.name = text;
    }
    rest.remove_prefix(length);
    if (first) step.around = key.substr(0, length);
    steps_.push_back(step);
  }

  YAML::Node in_section(const YAML::Node& node, std::size_t depth) const {
    const Step& step = steps_[depth];
    if (is_given(node) && !node.IsMap())
      refuse(fmt::format("unknown key: {} is not a section there", quote(step.around)));
    YAML::Node section(YAML::NodeType::Map);
    bool found = false;
    for (const auto& entry : node) {
      // A key that stands there twice remains, to be refused.
      const bool is_key = !found && entry.first.IsScalar() && entry.first.Scalar() == step.name;
      section.force_insert(entry.first, is_key ? applied(entry.second, depth + 1) : entry.second);
      found = found || is_key;
    }
    if (!found) section.force_insert(step.name, applied(missing_node(), depth + 1));
    return section;
  }

  YAML::Node in_list(const YAML::Node& node, std::size_t depth) const {
    const Step& step = steps_[depth];
    if (is_given(node) && !node.IsSequence())
      refuse(fmt::format("unknown key: {} is not a list there", quote(step.around)));
    const std::size_t size = node.size();
    if (step.number > size) {
      refuse(fmt::format("{} has {} entries; must be one of them, numbered from 0, or the next", step.around, size));
    }
    YAML::Node list(YAML::NodeType::Sequence);
    for (std::size_t k = 0; k < size; ++k) list.push_back(k == step.number ? applied(node[k], depth + 1) : node[k]);
    if (step.number == size) list.push_back(applied(missing_node(), depth + 1));
    return list;
  }

  static bool is_given(const YAML::Node& node) { return node.IsDefined() && !node.IsNull(); }
  static YAML::Node missing_node() { return YAML::Node(YAML::NodeType::Undefined); }

  [[noreturn]] void refuse_key() const {
    refuse("must be a key of a scene such as floor.friction or initial.wheel_angles[0]");
  }

  [[noreturn]] void refuse(const std::string& reason) const {
    throw SceneError(fmt::format("{}: {} = {}: {}", file_, quote(setting_.key), quote(setting_.value), reason));
  }

  const std::string& file_;
  const SceneSetting& setting_;
  std::vector<Step> steps_;
};

}  // namespace

std::string read_yaml_text(const std::string& path, const char* kind) {
  try {
    std::string text = read_text_file(path, kMaxBytes);
    if (const auto nul = find_nul(text)) throw SceneError(located(path, *nul) + ": has a NUL byte; must be text");
    // Ubuntu 20.04's yaml-cpp, 0.6.2, never ends on a file that does in "{key:". (UTF-16 has NULs, and lines of its
    // own.)
    if (text.find('\0') == std::string::npos) text += '\n';
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    Bounds bounds(path, kind);
    while (parser.HandleNextDocument(bounds)) {
    }
    YAML::Load(text);  // which refuses more: aliases of what is not there
    return text;
  } catch (const UnreadableFile& error) {
    throw SceneError(fmt::format("{}: {}; must be a {} file", quote_path(path), error.what(), kind));
  } catch (const YAML::Exception& error) {
    throw SceneError(fmt::format("{}: is not YAML: {}", located(path, error.mark), quote(error.msg, kMaxMessage)));
  }
}

YAML::Node with_settings(const std::string& file, const YAML::Node& root, const std::vector<SceneSetting>& settings) {
  YAML::Node document = root;
  for (const SceneSetting& setting : settings) document.reset(Setter(file, setting).applied(document));
  return document;
}

}  // namespace youbot_base_sim
