#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "processing/relight/environment.h"
#include "processing/relight/relight.h"

namespace darkbox {

/// How a picture's bytes stand for linear radiance 0...1, which is cut there.
enum class Encoding {
    srgb,    ///< IEC 61966-2-1, for looking at
    linear,  ///< byte = 255 x radiance
};

/// A scene made ready to be rendered many times into buffers of the caller's. Float pictures are exact: they are
/// computed from the scene's own maps. Byte pictures are made for speed from a compact copy of them, 14 bytes a pixel,
/// and are within one level of the float picture's. A pixel that is outside the object, or has no normal, is black and
/// costs next to nothing. Every picture has the same bits on any number of threads.
///
/// A buffer is a cv::Mat of the scene's size; it may be a view of any memory and its rows may lie apart. The scene's
/// maps are shared, not copied, and must not change as long as the Relighter lives. Thread-compatible.
class Relighter {
public:
    /// Checks the maps. Throws InputError for maps that do not fit together, hold values that are not finite, normals
    /// that are not unit vectors or labels beyond the texels.
    explicit Relighter(const RelightScene& scene, const WorkContext& work = {});
    Relighter(Relighter&&) noexcept;
    Relighter& operator=(Relighter&&) noexcept;
    ~Relighter();

    cv::Size size() const;

    // Each throws InputError for options out of range, lights that cannot be, or a buffer of another size.

    /// Sum over the used lights, as relight() describes it.
    void render(const Lights& lights, const RelightOptions& options, cv::Mat3f& into,
                const WorkContext& work = {}) const;
    void render(const Lights& lights, const RelightOptions& options, Encoding encoding, cv::Mat3b& into,
                const WorkContext& work = {}) const;

    /// The probe folded for this object: as good for any number of frames of the same model, yaw and shading.
    FoldedEnvironment fold(const Environment& environment, const RelightOptions& options,
                           const WorkContext& work = {}) const;
    /// Of the options, lookup and exposure are used; the model and the yaw are those of the fold.
    void render(const FoldedEnvironment& environment, const RelightOptions& options, cv::Mat3f& into,
                const WorkContext& work = {}) const;
    void render(const FoldedEnvironment& environment, const RelightOptions& options, Encoding encoding, cv::Mat3b& into,
                const WorkContext& work = {}) const;

    void render(ConstantCoefficient coefficient, const RelightOptions& options, cv::Mat3f& into,
                const WorkContext& work = {}) const;
    void render(ConstantCoefficient coefficient, const RelightOptions& options, Encoding encoding, cv::Mat3b& into,
                const WorkContext& work = {}) const;

private:
    struct Prepared;
    std::unique_ptr<const Prepared> prepared_;
};

}  // namespace darkbox
