#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace youbot_base_sim {

// Cells of the file of that name in test/data, by row and without the head.
inline std::vector<std::vector<std::string>> reference_rows(const std::string& name) {
  std::ifstream file(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/" + name + ".csv");
  EXPECT_TRUE(file) << name;
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

}  // namespace youbot_base_sim
