#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// The measurements that determine a parameter.
enum class Needs { kRates, kTorques, kTruth };

/// One number of a scene that is fitted. The scene must have its section `motors`.
struct Parameter {
  const char* section;  ///< of the scene
  const char* key;      ///< in it
  const char* unit;
  double min, max;  ///< of what is tried
  double step;      ///< change by which its effect is measured: well above the integration's error
  Needs needs;
  bool by_law;        ///< determined by the loops' law, see FirstGuess
  const char* drive;  ///< that would determine it, for the message where a record does not
  double (*get)(const Scene&);
  void (*set)(Scene&, double);

  std::string name() const { return std::string(section) + "." + key; }
};

/// All parameters.
const std::vector<Parameter>& parameters();

/// The parameters that encoders and a pose alone determine, for fit_encoders: the sizes first.
const std::vector<Parameter>& encoder_parameters();

/// The number of the parameter with this key.
std::size_t parameter(const std::string& key);

}  // namespace youbot_base_sim
