#include "youbot_base_sim/text/suggestion.h"

#include <algorithm>
#include <numeric>

namespace youbot_base_sim {

namespace {

constexpr std::size_t kLongest = 60;  // characters of a word that is looked up

/// The fewest letters of a to insert, delete, replace or swap with a neighbour that make it b.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  // Distances of the beginnings of a that end two letters before, one before and at the present one, to those of b.
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    before = last;
    last = row;
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = std::min({last[j] + (a[i] != b[j]), row[j] + 1, last[j + 1] + 1});
      const bool swapped = i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j];
      if (swapped) row[j + 1] = std::min(row[j + 1], before[j - 1] + 1);
    }
  }
  return row.back();
}

}  // namespace

std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
  if (word.size() > kLongest) return "";
  const auto closer = [&](const auto& a, const auto& b) { return edit_distance(word, a) < edit_distance(word, b); };
  const auto nearest = std::min_element(known.begin(), known.end(), closer);
  if (nearest == known.end() || edit_distance(word, *nearest) > std::min<std::size_t>(2, nearest->size() / 3))
    return "";
  return "; did you mean " + *nearest + "?";
}

}  // namespace youbot_base_sim
