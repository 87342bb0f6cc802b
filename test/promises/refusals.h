#pragma once

// What every refusal must be, of any file or program.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "program.h"

namespace youbot_base_sim {

/// Expects one line that a terminal may show, which has all of `parts`: of what, its value, what is allowed.
inline void expect_refusal(const std::string& line, const std::vector<std::string>& parts) {
  constexpr std::size_t kMaxLength = 1000;  // the longest lists the parameters of base_node
  EXPECT_FALSE(line.empty()) << "not refused";
  EXPECT_LE(line.size(), kMaxLength) << line.substr(0, kMaxLength);
  EXPECT_TRUE(std::none_of(line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; })) << line;
  for (const std::string& part : parts) EXPECT_NE(line.find(part), std::string::npos) << part << " is not in: " << line;
}

/// Everything that is in a folder by its path: contents of files, targets of links, kinds of what else there is.
inline std::map<std::string, std::string> contents_of(const std::string& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    std::string& content = contents[entry.path()];
    content = std::to_string(static_cast<int>(entry.symlink_status().type())) + " ";
    if (entry.is_symlink()) content += std::filesystem::read_symlink(entry.path());
    std::error_code dangling;
    if (!entry.is_regular_file(dangling)) continue;
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    content += text.str();
  }
  return contents;
}

/// Runs a program that must refuse its arguments: exit status 2, and a refusal that has `parts` for all that it prints,
/// with everything in the folder as it was.
inline void expect_program_refuses(const TemporaryFolder& folder, const std::string& path,
                                   const std::vector<std::string>& arguments, const std::vector<std::string>& parts) {
  testing::Message shown;
  shown << path.substr(path.rfind('/') + 1);
  for (const std::string& argument : arguments) shown << " '" << argument.substr(0, 80) << "'";
  SCOPED_TRACE(shown);
  const auto before = contents_of(folder.path(""));
  Program program(path, arguments);
  EXPECT_EQ(program.wait(), 2);
  EXPECT_EQ(program.out(), "");
  std::string line = program.err();
  ASSERT_FALSE(line.empty());
  EXPECT_EQ(line.back(), '\n');
  line.pop_back();
  expect_refusal(line, parts);
  EXPECT_TRUE(contents_of(folder.path("")) == before) << "something was written or changed";
}

}  // namespace youbot_base_sim
