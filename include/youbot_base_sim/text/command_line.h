#pragma once

#include <algorithm>
#include <boost/program_options.hpp>
#include <charconv>
#include <cstdint>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/text/number.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/suggestion.h"
#include "youbot_base_sim/text/version.h"

namespace youbot_base_sim {

/// An invalid option, in one line that names the option, its value and what is allowed.
class OptionError : public std::runtime_error {
 public:
  OptionError(const std::string& option, const std::string& value, const std::string& allowed)
      : std::runtime_error(option + " = " + (value.empty() ? "\"\"" : quote(value)) + ": must " + allowed) {}
};

/// The number that an option's value is. Throws OptionError.
inline double number_of(const std::string& option, const std::string& value, const Range& range) {
  double number = 0;
  if (read_number(value, number) && contains(range, number)) return number;
  throw OptionError(option, value, "be " + text_of(range));
}

/// The whole number from `min` to `max` that an option's value is, in digits alone. Throws OptionError.
inline std::uint64_t whole_number_of(const std::string& option, const std::string& value, std::uint64_t min,
                                     std::uint64_t max) {
  std::uint64_t number = 0;
  const char* const end = value.data() + value.size();
  const auto [parsed, error] = std::from_chars(value.data(), end, number);
  if (error == std::errc() && parsed == end && number >= min && number <= max) return number;
  throw OptionError(option, value, "be a whole number from " + std::to_string(min) + " to " + std::to_string(max));
}

/// A program's call and the texts of its --help.
struct Usage {
  std::string call;      ///< "PROGRAM FILE [options]"
  std::string purpose;   ///< what --help prints before the options
  std::string remarks;   ///< what it prints after them
  std::string examples;  ///< command lines, which --help prints last
};

/// An argument without an option's name.
struct Positional {
  const char* name;
  const boost::program_options::value_semantic* value;  ///< of a std::string or a std::vector of them; owned by `parse`
  int max_count;                                        ///< -1: any number
  bool required;                                        ///< otherwise an empty text counts as none
};

/// Reads a command line into the variables of `options` and `positional`. Returns false where it asked for --help or
/// --version, which are printed. Throws std::runtime_error with one line, OptionError for an empty text, such as an
/// unset shell variable.
inline bool parse(int argc, char** argv, const Usage& usage, boost::program_options::options_description options,
                  const Positional& positional) {
  namespace po = boost::program_options;
  const std::string program = usage.call.substr(0, usage.call.find(' '));
  options.add_options()("help,h", "print this")("version", "print the version");
  po::options_description all;
  all.add(options).add_options()(positional.name, positional.value);
  po::positional_options_description places;
  places.add(positional.name, positional.max_count);
  po::parsed_options parsed(&all);
  po::variables_map given;
  try {
    parsed = po::command_line_parser(argc, argv).options(all).positional(places).run();
    po::store(parsed, given);
    po::notify(given);
  } catch (const po::unknown_option& error) {
    std::vector<std::string> known;
    for (const auto& option : options.options()) known.push_back("--" + option->long_name());
    const std::string meant = suggestion(error.get_option_name(), known);
    throw std::runtime_error(quote(error.what(), kMaxMessage) +
                             (meant.empty() ? "; see " + program + " --help" : meant));
  } catch (const po::error& error) {
    throw std::runtime_error(quote(error.what(), kMaxMessage) + "; see " + program + " --help");
  }
  if (given.count("help")) {
    std::cout << "Usage: " << usage.call << "\n\n" << usage.purpose << "\n\n" << options << usage.remarks;
    std::cout << "\nExamples:\n" << usage.examples;
    return false;
  }
  if (given.count("version")) {
    std::cout << program << " " << version() << "\n";
    return false;
  }
  if (positional.required && !given.count(positional.name))
    throw std::runtime_error(std::string("no ") + positional.name + " given; usage: " + usage.call);
  for (const po::option& option : parsed.options) {
    const bool is_positional = option.string_key == positional.name;
    if (std::count(option.value.begin(), option.value.end(), "") > 0 && (!is_positional || positional.required))
      throw OptionError((is_positional ? "" : "--") + option.string_key, "", "not be empty");
  }
  return true;
}

}  // namespace youbot_base_sim
