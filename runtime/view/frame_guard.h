// SPDX-License-Identifier: Apache-2.0
// Holds the time of frames (--target-ms): chooses the next frame's reductions from the times of the last ones. First
// detail becomes coarser, then levels fall, then the periphery gets coarser, then the other levels fall; all comes back
// in the reverse order. Pure. Fewer pixels would make frames slower (player/xr/README.md).
#pragma once

#include <gsc/frame_types.h>

#include <cstdint>

namespace gsc {

// Settings to start from, and to return to; equal ends: that setting stays.
struct FrameGuardOptions {
    double target_ms = 0;                        // above 0; frames are kept just below it
    double finest_bias = 0, coarsest_bias = -16; // levels, FrameOptions::lod_bias
    double fovea_pixels = 0;                     // Foveation::smallest, 0 = there is no foveation
    double detail = 0, most_detail = 0;          // pixels, FrameOptions::detail
};

// Times are medians of the last three frames, so that a single late one moves nothing. Between `kQuiet` of the target and
// the target itself nothing moves, which is why a steady scene comes to rest.
//
// Levels and periphery are a damped integrator: each frame moves them by a share of ln(aim / time), quickly down and slowly
// up. It knows nothing of the scene: it holds for anything whose time falls by a factor of up to 8 per level, told up to
// three frames late.
//
// Detail doubles, once or twice, from 0 to kFirstDetail, and then waits until coarse copies have been made anew; levels
// bridge that time. It becomes finer in small steps, each of which makes few copies due: an octave at once would leave none
// that fits.
class FrameGuard {
public:
    static constexpr double kAim = 0.95, kQuiet = 0.9;       // in target times
    static constexpr double kDown = 0.15, kUp = 0.03;        // levels per frame and factor e off the aim
    static constexpr double kMostDown = 0.2, kMostUp = 0.03; // levels per frame
    // With detail, a change of it or of levels makes all coarse copies due at once, and frames that make them take up
    // to a fifth longer.
    static constexpr double kQuietCoarse = 0.75; // in target times
    static constexpr double kBridge = 0.25;      // kDown until copies are made anew
    // Faster, and coarse copies lack more levels than they may before all are made anew (kMostLevels and
    // kStaleMost in kernels/coarse/coarse_rule.h).
    static constexpr double kMostUpCoarse = 0.0125;
    static constexpr double kLevelsFirst = 2;                     // levels that fall before the periphery does
    static constexpr double kFoveaDoublings = 2;                  // most doublings of `fovea_pixels`
    static constexpr double kFirstDetail = 1, kGuardedDetail = 4; // pixels
    static constexpr double kOctave =
        0.25; // factors e of a frame's time that a doubling saves; the first pixel saves more
    static constexpr double kFiner = 0.02; // octaves of detail that a frame gives back
    // in target times: below this detail ends, after which a frame takes up to 2.5 times as long
    static constexpr double kWithout = 0.4;
    static constexpr uint32_t kRemade = 8; // frames in which copies are made anew: a frame makes an eighth of all

    // Precondition: target_ms > 0, coarsest_bias <= finest_bias, detail <= most_detail.
    explicit FrameGuard(const FrameGuardOptions& options);

    // Takes the times of frames, in order. A time that is not a positive number is passed over.
    void add(double frame_ms);

    // Settings for the next frame.
    [[nodiscard]] double lodBias() const;
    [[nodiscard]] double foveaPixels() const;
    [[nodiscard]] double detail() const { return m_detail; }
    void applyTo(FrameOptions& frame) const;
    // True if a reduction may still be taken back. A view at rest takes some frames more to tell: three for the median,
    // and kRemade behind coarser detail.
    [[nodiscard]] bool gaveUp() const { return m_spent > 0 || m_detail > m_options.detail; }

private:
    [[nodiscard]] bool remade() const { return m_since >= kRemade; }
    void fall(double error);
    void comeBack(double error, double median);
    void setDetail(double pixels);

    FrameGuardOptions m_options;
    double m_levels_first, m_doublings;
    double m_spent = 0; // levels and doublings together
    double m_detail;
    uint32_t m_since = kRemade; // frames since detail became coarser or was switched, at most kRemade
    double m_times[3] = {};
    uint32_t m_count = 0; // frames counted, at most kRemade
};

} // namespace gsc
