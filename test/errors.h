#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace youbot_base_sim {

/// What the `Error` says that `act` throws; empty if it throws none.
template <class Error, class Act>
std::string error_of(const Act& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

inline void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words) EXPECT_NE(text.find(word), std::string::npos) << word << " is not in: " << text;
}

}  // namespace youbot_base_sim
