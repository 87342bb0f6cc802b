#include "youbot_base_sim/scene/yaml_file.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <regex>
#include <sstream>
#include <utility>

#include "youbot_base_sim/text/number.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxBytes = 1'000'000;  // of a scene; its nodes may take a hundred times as much memory
constexpr int kMaxDepth = 32;                 // of nested lists and sections; a scene has 5

std::string located(const std::string& path, const YAML::Mark& mark) {
  return fmt::format("{}:{}:{}", quote_path(path), mark.line + 1, mark.column + 1);
}

/// Throws for a NUL in UTF-8, which yaml-cpp misreads. UTF-16 and UTF-32 have NULs among their first four bytes.
void refuse_nul(const std::string& path, const std::string& text) {
  const std::size_t nul = text.find('\0');
  if (nul == std::string::npos || nul < 4) return;
  YAML::Mark mark;
  mark.line = static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(nul), '\n'));
  mark.column = static_cast<int>(nul - (text.rfind('\n', nul) + 1));  // npos + 1 is 0
  throw SceneError(located(path, mark) + ": has a NUL byte; must be text");
}

/// Refuses a second document and deep nesting during parsing, before memory or stack runs out.
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

/// Puts one setting into a document. Nodes on its path are made anew, because aliases may share the old ones.
class Setter {
 public:
  Setter(const std::string& file, const SceneSetting& setting) : file_(file), setting_(setting) {
    constexpr std::size_t kMaxKey = 1000;  // characters; std::regex recurses
    static const std::regex kKey(R"([A-Za-z_]\w*(\.[A-Za-z_]\w*|\[(0|[1-9]\d{0,5})\])*)");
    if (setting.key.size() > kMaxKey || !std::regex_match(setting.key, kKey))
      refuse("must be a key of a scene such as floor.friction or initial.wheel_angles[0]");
  }

  /// The value in place of the node to which the key leads from here on, from its character `at`.
  YAML::Node applied(const YAML::Node& node, std::size_t at = 0) const {
    const std::string& key = setting_.key;
    if (at == key.size()) return value();
    const bool in_list = key[at] == '[';
    const std::size_t begin = at > 0 ? at + 1 : 0, end = std::min(key.find_first_of(".[]", begin), key.size());
    const std::size_t next = in_list ? end + 1 : end;
    const std::string step = key.substr(begin, end - begin), around = key.substr(0, at > 0 ? at : end);
    if (node.IsDefined() && !node.IsNull() && !(in_list ? node.IsSequence() : node.IsMap()))
      refuse(fmt::format("unknown key: {} is not a {} there", quote(around), in_list ? "list" : "section"));
    const YAML::Node missing(YAML::NodeType::Undefined);
    if (!in_list) {
      YAML::Node section(YAML::NodeType::Map);
      bool found = false;
      for (const auto& entry : node) {
        // A key that stands there twice remains, to be refused.
        const bool is_key = !found && entry.first.IsScalar() && entry.first.Scalar() == step;
        section.force_insert(entry.first, is_key ? applied(entry.second, next) : entry.second);
        found = found || is_key;
      }
      if (!found) section.force_insert(step, applied(missing, next));
      return section;
    }
    const std::size_t size = node.size(), number = std::stoul(step);
    if (number > size) {
      refuse(fmt::format("{} has {} entries; must be one of them, numbered from 0, or the next", around, size));
    }
    YAML::Node list(YAML::NodeType::Sequence);
    for (std::size_t k = 0; k < size; ++k) list.push_back(k == number ? applied(node[k], next) : node[k]);
    if (number == size) list.push_back(applied(missing, next));
    return list;
  }

 private:
  YAML::Node value() const {
    double number;
    // A number needs no parser, which takes 30 us.
    if (setting_.is_literal || read_number(setting_.value, number)) return YAML::Node(setting_.value);
    try {
      return YAML::Load(setting_.value);
    } catch (const YAML::Exception& error) {
      refuse(fmt::format("is not YAML: {}", quote(error.msg, kMaxMessage)));
    }
  }

  [[noreturn]] void refuse(const std::string& reason) const {
    throw SceneError(fmt::format("{}: {} = {}: {}", file_, quote(setting_.key), quote(setting_.value), reason));
  }

  const std::string& file_;
  const SceneSetting& setting_;
};

}  // namespace

SceneSetting::SceneSetting(std::string of, double number) : key(std::move(of)), value(fmt::format("{}", number)) {}

SceneSetting::SceneSetting(std::string of, const Eigen::ArrayXd& numbers)
    : key(std::move(of)), value(fmt::format("[{}]", fmt::join(numbers, ", "))) {}

std::string read_yaml_text(const std::string& path, const char* kind) {
  try {
    return checked_yaml_text(path, read_text_file(path, kMaxBytes), kind);
  } catch (const UnreadableFile& error) {
    throw SceneError(fmt::format("{}: {}; must be a {} file", quote_path(path), error.what(), kind));
  }
}

std::string checked_yaml_text(const std::string& path, std::string text, const char* kind) {
  try {
    refuse_nul(path, text);
    // yaml-cpp 0.6.2 of Ubuntu 20.04 never returns from a file that ends in "{key:". UTF-16 would need another newline.
    if (text.find('\0') == std::string::npos) text += '\n';
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    Bounds bounds(path, kind);
    while (parser.HandleNextDocument(bounds)) {
    }
    YAML::Load(text);  // refuses aliases without an anchor, too
    return text;
  } catch (const YAML::Exception& error) {
    throw SceneError(fmt::format("{}: is not YAML: {}", located(path, error.mark), quote(error.msg, kMaxMessage)));
  }
}

YAML::Node with_settings(const std::string& file, const YAML::Node& root, const SceneSettings& settings) {
  YAML::Node document = root;
  for (const SceneSetting& setting : settings) document.reset(Setter(file, setting).applied(document));
  return document;
}

}  // namespace youbot_base_sim
