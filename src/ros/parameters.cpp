#include "youbot_base_sim/ros/parameters.h"

#include <fmt/format.h>

#include <sstream>
#include <vector>

#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

using XmlRpc::XmlRpcValue;

std::string shown(XmlRpcValue& value) {
  if (value.getType() == XmlRpcValue::TypeString) return fmt::format("\"{}\"", static_cast<std::string>(value));
  if (value.getType() == XmlRpcValue::TypeBoolean) return static_cast<bool>(value) ? "true" : "false";
  std::ostringstream text;
  text << value;
  return text.str();
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
  if (value.getType() != XmlRpcValue::TypeString) throw refusal(name, shown(value), "a text");
  return value;
}

std::optional<bool> Parameters::flag(const std::string& name, std::optional<bool> default_value) {
  XmlRpcValue value;
  if (!get(name, value)) return default_value;
  if (value.getType() != XmlRpcValue::TypeBoolean) throw refusal(name, shown(value), "true or false");
  return static_cast<bool>(value);
}

bool Parameters::flag(const std::string& name, bool default_value) { return *flag(name, std::optional(default_value)); }

std::optional<double> Parameters::number(const std::string& name, std::optional<double> default_value,
                                         const Range& range) {
  XmlRpcValue value;
  if (!get(name, value)) return default_value;
  const bool whole = value.getType() == XmlRpcValue::TypeInt;
  if (whole || value.getType() == XmlRpcValue::TypeDouble) {
    const double number = whole ? static_cast<double>(static_cast<int>(value)) : static_cast<double>(value);
    if (contains(range, number)) return number;
  }
  throw refusal(name, shown(value), text_of(range));
}

double Parameters::number(const std::string& name, double default_value, const Range& range) {
  return *number(name, std::optional(default_value), range);
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
