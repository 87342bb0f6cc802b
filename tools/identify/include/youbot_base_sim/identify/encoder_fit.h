#pragma once

#include <optional>
#include <vector>

#include "youbot_base_sim/identify/fit.h"

namespace youbot_base_sim {

/// The result of a fit to encoders and poses. Errors are those of displacements.
struct EncoderFit : Fit {
  struct Drive {
    ClockMap clock, sigma;
    /// Wheel angles where the encoders read zero, but for whole rollers, and their sigma, rad. Empty: not known.
    std::optional<Wheels> angles_at_zero, angles_sigma;
    int jumps = 0;  ///< of ground truth, which are left out
  };

  std::vector<Drive> drives;    ///< of each record
  double resolution = 0;        ///< the settings'
  double error_kinematics = 0;  ///< by fitted kinematics: factors forward, lateral and of yaw
  double wheel_error = 0;       ///< relative, of a wheel's path over 4 s: SlipOdometry's, for its covariances
  double error_unknown = 0;     ///< by the fitted parameters, as a mean over where the rollers may stand
};

struct EncoderFitSettings : FitSettings {
  double resolution = 0;    ///< of encoders without rates, rad: see WheelSpline
  bool find_angles = true;  ///< false: for a mean over where the rollers may stand, as of SlipOdometry's replicas
};

/// Fits `encoder_parameters()`, the clock of each record and where its rollers stood to the records' poses, along which
/// the wheels turn as their encoders read: bounded robust least squares on how far the base comes in each quarter of a
/// second, with the covariance of a tracker's noise and of errors that grow. Every third stretch of 4 s is held out; a
/// parameter is kept only if it lowers the error there. Records must be inspected. Throws UnusableRecord, and Stopped
/// once settings.workers.stop is set.
EncoderFit fit_encoders(const Scene& start, const std::vector<DriveRecord>& records,
                        const EncoderFitSettings& settings = {});

}  // namespace youbot_base_sim
