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

/// A number, or a text that is one: YAML, as of roslaunch, takes 1e-5 for a text.
bool read_number(XmlRpcValue& value, double& number) {
  switch (value.getType()) {
    case XmlRpcValue::TypeInt:
      number = static_cast<int>(value);
      return true;
    case XmlRpcValue::TypeDouble:
      number = static_cast<double>(value);
      return true;
    case XmlRpcValue::TypeString:
      return youbot_base_sim::read_number(static_cast<std::string>(value), number);
    default:
      return false;
  }
}

}  // namespace

ParameterError Parameters::refusal(const std::string& name, const std::string& value,
                                   const std::string& allowed) const {
  return ParameterError(fmt::format("parameter {}{} = {}: must be {}", prefix_, name, quote(value), allowed));
}

bool Parameters::get(const std::string& name, XmlRpcValue& value) {
  known_.insert(name);
  if (!node_.getParam(name, value)) return false;
  if (value.getType() != XmlRpcValue::TypeString) return true;
  const std::string& text = value;
  return !text.empty() && text != "unset";
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
  if (double number; read_number(value, number) && contains(range, number)) return number;
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
