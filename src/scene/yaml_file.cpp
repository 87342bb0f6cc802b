#include "youbot_base_sim/scene/yaml_file.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <sstream>

#include "youbot_base_sim/scene/scene.h"
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

YAML::Node read_yaml_file(const std::string& path) { return YAML::Load(read_yaml_text(path)); }

}  // namespace youbot_base_sim
