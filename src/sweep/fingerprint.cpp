#include "youbot_base_sim/sweep/fingerprint.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include <boost/crc.hpp>
#include <filesystem>
#include <limits>

#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {

namespace {

/// The CRC of 64 bits of ECMA-182: what was changed by mistake has another one.
std::string hash(const std::string& text) {
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693> crc;
  crc.process_bytes(text.data(), text.size());
  return fmt::format("{:016x}", crc.checksum());
}

std::string file_hash(const std::string& path) {
  try {
    return hash(read_text_file(path, std::numeric_limits<std::size_t>::max()));
  } catch (const UnreadableFile& error) {
    throw SceneError(fmt::format("{}: {}", quote_path(path), error.what()));
  }
}

/// The file with the code that simulates: a library, or the program itself, which has no name among those loaded.
std::string library() {
  Dl_info info{};
  link_map* loaded = nullptr;
  const bool found = dladdr1(reinterpret_cast<const void*>(&read_scene_file), &info, reinterpret_cast<void**>(&loaded),
                             RTLD_DL_LINKMAP) != 0;
  return found && loaded->l_name[0] != '\0' ? loaded->l_name : "/proc/self/exe";
}

std::string name_of_file(const std::string& path) { return quote(std::filesystem::path(path).filename().string()); }

}  // namespace

std::vector<std::string> fingerprint(const Family& family) {
  std::vector<std::string> lines = {
      fmt::format("{} build of sweep", hash(file_hash("/proc/self/exe") + file_hash(library()))),
      fmt::format("{} {}", hash(family.text), name_of_file(family.path)),
      fmt::format("{} {}", hash(family.scene.text), name_of_file(family.scene.path))};
  for (const std::string& table : family.tables) {
    lines.push_back(fmt::format("{} {}", file_hash(table), name_of_file(table)));
  }
  return lines;
}

}  // namespace youbot_base_sim
