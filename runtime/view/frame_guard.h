// SPDX-License-Identifier: Apache-2.0
// Keeps frames within a time (--target-ms): chooses the next frame's reductions from the times of the last frames.
// First detail gets coarser, then levels fall, then the outer parts of foveation get coarser, then levels fall
// further; everything comes back in the reverse order. Fewer pixels would not help: they make frames slower
// (player/xr/README.md).
#pragma once

#include <gsc/frame_types.h>

#include <cstdint>

namespace gsc {

// Settings to start with and return to, and their limits. A setting whose two limits are equal stays.
struct FrameGuardOptions {
    double target_ms = 0;                        // longest time of a frame, above 0; frames are kept just below it
    double finest_bias = 0, coarsest_bias = -16; // range of FrameOptions::lod_bias, in levels
    double fovea_pixels = 0;                     // Foveation::smallest, 0 = no foveation
    double detail = 0, most_detail = 0;          // range of FrameOptions::detail, in pixels
};

// A time is the median of the last three frames, so that a single late frame changes nothing. Nothing changes either
// if the time lies between kQuiet times the target and the target, so that settings come to rest in a steady scene.
//
// Levels and foveation are controlled by a damped integrator: each frame changes them by a share of ln(aim / time),
// fast towards shorter times and slowly back. It needs no knowledge of the scene: it is stable for any whose time
// falls by a factor of up to 8 per level, even if times arrive three frames late.
//
// Detail becomes kFirstDetail if it was 0, else two or four times as coarse. It then waits until all coarse copies
// have been made again; levels fall meanwhile. Detail becomes finer in small steps, after each of which only a few
// copies are due: halving it at once would leave no copy that fits.
class FrameGuard {
public:
    // factors on the target: the time aimed at; the least time at which nothing changes
    static constexpr double kAim = 0.95, kQuiet = 0.9;
    // change in levels per frame, for a time that is off the aim by a factor e
    static constexpr double kDown = 0.15, kUp = 0.03;
    static constexpr double kMostDown = 0.2, kMostUp = 0.03; // largest change in levels per frame
    // With detail, a change of it or of levels makes all coarse copies due at once, and frames that make them take up
    // to a fifth longer: so kQuiet is lower.
    static constexpr double kQuietCoarse = 0.75;
    static constexpr double kBridge = 0.25; // value for kDown until all copies have been made again
    // kMostUp with detail. If it were faster, coarse copies would lack more levels than allowed before all are made
    // again (kMostLevels and kStaleMost in kernels/coarse/coarse_rule.h).
    static constexpr double kMostUpCoarse = 0.0125;
    static constexpr double kLevelsFirst = 2;    // levels that fall before the outer parts of foveation get coarser
    static constexpr double kFoveaDoublings = 2; // largest number of doublings of `fovea_pixels`
    // detail in pixels: first step of the guard; coarsest that the guard may choose
    static constexpr double kFirstDetail = 1, kGuardedDetail = 4;
    static constexpr double kOctave =
        0.25; // a doubling of detail divides a frame's time by e^kOctave; the first pixel saves more
    static constexpr double kFiner = 0.02; // doublings of detail that a frame takes back
    // factor on the target: below this time detail is switched off, after which a frame takes up to 2.5 times as long
    static constexpr double kWithout = 0.4;
    // frames in which all copies are made again: each frame makes an eighth of them
    static constexpr uint32_t kRemade = 8;

    // Precondition: target_ms > 0, coarsest_bias <= finest_bias, detail <= most_detail.
    explicit FrameGuard(const FrameGuardOptions& options);

    // Adds the time of a frame; call it in the order of frames. A time that is not a positive number is ignored.
    void add(double frame_ms);

    // The settings for the next frame.
    [[nodiscard]] double lodBias() const;
    [[nodiscard]] double foveaPixels() const;
    [[nodiscard]] double detail() const { return m_detail; }
    void applyTo(FrameOptions& frame) const;
    // Returns true if a reduction may still be taken back. A view at rest needs some more frames to find out: three
    // for the median, and kRemade after detail became coarser.
    [[nodiscard]] bool gaveUp() const { return m_spent > 0 || m_detail > m_options.detail; }

private:
    [[nodiscard]] bool remade() const { return m_since >= kRemade; }
    void fall(double error);
    void comeBack(double error, double median);
    void setDetail(double pixels);

    FrameGuardOptions m_options;
    double m_levels_first, m_doublings;
    double m_spent = 0; // reductions so far: levels and doublings of fovea_pixels together
    double m_detail;
    uint32_t m_since = kRemade; // frames since detail became coarser or was switched, at most kRemade
    double m_times[3] = {};
    uint32_t m_count = 0; // frames added so far, at most kRemade
};

} // namespace gsc
