#include "youbot_base_sim/ros/parameters.h"

#include <fmt/format.h>

#include <sstream>
#include <vector>

#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

using XmlRpc::XmlRpcValue;

std::string text_of(XmlRpcValue& value) {
  if (value.getType() == XmlRpcValue::TypeString) return fmt::format("\"{}\"", static_cast<std::string>(value));
  if (value.getType() == XmlRpcValue::TypeBoolean) return static_cast<bool>(value) ? "true" : "false";
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string range(double min, double max, const std::string& unit) {
  return fmt::format("from {:g} to {:g}{}{}", min, max, unit.empty() ? "" : " ", unit);
}

}  // namespace

ParameterError Parameters::refusal(const std::string& name, const std::string& value,
                                   const std::string& allowed) const {
  return ParameterError(fmt::format("parameter {}{} = {}: must be {}", prefix_, name, quote(value), allowed));
}

bool Parameters::get(const std::string& name, XmlRpcValue& value) {
  known_.insert(name);
  return node_.getParam(name, value);
}

std::string Parameters::text(const std::string& name, const std::string& default_value) {
  XmlRpcValue value;
  if (!get(name, value)) return default_value;
  if (value.getType() != XmlRpcValue::TypeString) throw refusal(name, text_of(value), "a text");
  return value;
}

bool Parameters::flag(const std::string& name, bool default_value) {
  XmlRpcValue value;
  if (!get(name, value)) return default_value;
  if (value.getType() != XmlRpcValue::TypeBoolean) throw refusal(name, text_of(value), "true or false");
  return value;
}

double Parameters::number(const std::string& name, double default_value, const std::function<bool(double)>& is_allowed,
                          const std::string& allowed) {
  XmlRpcValue value;
  if (!get(name, value)) return default_value;
  const bool whole = value.getType() == XmlRpcValue::TypeInt;
  if (whole || value.getType() == XmlRpcValue::TypeDouble) {
    const double number = whole ? static_cast<double>(static_cast<int>(value)) : static_cast<double>(value);
    if (is_allowed(number)) return number;
  }
  throw refusal(name, text_of(value), allowed);
}

double Parameters::number(const std::string& name, double default_value, double min, double max, const char* unit) {
  return number(
      name, default_value, [&](double x) { return x >= min && x <= max; }, "a number " + range(min, max, unit));
}

double Parameters::zero_or_number(const std::string& name, double default_value, double min, double max,
                                  const char* unit) {
  return number(
      name, default_value, [&](double x) { return x == 0 || (x >= min && x <= max); },
      "0, or a number " + range(min, max, unit));
}

void Parameters::refuse_others() const {
  std::vector<std::string> names;
  node_.getParamNames(names);
  const std::string mine = node_.getNamespace() + "/";
  for (const std::string& name : names) {
    if (name.rfind(mine, 0) != 0) continue;
    const std::string key = name.substr(mine.size(), name.find('/', mine.size()) - mine.size());
    if (known_.count(key)) continue;
    throw ParameterError(
        fmt::format("parameter {}{} is unknown; known are: {}", prefix_, quote(key), fmt::join(known_, ", ")));
  }
}

}  // namespace youbot_base_sim
