#pragma once

namespace darkbox {

/// The sensor's noise in linear radiance (1.0 = full scale), for the mean over channels that normals are found from.
struct NoiseModel {
    double read_sigma = 0;    ///< standard deviation in the dark
    double shot_gain = 0;     ///< variance for each unit of radiance
    double quantisation = 0;  ///< radiance between two neighbouring sample values; uniform error, variance step^2 / 12

    double variance(double radiance) const;
    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

}  // namespace darkbox
