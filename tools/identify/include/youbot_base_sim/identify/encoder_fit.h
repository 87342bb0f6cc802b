#pragma once

#include <Eigen/Dense>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/fitted_parameters.h"
#include "youbot_base_sim/identify/forward_model.h"

namespace youbot_base_sim {

/// Relates ground truth to the instants of the encoders' clock. A fit begins at the same ones: the reader of bags finds
/// an offset of more than a tenth of a second.
struct ClockMap {
  double offset = 0;   ///< s, at the first reading
  double stretch = 0;  ///< s of ground truth for one of the encoders, less 1

  double operator()(double t) const { return (1 + stretch) * t + offset; }
};

/// The result of a fit to encoders and poses, from a scene to another.
struct EncoderFit {
  struct Number {
    std::size_t parameter;  ///< of `encoder_parameters()`
    double value, sigma;
    double error_without;  ///< held-out error with it at its start, to which the others adapt to first order
  };
  struct Drive {
    ClockMap clock, sigma;
    /// Wheel angles where the encoders read zero, but for whole rollers, and their sigma, rad. Empty: not known.
    std::optional<Wheels> angles_at_zero, angles_sigma;
  };

  Scene scene;                              ///< the start with the fitted parameters
  std::vector<Number> numbers;              ///< that lower the held-out error
  std::vector<std::string> unidentifiable;  ///< a line on each of the others
  std::vector<Drive> drives;                ///< of each record
  // RMS of the base's error after a quarter of a second on held-out stretches, over its scatter after the fit:
  double error_before = 0;      ///< by the start, as a mean over where the rollers may stand
  double error_kinematics = 0;  ///< by fitted kinematics: factors forward, lateral and of yaw
  double error_unknown = 0;     ///< by the fitted parameters, as a mean over where the rollers may stand
  double error_after = 0;
};

struct EncoderFitSettings {
  double resolution = 0;    ///< of encoders without rates, rad: see WheelSpline
  bool find_angles = true;  ///< false: for a mean over where the rollers may stand, as of SlipOdometry's replicas
  Workers workers;
  std::function<void(double share)> progress = [](double) {};  ///< called now and then with what is done, 0 to 1
};

/// Fits `encoder_parameters()`, the clock of each record and where its rollers stood to the records' poses, along which
/// the wheels turn as their encoders read: bounded robust least squares on how far the base comes in each quarter of a
/// second. Every third stretch of 4 s is held out; a parameter is kept only if it lowers the error there. Records must
/// be inspected. Throws UnusableRecord, and Stopped once settings.workers.stop is set.
EncoderFit fit_encoders(const Scene& start, const std::vector<DriveRecord>& records,
                        const EncoderFitSettings& settings = {});

}  // namespace youbot_base_sim
